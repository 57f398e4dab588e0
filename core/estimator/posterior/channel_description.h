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

// Returns the degrees of freedom of each channel, the mean of χ² if model and noise are right: its
// samples less what the fit has used up, which is its share of `fitted` and what has gone into the
// parameters of ended runs. They are at least 0.
std::vector<double> DegreesOfFreedom(const AssessmentRequest& request,
                                     const std::vector<ChannelEstimate>& channels, double fitted);

}  // namespace polyest::internal
