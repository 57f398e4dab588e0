#pragma once

// Detects samples that are too far apart.
//
// They can miss what a parameter changes (§3.2): two samples per period can fall on every zero
// crossing. Let y(t) be the measured outputs and s the parameter in units of its prior standard
// deviation. The information of samples at times t_k relative to the prior's is Σ_k (∂y/∂s)²/R. It
// is compared at the sample times and at as many times between them.
//
// And they can be taken for those of another response: a vibration faster than half the sampling
// rate has the samples of one that is slower or faster by the sampling rate. Minima that lie so far
// apart are found in few dimensions only, so that an estimate at one of them asks for a warning.

#include <vector>

#include "core/estimator/posterior/diagnosis.h"

namespace polyest::internal {

// Appends UNDERSAMPLED for each parameter that is not identified and that samples at other times
// would identify. Appends it, too, if the response at an estimate that tells of the data has more
// than one turning point between two evenly spaced samples, and another number for other values
// that the prior allows; this is not examined for models that simulate themselves. The model runs
// over the beginning of the record. Appends nothing if it cannot be run there, or for a problem
// with streamed inputs, which are not known between rows.
void AddUndersampling(const Findings& findings, const Estimate& estimate,
                      std::vector<Diagnostic>& diagnostics);

}  // namespace polyest::internal
