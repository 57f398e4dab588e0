#pragma once

// Summaries of weighted draws x_i, w_i ≥ 0, Σ w = 1.

#include <vector>

#include "core/chaos/expansion.h"
#include "core/common/types.h"

namespace polyest {

double WeightedMean(const ConstVectorRef& draws, const ConstVectorRef& weights);
double WeightedStandardDeviation(const ConstVectorRef& draws, const ConstVectorRef& weights);

// Quantiles of one quantity: sorts once. The cumulative probability of the i-th smallest draw is
// Σ_{j<i} w_j + w_i/2, linear between draws.
class WeightedQuantiles {
 public:
  WeightedQuantiles(const ConstVectorRef& draws, const ConstVectorRef& weights);
  double operator()(double probability) const;  // 0 ≤ probability ≤ 1

 private:
  Vector draws_;  // ascending
  Vector cumulative_;
};

// A histogram over the central 99.9 % of the probability, with bins of equal width, in units of
// probability per unit of the quantity: its area is what lies between, not 1. One bin of unit width
// and density 1 when the draws do not vary.
DensityEstimate WeightedDensity(const ConstVectorRef& draws, const ConstVectorRef& weights,
                                int bins);

struct JointDensity {
  Vector first, second;  // bin centres
  Matrix density;        // first × second, in 1/(unit of the first · unit of the second)
};
// The same of two quantities, bins × bins.
JointDensity WeightedJointDensity(const ConstVectorRef& first, const ConstVectorRef& second,
                                  const ConstVectorRef& weights, int bins);

// Rows of `count` equally weighted draws among the weighted ones, by systematic resampling with
// evenly spaced pointers: the same for the same arguments, and each as often as its weight says.
std::vector<Eigen::Index> EquallyWeighted(const ConstVectorRef& weights, int count);

}  // namespace polyest
