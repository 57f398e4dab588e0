#pragma once

// Detects samples that are too far apart.
//
// They can miss what a parameter changes (§3.2): two samples per period can fall on every zero
// crossing. Let y(t) be the measured outputs and s the parameter in units of its prior standard
// deviation. The information of samples at times t_k relative to the prior's is Σ_k (∂y/∂s)²/R. It
// is compared at the sample times and at as many times between them.
//
// They can also fit several responses: two vibrations whose frequencies differ by the sampling rate
// have the same samples. The cost then has minima that lie far apart, which the search finds in few
// dimensions only. An estimate at one of them asks for a warning.

#include <vector>

#include "core/estimator/posterior/diagnosis.h"

namespace polyest::internal {

// Appends UNDERSAMPLED for each parameter that is not identified and that samples at other times
// would identify. Appends it, too, if an estimate that tells of the data has a response of which
// evenly spaced samples are rare (half a turning point or more between two of them; one or more
// with up to three parameters), and the prior allows values with which a vibration of another
// frequency has the same samples; this is not examined for models that simulate themselves. The
// model runs over the beginning of the record. Appends nothing if it cannot be run there or is
// stopped, or for a problem with streamed inputs, which are not known between rows.
void AddUndersampling(const Findings& findings, const Estimate& estimate, const Stop& stop,
                      std::vector<Diagnostic>& diagnostics);

}  // namespace polyest::internal
