#pragma once

#include "core/estimator/record/correlation_profile.h"
#include "core/estimator/record/row_block.h"

namespace polyest::internal {

// Returns what a sample of a channel with correlated noise (τ > 0) tells of a mean, in units of an
// independent sample, 0 … 1. For noise without a white share this is s, the mean of
// (1 − a)/(1 + a) over the intervals of the record's beginning, a = exp(−Δt/τ). With a white share
// f it is 1/(f + (1 − f)/s), because the variances of both parts' means add up.
double IndependentShare(const RowBlock& beginning, int channel, const NoiseShape& noise);

}  // namespace polyest::internal
