#include "core/bayes/mixture_importance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/bayes/log_sum_exp.h"
#include "core/chaos/collocation_points.h"
#include "core/common/check.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr double kEvenShare = 0.1;  // of the points, dealt to the modes in equal parts
// The number of draws, for each dimension, for which the present moments of a mode count.
constexpr double kPresentPerDimension = 10;
// The share of the Gaussian around all modes, of theirs.
constexpr double kShareAround = 0.1;

// Returns the shares of the points, Σ = 1.
Vector SharesOf(const std::vector<GaussianMode>& modes) {
  Vector shares(std::ssize(modes));
  for (size_t m = 0; m < modes.size(); ++m) {
    shares[static_cast<Eigen::Index>(m)] = modes[m].log_share;
  }
  shares = (shares.array() - shares.maxCoeff()).exp();
  shares *= (1 - kEvenShare) / shares.sum();
  return shares.array() + kEvenShare / static_cast<double>(modes.size());
}

// Returns log(π_m det L_m Σ_c p_c s_c⁻ⁿ e^{−r_m²/2s_c²}) for each point (rows) and mode (columns).
Matrix LogDensities(const std::vector<GaussianMode>& modes, const Vector& shares,
                    const Matrix& etas) {
  const int n = static_cast<int>(etas.cols());
  Matrix densities(etas.rows(), std::ssize(modes));
  for (Eigen::Index m = 0; m < densities.cols(); ++m) {
    const GaussianMode& mode = modes[static_cast<size_t>(m)];
    const Matrix away = (etas.rowwise() - mode.centre.transpose()) * mode.factor;
    const double height = std::log(shares[m]) + mode.factor.diagonal().array().log().sum();
    densities.col(m) = height + ProposalLogDensity(away.rowwise().squaredNorm(), n).array();
  }
  return densities;
}

// Returns the number of points of each mode, at least one: its share of all of them.
Eigen::VectorXi CountsOf(const Vector& shares, int points) {
  return shares
      .unaryExpr(
          [&](double share) { return std::max(1, static_cast<int>(std::lround(share * points))); })
      .cast<int>();
}

Matrix CovarianceOf(const GaussianMode& mode) {
  return Inverse(mode.factor * mode.factor.transpose());
}

// Sets the mode's moments, or leaves it as it is if the covariance has no Cholesky factor.
void SetMoments(const Vector& mean, const Matrix& covariance, GaussianMode& mode) {
  if (!CholeskyFactor(covariance).positive_definite()) return;
  const CholeskyFactor precision(Inverse(covariance));
  if (!precision.positive_definite()) return;
  mode.centre = mean;
  mode.factor = precision.Lower();
}

// Moves the mode to the draws in it, whose weights (Σ = 1) are given.
void Adapt(const Matrix& etas, const Vector& weights, GaussianMode& mode) {
  const double draws = 1 / weights.squaredNorm();
  const double part = draws / (draws + kPresentPerDimension * static_cast<double>(etas.cols()));
  const Vector mean = part * etas.transpose() * weights + (1 - part) * mode.centre;
  const Matrix centred = etas.rowwise() - mean.transpose();
  const Matrix spread = centred.transpose() * weights.asDiagonal() * centred;
  SetMoments(mean, part * spread + (1 - part) * CovarianceOf(mode), mode);
}

}  // namespace

GaussianMode ModeAt(const Vector& minimum, double cost, const Matrix& hessian_factor) {
  return {minimum, hessian_factor, -cost - hessian_factor.diagonal().array().log().sum()};
}

WeightedDraws ImportanceSample(const Cost& cost, const Vector& lower, const Vector& upper,
                               const std::vector<GaussianMode>& modes, int points) {
  POLYEST_CHECK(points >= 100 && !modes.empty());
  const int n = cost.dimension();
  const Vector shares = SharesOf(modes);
  const Eigen::VectorXi counts = CountsOf(shares, points);
  const std::vector<Germ> germs(static_cast<size_t>(n), Germ::Normal());
  Matrix etas = HaltonDraws(germs, counts.sum());
  Eigen::Index first = 0;
  for (Eigen::Index m = 0; m < counts.size(); ++m) {
    const GaussianMode& mode = modes[static_cast<size_t>(m)];
    Matrix own = etas.middleRows(first, counts[m]);
    ScaleAsProposal(own);
    etas.middleRows(first, counts[m]) = SolveLowerTransposedRows(mode.factor, own);
    etas.middleRows(first, counts[m]).rowwise() += mode.centre.transpose();
    first += counts[m];
  }
  // What the numbers of points, which are rounded, have become.
  const Vector dealt = counts.cast<double>() / counts.sum();
  const Vector log_density = LogSumExpOfRows(LogDensities(modes, dealt, etas));
  return WeighProposed(cost, lower, upper, std::move(etas), log_density);
}

GaussianMode AroundAll(const std::vector<GaussianMode>& modes) {
  const Vector shares = SharesOf(modes);
  const Eigen::Index n = modes.front().centre.size();
  Vector mean = Vector::Zero(n);
  Matrix covariance = Matrix::Zero(n, n);
  for (size_t m = 0; m < modes.size(); ++m) {
    mean += shares[static_cast<Eigen::Index>(m)] * modes[m].centre;
  }
  double most = -kInfinity;
  for (size_t m = 0; m < modes.size(); ++m) {
    const Vector away = modes[m].centre - mean;
    covariance +=
        shares[static_cast<Eigen::Index>(m)] * (CovarianceOf(modes[m]) + away * away.transpose());
    most = std::max(most, modes[m].log_share);
  }
  GaussianMode around = modes.front();
  around.log_share = most + std::log(kShareAround);
  SetMoments(mean, covariance, around);
  return around;
}

std::vector<GaussianMode> AdaptedTo(const WeightedDraws& draws,
                                    const std::vector<GaussianMode>& modes) {
  const Matrix densities = LogDensities(modes, SharesOf(modes), draws.etas);
  const Vector sums = LogSumExpOfRows(densities);
  const double most = 1 / std::sqrt(static_cast<double>(draws.weights.size()));
  const Vector cut = draws.weights.cwiseMin(most);
  std::vector<GaussianMode> adapted = modes;
  for (Eigen::Index m = 0; m < densities.cols(); ++m) {
    const Vector weights = cut.array() * (densities.col(m) - sums).array().exp();
    const double share = weights.sum();
    GaussianMode& mode = adapted[static_cast<size_t>(m)];
    mode.log_share = std::log(share);  // −∞ leaves it what every mode has in any case
    if (share > 0) Adapt(draws.etas, weights / share, mode);
  }
  return adapted;
}

}  // namespace polyest::internal
