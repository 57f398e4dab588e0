#include "core/bayes/straight_coordinates.h"

#include <cmath>

namespace polyest::internal {
namespace {

// The greatest scale of log θ for sums. The θ of a wider prior is so skewed that the difference of
// two draws hardly ever leads from a third to a probable value.
constexpr double kMaxSkewed = 1;

// Whether a score is quickly mapped to the parameter. The quantiles of other correlated parameters
// would take longer than the cost itself.
bool IsQuick(const Germ& own, const Germ& germ) {
  return own == germ || own.family() == GermFamily::kNormal || own.family() == GermFamily::kUniform;
}

}  // namespace

StraightCoordinates::StraightCoordinates(const Prior& prior, const Region& region, ParameterMap map)
    : prior_(prior), region_(region), map_(map) {
  for (int i = 0; i < prior.dimension(); ++i) {
    const UncertainParameter& parameter = prior.parameters()[static_cast<size_t>(i)];
    const Germ germ(parameter.germ);
    const Germ& used = prior.germs()[static_cast<size_t>(i)];
    if ((parameter.map == map && used == germ) || !IsQuick(germ, used)) continue;
    if (parameter.map == ParameterMap::kExponential && parameter.scale > kMaxSkewed &&
        map == ParameterMap::kAffine) {
      continue;
    }
    const bool positive = parameter.ToParameter(germ.Lower()) > 0;
    const bool negative = parameter.ToParameter(germ.Upper()) < 0;
    if (map == ParameterMap::kExponential && !positive && !negative) continue;
    curved_.push_back(
        {i, negative ? -1.0 : 1.0, used == germ, parameter.location, parameter.scale});
  }
}

void StraightCoordinates::FromLocal(const ConstMatrixRef& etas, Matrix& us,
                                    Vector* log_volumes) const {
  us = region_.ManyToGerm(etas);
  if (prior_.correlated()) us = (us * prior_.factor().transpose()).eval();
  if (log_volumes != nullptr) log_volumes->setZero(us.rows());
  for (const Curved& curved : curved_) ToStraight(curved, us.col(curved.parameter), log_volumes);
}

void StraightCoordinates::ToLocal(const ConstMatrixRef& us, Matrix& etas,
                                  Vector& log_volumes) const {
  Matrix xis = us;
  log_volumes.setZero(us.rows());
  for (const Curved& curved : curved_) FromStraight(curved, xis.col(curved.parameter), log_volumes);
  if (prior_.correlated()) xis = SolveLower(prior_.factor(), Matrix(xis.transpose())).transpose();
  etas = region_.ManyToLocal(xis);
}

// With u = log |θ| and θ = l + s z, log |dz/du| is u; with u = θ = e^{l + s z}, it is −s z; both up
// to a constant.
void StraightCoordinates::ToStraight(const Curved& curved, VectorRef column,
                                     Vector* log_volumes) const {
  auto values = column.array();
  if (curved.of_own_germ && map_ == ParameterMap::kExponential) {
    values = (curved.sign * (curved.location + curved.scale * values)).log();
    if (log_volumes != nullptr) *log_volumes += column;
  } else if (curved.of_own_germ) {
    if (log_volumes != nullptr) *log_volumes -= curved.scale * column;
    values = (curved.location + curved.scale * values).exp();
  } else {
    for (Eigen::Index row = 0; row < column.size(); ++row) {
      const double z = column[row];
      const double theta = prior_.OfScore(curved.parameter, z);
      const double u = map_ == ParameterMap::kExponential ? std::log(curved.sign * theta) : theta;
      if (log_volumes != nullptr) (*log_volumes)[row] += LogSlope(curved, z, u);
      column[row] = u;
    }
  }
}

void StraightCoordinates::FromStraight(const Curved& curved, VectorRef column,
                                       Vector& log_volumes) const {
  auto values = column.array();
  if (curved.of_own_germ && map_ == ParameterMap::kExponential) {
    log_volumes += column;
    values = (curved.sign * values.exp() - curved.location) / curved.scale;
  } else if (curved.of_own_germ) {
    values = (values.log() - curved.location) / curved.scale;
    log_volumes -= curved.scale * column;
  } else {
    for (Eigen::Index row = 0; row < column.size(); ++row) {
      const double u = column[row];
      const double theta = map_ == ParameterMap::kExponential ? curved.sign * std::exp(u) : u;
      column[row] = prior_.ScoreOf(curved.parameter, theta);
      log_volumes[row] += LogSlope(curved, column[row], u);
    }
  }
}

double StraightCoordinates::LogSlope(const Curved& curved, double z, double u) const {
  const double log_of_theta = map_ == ParameterMap::kExponential ? u : 0;  // log |dθ/du|
  return log_of_theta - std::log(prior_.SlopeOfScore(curved.parameter, z));
}

}  // namespace polyest::internal
