#include "core/bayes/straight_coordinates.h"

#include <algorithm>
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
    const bool one_sign =
        parameter.ToParameter(germ.Lower()) > 0 || parameter.ToParameter(germ.Upper()) < 0;
    const bool of_choice = map == ParameterMap::kExponential && !one_sign;
    curved_.push_back(
        {i, of_choice, !of_choice, used == germ, parameter.location, parameter.scale});
  }
}

bool StraightCoordinates::has_choice() const {
  return std::any_of(curved_.begin(), curved_.end(),
                     [](const Curved& curved) { return curved.of_choice; });
}

bool StraightCoordinates::by_choice_alone() const {
  return std::all_of(curved_.begin(), curved_.end(),
                     [](const Curved& curved) { return curved.of_choice; });
}

void StraightCoordinates::Choose(const ConstMatrixRef& etas, bool of_both_signs) {
  const Matrix scores = Scores(etas);
  for (Curved& curved : curved_) {
    if (!curved.of_choice) continue;
    // θ rises with z.
    const auto column = scores.col(curved.parameter);
    curved.used = of_both_signs || prior_.OfScore(curved.parameter, column.minCoeff()) > 0 ||
                  prior_.OfScore(curved.parameter, column.maxCoeff()) < 0;
  }
}

Matrix StraightCoordinates::Scores(const ConstMatrixRef& etas) const {
  Matrix scores = region_.ManyToGerm(etas);
  if (prior_.correlated()) scores = (scores * prior_.factor().transpose()).eval();
  return scores;
}

void StraightCoordinates::FromLocal(const ConstMatrixRef& etas, Matrix& us, Matrix* signs,
                                    Vector* log_volumes) const {
  us = Scores(etas);
  Vector unused(us.rows());
  if (signs != nullptr) signs->setOnes(us.rows(), us.cols());
  if (log_volumes != nullptr) log_volumes->setZero(us.rows());
  for (const Curved& curved : curved_) {
    if (!curved.used) continue;
    const int i = curved.parameter;
    ToStraight(curved, us.col(i), signs != nullptr ? VectorRef(signs->col(i)) : VectorRef(unused),
               log_volumes);
  }
}

void StraightCoordinates::ToLocal(const ConstMatrixRef& us, const Matrix& signs, Matrix& etas,
                                  Vector& log_volumes) const {
  Matrix xis = us;
  log_volumes.setZero(us.rows());
  for (const Curved& curved : curved_) {
    if (!curved.used) continue;
    FromStraight(curved, xis.col(curved.parameter), signs.col(curved.parameter), log_volumes);
  }
  if (prior_.correlated()) xis = SolveLower(prior_.factor(), Matrix(xis.transpose())).transpose();
  etas = region_.ManyToLocal(xis);
}

// With u = log |θ| and θ = l + s z, log |dz/du| is u; with u = θ = e^{l + s z}, it is −s z; both up
// to a constant.
void StraightCoordinates::ToStraight(const Curved& curved, VectorRef column, VectorRef signs,
                                     Vector* log_volumes) const {
  auto values = column.array();
  if (curved.of_own_germ && map_ == ParameterMap::kExponential) {
    values = curved.location + curved.scale * values;
    signs = values.sign().matrix();
    values = values.abs().log();
    if (log_volumes != nullptr) *log_volumes += column;
  } else if (curved.of_own_germ) {
    if (log_volumes != nullptr) *log_volumes -= curved.scale * column;
    values = (curved.location + curved.scale * values).exp();
  } else {
    for (Eigen::Index row = 0; row < column.size(); ++row) {
      const double z = column[row];
      const double theta = prior_.OfScore(curved.parameter, z);
      const double u = map_ == ParameterMap::kExponential ? std::log(std::abs(theta)) : theta;
      if (log_volumes != nullptr) (*log_volumes)[row] += LogSlope(curved, z, u);
      signs[row] = theta < 0 ? -1 : 1;
      column[row] = u;
    }
  }
}

void StraightCoordinates::FromStraight(const Curved& curved, VectorRef column,
                                       const ConstVectorRef& signs, Vector& log_volumes) const {
  auto values = column.array();
  if (curved.of_own_germ && map_ == ParameterMap::kExponential) {
    log_volumes += column;
    values = (signs.array() * values.exp() - curved.location) / curved.scale;
  } else if (curved.of_own_germ) {
    values = (values.log() - curved.location) / curved.scale;
    log_volumes -= curved.scale * column;
  } else {
    for (Eigen::Index row = 0; row < column.size(); ++row) {
      const double u = column[row];
      const double theta = map_ == ParameterMap::kExponential ? signs[row] * std::exp(u) : u;
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
