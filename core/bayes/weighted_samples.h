#pragma once

// Summaries of weighted draws x_i, w_i ≥ 0, Σ w = 1.

#include <random>
#include <vector>

#include "core/common/types.h"
#include "polyest/density.h"

namespace polyest::internal {

// Returns (Σ w)²/Σ w², the number of equally weighted draws that tell as much, for weights that
// need not be normalized; of those that are it is 1/Σ w².
double EffectiveSizeOfWeights(const ConstVectorRef& weights);

double WeightedMean(const ConstVectorRef& draws, const ConstVectorRef& weights);
double WeightedStandardDeviation(const ConstVectorRef& draws, const ConstVectorRef& weights);

// The quantiles of one quantity; sorts once. The cumulative probability of the i-th smallest draw
// is Σ_{j<i} w_j + w_i/2, linear between draws.
class WeightedQuantiles {
 public:
  WeightedQuantiles(const ConstVectorRef& draws, const ConstVectorRef& weights);
  double operator()(double probability) const;  // 0 ≤ probability ≤ 1

 private:
  Vector draws_;  // ascending
  Vector cumulative_;
};

// Returns a histogram over the central 99.9 % of the probability, with bins of equal width, in
// probability per unit of the quantity; its area is that probability and not 1. Returns one bin of
// unit width and density 1 if the draws do not vary.
DensityEstimate WeightedDensity(const ConstVectorRef& draws, const ConstVectorRef& weights,
                                int bins);

// Returns such a histogram of two quantities, bins × bins.
JointDensity WeightedJointDensity(const ConstVectorRef& first, const ConstVectorRef& second,
                                  const ConstVectorRef& weights, int bins);

// Returns the rows of `count` equally weighted draws among the weighted ones, by systematic
// resampling with evenly spaced pointers: deterministic, and each draw as often as its weight says.
std::vector<Eigen::Index> EquallyWeighted(const ConstVectorRef& weights, int count);

// Returns as many by stratified resampling, with each pointer at another place in its stretch of
// the weight, by a golden-ratio sequence. For few draws that stand for all: where these are a
// low-discrepancy sequence, evenly spaced pointers go in step with it and miss whole layers.
std::vector<Eigen::Index> StratifiedDraws(const ConstVectorRef& weights, int count);

// Puts rows in a random order (Fisher and Yates).
void Shuffle(std::vector<Eigen::Index>& rows, std::mt19937_64& generator);

}  // namespace polyest::internal
