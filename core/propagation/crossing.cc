#include "core/propagation/crossing.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

constexpr int kDepth = 40;  // bisections of the step
constexpr std::array<double, 5> kTheta = {0, 0.25, 0.5, 0.75, 1};
// Below this part of the samples a coefficient between them is rounding error.
constexpr double kRounding = 1e-12;

StepSamples Bernstein(const StepSamples& v) {
  return {v[0], (-13 * v[0] + 48 * v[1] - 36 * v[2] + 16 * v[3] - 3 * v[4]) / 12,
          (13 * v[0] - 64 * v[1] + 120 * v[2] - 64 * v[3] + 13 * v[4]) / 18,
          (-3 * v[0] + 16 * v[1] - 36 * v[2] + 48 * v[3] - 13 * v[4]) / 12, v[4]};
}

// Splits the polynomial's interval in two by de Casteljau's algorithm.
void Halve(const StepSamples& whole, StepSamples& left, StepSamples& right) {
  StepSamples b = whole;
  for (size_t level = 0; level < b.size(); ++level) {
    left[level] = b.front();
    right[b.size() - 1 - level] = b[b.size() - 1 - level];
    for (size_t i = 0; i + 1 + level < b.size(); ++i) b[i] = 0.5 * (b[i] + b[i + 1]);
  }
}

// Returns the first θ at which the polynomial in Bernstein's form is positive, or −1.
double FirstPositive(const StepSamples& b, double from, double length, int depth) {
  if (b.front() > 0) return from;
  if (*std::max_element(b.begin(), b.end()) <= 0) return -1;
  if (depth == 0) return b.back() > 0 ? from + length : -1;
  StepSamples left{}, right{};
  Halve(b, left, right);
  const double found = FirstPositive(left, from, length / 2, depth - 1);
  return found >= 0 ? found : FirstPositive(right, from + length / 2, length / 2, depth - 1);
}

Crossing FirstPositiveSample(const StepSamples& samples, bool from_zero) {
  for (size_t i = from_zero ? 1 : 0; i < samples.size(); ++i) {
    if (samples[i] > 0) return {.found = true, .theta = kTheta[i], .slope = 0};
  }
  return {};
}

}  // namespace

double Interpolate(const StepSamples& samples, double theta) {
  double sum = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    double weight = 1;
    for (size_t j = 0; j < samples.size(); ++j) {
      if (j != i) weight *= (theta - kTheta[j]) / (kTheta[i] - kTheta[j]);
    }
    sum += weight * samples[i];
  }
  return sum;
}

Crossing FirstCrossing(const StepSamples& samples, bool from_zero) {
  if (!std::ranges::all_of(samples, [](double sample) { return std::isfinite(sample); })) {
    return FirstPositiveSample(samples, from_zero);
  }
  StepSamples values = samples;
  if (from_zero) {
    // (φ(θ) − φ(0))/θ, whose value at 0 is extrapolated by the cubic polynomial through the others.
    for (size_t i = 1; i < values.size(); ++i) {
      values[i] = (samples[i] - samples[0]) / kTheta[i];
    }
    values[0] = 4 * values[1] - 6 * values[2] + 4 * values[3] - values[4];
    const bool positive = *std::min_element(values.begin() + 1, values.end()) > 0;
    if (values[0] > 0 && !positive) values[0] = 0;
  }
  StepSamples coefficients = Bernstein(values);
  // A function that falls away from 0 as θ³ has inner coefficients of 0, of which rounding must not
  // make a crossing.
  double largest = 0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  for (size_t i = from_zero ? 0 : 1; i + 1 < coefficients.size(); ++i) {
    if (coefficients[i] <= kRounding * largest) coefficients[i] = std::min(coefficients[i], 0.0);
  }
  const double theta = FirstPositive(coefficients, 0, 1, kDepth);
  if (!(theta >= 0)) return {};
  constexpr double kDifference = 1e-3;
  const double before = std::max(theta - kDifference, 0.0);
  const double after = std::min(theta + kDifference, 1.0);
  const double slope =
      (Interpolate(samples, after) - Interpolate(samples, before)) / (after - before);
  return {true, theta, slope};
}

}  // namespace polyest::internal
