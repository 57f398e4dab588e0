#include "core/chaos/exponential.h"

#include <algorithm>
#include <cmath>

#include "core/chaos/gauss_rule.h"
#include "core/chaos/stieltjes.h"

namespace polyest::internal {
namespace {

constexpr int kNodesForDensity = 20;

}  // namespace

// 2 sinh r = e^r (1 − e^{−2r})
double LogExponentialNormalization(double rate) {
  return std::log(rate / -std::expm1(-2 * rate)) - rate;
}

double ExponentialProbability(double rate, double xi) {
  return std::expm1(rate * (1 + std::clamp(xi, -1.0, 1.0))) / std::expm1(2 * rate);
}

double UpperExponentialProbability(double rate, double xi) {
  return std::expm1(-rate * (1 - std::clamp(xi, -1.0, 1.0))) / std::expm1(-2 * rate);
}

double ExponentialQuantile(double rate, double probability) {
  return std::log1p(probability * std::expm1(2 * rate)) / rate - 1;
}

double UpperExponentialQuantile(double rate, double probability) {
  return std::log1p(probability * std::expm1(-2 * rate)) / rate + 1;
}

RecurrenceCoefficients ExponentialRecurrence(double rate, int count) {
  const GaussRule rule = MakeGaussRule(Germ::Uniform(), count + kNodesForDensity);
  DiscreteMeasure measure{-1, 1 + rule.nodes.array(),
                          rule.weights.array() * (rate * (rule.nodes.array() - 1)).exp()};
  measure.weights /= measure.weights.sum();
  return StieltjesRecurrence(measure, count);
}

}  // namespace polyest::internal
