#include "core/bayes/evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "core/bayes/weighted_samples.h"
#include "core/chaos/collocation_points.h"
#include "core/chaos/normal.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr int kPoints = 8192;  // number of points of each density
constexpr double kWider = 1.2;
constexpr int kMaxIterations = 200;
constexpr double kSettled = 1e-10;  // tolerance of log Z

// The normal density N(mean, factor factorᵀ).
struct Gaussian {
  Vector mean;
  Matrix factor;

  Vector LogDensityAt(const Matrix& points) const {
    const auto n = static_cast<double>(mean.size());
    const Matrix scaled =
        SolveLower(factor, Matrix((points.rowwise() - mean.transpose()).transpose()));
    const double constant = -0.5 * n * kLogTwoPi - factor.diagonal().array().log().sum();
    return constant - 0.5 * scaled.colwise().squaredNorm().transpose().array();
  }

  Matrix Draw(int count) const {
    const std::vector<Germ> germs(static_cast<size_t>(mean.size()), Germ::Normal());
    const Matrix normal = HaltonDraws(germs, count);
    return (normal * factor.transpose()).rowwise() + mean.transpose();
  }
};

// Returns log Z from log(p/g) at points of p and at points of g.
double Bridge(const Vector& at_draws, const Vector& at_points) {
  double log_z = at_draws.mean();
  for (int i = 0; i < kMaxIterations; ++i) {
    // The step, with l = p/(g Z), is Z ← Z · mean_g[l/(l + 1)] / mean_p[1/(l + 1)]; neither
    // overflows.
    const auto logistic = [&](double log_l) { return 1 / (1 + std::exp(log_z - log_l)); };
    const double of_points = at_points.unaryExpr(logistic).mean();
    const double of_draws = 1 - at_draws.unaryExpr(logistic).mean();
    if (!(of_points > 0) || !(of_draws > 0)) return at_draws.mean();
    const double step = std::log(of_points) - std::log(of_draws);
    log_z += step;
    if (std::abs(step) < kSettled) break;
  }
  return log_z;
}

// Returns kPoints equally weighted rows of the draws. These may come in a regular order, as
// quasi-random points do: of evenly weighted ones every fourth is in one quarter of the range. So
// they are resampled in a shuffled order.
Matrix Chosen(const Matrix& draws, const Vector& weights) {
  std::vector<Eigen::Index> order(static_cast<size_t>(weights.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::mt19937_64 generator;  // with its default seed
  Shuffle(order, generator);
  std::vector<Eigen::Index> rows = EquallyWeighted(weights(order), kPoints);
  for (Eigen::Index& row : rows) row = order[static_cast<size_t>(row)];
  return draws(rows, Eigen::all);
}

}  // namespace

double LogEvidence(const LogDensity& density, const Matrix& draws, const Vector& weights) {
  const Matrix chosen = Chosen(draws, weights);
  Gaussian gaussian;
  gaussian.mean = chosen.colwise().mean().transpose();
  const Matrix centred = chosen.rowwise() - gaussian.mean.transpose();
  const CholeskyFactor cholesky(kWider * kWider / kPoints * (centred.transpose() * centred));
  if (!cholesky.positive_definite()) return -std::numeric_limits<double>::infinity();
  gaussian.factor = cholesky.Lower();
  const Matrix points = gaussian.Draw(kPoints);
  Vector at_draws, at_points;
  density(chosen, at_draws);
  density(points, at_points);
  return Bridge(at_draws - gaussian.LogDensityAt(chosen),
                at_points - gaussian.LogDensityAt(points));
}

}  // namespace polyest::internal
