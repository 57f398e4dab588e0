#include "core/estimator/posterior/noise_choice.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

// Gain of log likelihood for which one more parameter of the noise is preferred.
constexpr double kWorthParameter = 1;
// Limit of a refinement, in steps of the differences.
constexpr double kMaxSteps = 2;
// Factor of the time constant, and of the odds of the white share, that counts as a difference.
constexpr double kDifferent = 1.05;

// Returns the best time constant of the grid without a white share; where it lies between two
// steps, by the parabola through the best step and its neighbours.
NoiseChoice BestCorrelated(const std::vector<ProfileValue>& values, const TimeConstantGrid& grid) {
  const auto at = [&](int step) -> const ProfileValue& {
    return values[CorrelationProfile::kFirstOfGrid + static_cast<size_t>(step)];
  };
  NoiseChoice best;
  for (int step = 0; step < TimeConstantGrid::kSteps; ++step) {
    if (!(at(step).negative_log_likelihood < best.negative_log_likelihood)) continue;
    best = {{grid.At(step), 0}, at(step).scale, at(step).negative_log_likelihood, step};
  }
  if (best.step <= 0 || best.step == TimeConstantGrid::kSteps - 1) return best;
  const double below = at(best.step - 1).negative_log_likelihood - best.negative_log_likelihood;
  const double above = at(best.step + 1).negative_log_likelihood - best.negative_log_likelihood;
  if (!std::isfinite(below + above) || below + above <= 0) return best;
  // With f(−1) = below, f(0) = 0 and f(1) = above, the minimum is at x, |x| ≤ ½, of height −x²
  // (…)/2.
  const double x = 0.5 * (below - above) / (below + above);
  const double ratio = grid.At(1) / grid.At(0);
  best.noise.time_constant_s *= std::pow(ratio, x);
  best.scale *= std::pow(at(best.step + (x < 0 ? -1 : 1)).scale / best.scale, std::abs(x));
  best.negative_log_likelihood -= 0.5 * x * x * (below + above);
  return best;
}

// Returns the step of the grid nearest to a time constant.
int NearestStep(const TimeConstantGrid& grid, double time_constant_s) {
  const double ratio = std::log(grid.longest_s / grid.shortest_s) / (TimeConstantGrid::kSteps - 1);
  if (!(ratio > 0)) return 0;
  const double step = std::round(std::log(time_constant_s / grid.shortest_s) / ratio);
  return static_cast<int>(std::clamp(step, 0.0, TimeConstantGrid::kSteps - 1.0));
}

// Returns the minimum of c + gᵀx + ½ xᵀHx over |x_i| ≤ kMaxSteps and x_0 ≤ `highest`, or 0 if H is
// not positive definite.
Vector MinimumOfQuadratic(const Vector& g, const Matrix& h, double highest) {
  const double determinant = h(0, 0) * h(1, 1) - h(0, 1) * h(0, 1);
  if (!(h(0, 0) > 0 && determinant > 0)) return Vector::Zero(2);
  const double top = std::min(kMaxSteps, highest);
  Vector x(2);
  x << (h(0, 1) * g[1] - h(1, 1) * g[0]) / determinant,
      (h(0, 1) * g[0] - h(0, 0) * g[1]) / determinant;
  if (x[0] >= -kMaxSteps && x[0] <= top && std::abs(x[1]) <= kMaxSteps) return x;
  // Alternating minimization, which keeps within the bounds, converges since H is positive.
  x.setZero();
  for (int i = 0; i < 50; ++i) {
    x[0] = std::clamp(-(g[0] + h(0, 1) * x[1]) / h(0, 0), -kMaxSteps, top);
    x[1] = std::clamp(-(g[1] + h(0, 1) * x[0]) / h(1, 1), -kMaxSteps, kMaxSteps);
  }
  return x;
}

// Returns the present noise, white in part, refined by its neighbours. The time constant does not
// exceed the grid's.
NoiseChoice Refined(const CorrelationProfile& profile, const std::vector<ProfileValue>& values,
                    const TimeConstantGrid& grid) {
  const auto at = [&](int i, int j) -> const ProfileValue& {
    return values[CorrelationProfile::kFirstNeighbour + static_cast<size_t>(3 * (i + 1) + j + 1)];
  };
  const auto f = [&](int i, int j) { return at(i, j).negative_log_likelihood; };
  Vector g(2);
  Matrix h(2, 2);
  g << 0.5 * (f(1, 0) - f(-1, 0)), 0.5 * (f(0, 1) - f(0, -1));
  h(0, 0) = f(1, 0) - 2 * f(0, 0) + f(-1, 0);
  h(1, 1) = f(0, 1) - 2 * f(0, 0) + f(0, -1);
  h(0, 1) = h(1, 0) = 0.25 * (f(1, 1) - f(1, -1) - f(-1, 1) + f(-1, -1));
  const NoiseShape& present = profile.shapes()[CorrelationProfile::kPresent];
  const double highest = std::log(grid.longest_s / present.time_constant_s) / kStepOfTimeConstant;
  const Vector x = MinimumOfQuadratic(g, h, std::max(0.0, highest));
  NoiseChoice choice;
  choice.noise = Neighbour(present, x[0], x[1]);
  choice.negative_log_likelihood = f(0, 0) + g.dot(x) + 0.5 * x.dot(h * x);
  choice.scale = at(0, 0).scale * std::pow(at(1, 0).scale / at(-1, 0).scale, 0.5 * x[0]) *
                 std::pow(at(0, 1).scale / at(0, -1).scale, 0.5 * x[1]);
  return choice;
}

// Returns the best noise that is white in part, one of the grid or near the present one.
NoiseChoice BestMixed(const CorrelationProfile& profile, const std::vector<ProfileValue>& values,
                      const TimeConstantGrid& grid) {
  NoiseChoice best;
  if (profile.HasNeighbours()) best = Refined(profile, values, grid);
  for (size_t i = CorrelationProfile::kFirstMixed; i < values.size(); ++i) {
    if (!(values[i].negative_log_likelihood < best.negative_log_likelihood)) continue;
    if (profile.shapes()[i].time_constant_s > grid.longest_s) continue;
    best = {profile.shapes()[i], values[i].scale, values[i].negative_log_likelihood};
  }
  if (std::isfinite(best.negative_log_likelihood)) {
    best.step = NearestStep(grid, best.noise.time_constant_s);
  }
  return best;
}

}  // namespace

NoiseChoice ChooseNoise(const CorrelationProfile& profile, const std::vector<ProfileValue>& values,
                        const TimeConstantGrid& grid) {
  const ProfileValue& white = values[CorrelationProfile::kWhite];
  const bool correlated = profile.shapes()[CorrelationProfile::kPresent].time_constant_s > 0;
  NoiseChoice best = BestCorrelated(values, grid);
  double worth = kWorthParameter;  // of a white share
  if (!(best.negative_log_likelihood <
        white.negative_log_likelihood - (correlated ? 0 : kWorthParameter))) {
    best = {{}, white.scale, white.negative_log_likelihood, -1};
    worth += kWorthParameter;
  }
  const NoiseChoice mixed = BestMixed(profile, values, grid);
  if (mixed.negative_log_likelihood < best.negative_log_likelihood - worth) best = mixed;
  return best;
}

bool IsAbout(const NoiseShape& a, const NoiseShape& b) {
  const auto alike = [](double x, double y) { return x <= kDifferent * y && y <= kDifferent * x; };
  return alike(a.time_constant_s, b.time_constant_s) &&
         alike(a.white_share * (1 - b.white_share), b.white_share * (1 - a.white_share));
}

}  // namespace polyest::internal
