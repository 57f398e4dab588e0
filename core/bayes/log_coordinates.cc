#include "core/bayes/log_coordinates.h"

#include <cmath>

namespace polyest::internal {

LogCoordinates::LogCoordinates(const Prior& prior, const Region& region)
    : prior_(prior), region_(region) {
  for (int i = 0; i < prior.dimension(); ++i) {
    const UncertainParameter& parameter = prior.parameters()[static_cast<size_t>(i)];
    const bool exponential = parameter.map == ParameterMap::kExponential;
    const bool own_germ = prior.germs()[static_cast<size_t>(i)] == Germ(parameter.germ);
    if (exponential && own_germ) continue;
    const Germ germ(parameter.germ);
    const double lower = parameter.ToParameter(germ.Lower());
    const double upper = parameter.ToParameter(germ.Upper());
    if (lower >= 0 || upper <= 0) curved_.push_back({i, lower >= 0 ? 1.0 : -1.0});
  }
}

void LogCoordinates::FromLocal(const ConstMatrixRef& etas, Matrix& us, Vector& log_volumes) const {
  us = region_.ManyToGerm(etas);
  if (prior_.correlated()) us = (us * prior_.factor().transpose()).eval();
  log_volumes.setZero(us.rows());
  for (const auto& [i, sign] : curved_) {
    for (Eigen::Index row = 0; row < us.rows(); ++row) {
      const double z = us(row, i);
      us(row, i) = std::log(sign * prior_.OfScore(i, z));
      log_volumes[row] += LogSlope(i, z, us(row, i));
    }
  }
}

void LogCoordinates::ToLocal(const ConstMatrixRef& us, Matrix& etas, Vector& log_volumes) const {
  Matrix xis = us;
  log_volumes.setZero(us.rows());
  for (const auto& [i, sign] : curved_) {
    for (Eigen::Index row = 0; row < us.rows(); ++row) {
      const double u = us(row, i);
      xis(row, i) = prior_.ScoreOf(i, sign * std::exp(u));
      log_volumes[row] += LogSlope(i, xis(row, i), u);
    }
  }
  if (prior_.correlated()) xis = SolveLower(prior_.factor(), Matrix(xis.transpose())).transpose();
  etas = region_.ManyToLocal(xis);
}

double LogCoordinates::LogSlope(int parameter, double z, double u) const {
  return u - std::log(prior_.SlopeOfScore(parameter, z));
}

}  // namespace polyest::internal
