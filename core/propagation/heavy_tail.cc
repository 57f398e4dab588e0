#include "core/propagation/heavy_tail.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

// The first node in log λ and the step for ν = 4; for a larger ν they are closer to 0.
constexpr double kFirstNode = -10, kStep = 0.5;
// The density relative to that at 0 from which on its logarithm is taken without log1p.
constexpr double kFarOff = 1e-3;

}  // namespace

HeavyTail::HeavyTail(double degrees_of_freedom) {
  const double half = 0.5 * degrees_of_freedom;
  const double narrower = std::min(1.0, std::sqrt(kTailDegreesOfFreedom / degrees_of_freedom));
  double sum = 0;
  for (size_t k = 0; k < kNodes; ++k) {
    const double s = narrower * (kFirstNode + kStep * static_cast<double>(k));
    // λ^{ν/2} e^{−νλ/2}, relative to its largest value
    nodes_[k] = {std::exp(-s), std::exp(half * (s - std::expm1(s)))};
    sum += nodes_[k].probability;
  }
  for (Node& node : nodes_) {
    node.probability /= sum;
    peak_ += node.probability / std::sqrt(node.inverse_precision);
  }
}

HeavyTail::Result HeavyTail::Take(double error, double variance, double scale,
                                  double stated) const {
  const double widest = variance + scale * scale * nodes_.front().inverse_precision;
  const double deviation = std::abs(error) / std::sqrt(widest), square = deviation * deviation;
  std::array<double, kNodes> weights;  // π, up to a factor
  double at_zero = 0, change = 0;      // p(0) and p(e) − p(0)
  double sum = 0, precision = 0, noise = 0;
  for (size_t k = 0; k < kNodes; ++k) {
    const double r = scale * scale * nodes_[k].inverse_precision, S = variance + r;
    const double peak = nodes_[k].probability / std::sqrt(S), beyond = widest / S - 1;
    at_zero += peak;
    change += peak * std::expm1(-0.5 * square * (1 + beyond));
    weights[k] = beyond > 0 ? peak * std::exp(-0.5 * square * beyond) : peak;
    sum += weights[k];
    precision += weights[k] / S;
    noise += weights[k] * r / S;
  }
  precision /= sum;
  double scatter = 0;  // B
  for (size_t k = 0; k < kNodes; ++k) {
    const double S = variance + scale * scale * nodes_[k].inverse_precision;
    const double moved = error * (1 / S - precision);
    scatter += weights[k] / sum * moved * moved;
  }
  Result result;
  const double ratio = 1 + change / at_zero;  // p(e)/p(0)
  const double size = ratio > kFarOff
                          ? std::sqrt(std::max(0.0, -2 * std::log1p(change / at_zero)))
                          : deviation * std::sqrt(1 - 2 * std::log(sum / at_zero) / square);
  result.innovation = std::copysign(size, error);
  result.log_variance = 2 * std::log(peak_ / (stated * at_zero));
  result.gain_variance = 1 / precision;
  result.noise_variance = (noise / sum + scatter / precision) / precision;
  result.spread = 1 / (precision - scatter);
  return result;
}

}  // namespace polyest::internal
