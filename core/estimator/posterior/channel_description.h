#pragma once

// How well the model fits the samples of each measured output.

#include <vector>

#include "core/estimator/posterior/assessment.h"

namespace polyest::internal {

// Returns the description of each channel at the minimum η of the cost. `posterior` are draws from
// the cost, `fitted` is the number of parameters that the data determine.
std::vector<ChannelEstimate> DescribeChannels(const AssessmentRequest& request, const Cost& cost,
                                              const Vector& eta, const PosteriorDraws& posterior,
                                              double fitted);

}  // namespace polyest::internal
