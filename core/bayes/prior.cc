#include "core/bayes/prior.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/common/check.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

Matrix Independent(size_t count) {
  const auto n = static_cast<Eigen::Index>(count);
  return Matrix::Identity(n, n);
}

// A population is one of normal scores.
bool IsScoredForPopulation(const UncertainParameter& parameter) {
  const bool in_population = parameter.population || parameter.part == PopulationPart::kMean;
  return in_population && parameter.germ.family != GermFamily::kNormal;
}

double NormalDensity(double z) { return Germ::Normal().Density(z); }

}  // namespace

Prior::Prior(std::vector<UncertainParameter> parameters, const Matrix& correlation)
    : parameters_(std::move(parameters)), factor_(CholeskyFactor(correlation).Lower()) {
  POLYEST_CHECK(!parameters_.empty());
  const int n = dimension();
  lower_.resize(n);
  upper_.resize(n);
  for (int i = 0; i < n; ++i) {
    const UncertainParameter& parameter = parameters_[static_cast<size_t>(i)];
    POLYEST_CHECK(parameter.scale > 0);
    const bool correlated = (correlation.row(i).array() != 0).count() > 1;
    has_normal_score_.push_back(correlated || IsScoredForPopulation(parameter));
    correlated_ = correlated_ || correlated;
    marginal_germs_.push_back(Germ(parameter.germ));
    germs_.push_back(has_normal_score_.back() ? Germ::Normal() : marginal_germs_.back());
    lower_[i] = germs_.back().Lower();
    upper_[i] = germs_.back().Upper();
  }
}

Prior::Prior(std::vector<UncertainParameter> parameters)
    : Prior(parameters, Independent(parameters.size())) {}

absl::StatusOr<Prior> Prior::Make(std::vector<UncertainParameter> parameters,
                                  const std::vector<Correlation>& correlations) {
  POLYEST_ASSIGN_OR_RETURN(const Matrix correlation, CorrelationMatrix(parameters, correlations));
  return Prior(std::move(parameters), correlation);
}

bool Prior::has_exponential_germs() const {
  return std::ranges::any_of(
      germs_, [](const Germ& germ) { return germ.family() == GermFamily::kExponential; });
}

Prior Prior::WithModesOfUniform() const {
  Prior uniform = *this;
  for (Germ& germ : uniform.germs_) {
    if (germ.family() == GermFamily::kExponential) germ = Germ::Uniform();
  }
  return uniform;
}

bool Prior::IsCurved(int parameter) const {
  const UncertainParameter& marginal = parameters_[static_cast<size_t>(parameter)];
  return marginal.map != ParameterMap::kAffine ||
         germs_[static_cast<size_t>(parameter)] != marginal_germs_[static_cast<size_t>(parameter)];
}

double Prior::MarginalGerm(int parameter, double z) const {
  if (!HasNormalScore(parameter)) return z;
  return marginal_germs_[static_cast<size_t>(parameter)].OfNormalScore(z);
}

double Prior::OfScore(int parameter, double z) const {
  return parameters_[static_cast<size_t>(parameter)].ToParameter(MarginalGerm(parameter, z));
}

double Prior::ScoreOf(int parameter, double theta) const {
  const UncertainParameter& marginal = parameters_[static_cast<size_t>(parameter)];
  const double x = marginal.ToGerm(theta);
  if (!HasNormalScore(parameter)) return x;
  const Germ& germ = marginal_germs_[static_cast<size_t>(parameter)];
  const bool inside = germ.Lower() <= x && x <= germ.Upper();
  return inside ? germ.NormalScore(x) : std::numeric_limits<double>::quiet_NaN();
}

std::vector<std::string> Prior::Names() const {
  std::vector<std::string> names;
  for (const UncertainParameter& parameter : parameters_) names.push_back(parameter.name);
  return names;
}

Vector Prior::ToScores(const ConstVectorRef& xi) const {
  if (!correlated_) return xi;
  return factor_.triangularView<Eigen::Lower>() * xi;
}

Vector Prior::OfScores(const ConstVectorRef& z) const {
  if (!correlated_) return z;
  return SolveLower(factor_, Vector(z));
}

Vector Prior::ToParameters(const ConstVectorRef& xi) const {
  Vector theta = ToScores(xi);
  for (int i = 0; i < dimension(); ++i) theta[i] = OfScore(i, theta[i]);
  return theta;
}

Vector Prior::ToGerm(const ConstVectorRef& theta) const {
  Vector z(dimension());
  for (int i = 0; i < dimension(); ++i) z[i] = ScoreOf(i, theta[i]);
  return OfScores(z);
}

// Returns t_i′ = dθ_i/dz_i = dθ_i/dx_i · φ(z_i)/ρ_i(x_i), x_i the marginal germ of a parameter with
// a normal score z_i.
double Prior::SlopeOfScore(int parameter, double z) const {
  const UncertainParameter& marginal = parameters_[static_cast<size_t>(parameter)];
  const double x = MarginalGerm(parameter, z);
  const double slope = marginal.Slope(x);
  const Germ& germ = marginal_germs_[static_cast<size_t>(parameter)];
  if (!HasNormalScore(parameter) || germ.family() == GermFamily::kNormal) return slope;
  // The slope is 0 so near a bound that x is rounded to it: θ does not change any more.
  const double density = germ.Density(x);
  return density > 0 ? slope * NormalDensity(z) / density : 0;
}

Matrix Prior::Jacobian(const ConstVectorRef& xi) const {
  const Vector z = ToScores(xi);
  Vector slope(dimension());
  for (int i = 0; i < dimension(); ++i) slope[i] = SlopeOfScore(i, z[i]);
  return slope.asDiagonal() * factor_;
}

Vector Prior::Mean() const {
  Vector mean(dimension());
  for (int i = 0; i < dimension(); ++i) mean[i] = parameters_[static_cast<size_t>(i)].Mean();
  return mean;
}

Vector Prior::StandardDeviation() const {
  Vector deviation(dimension());
  for (int i = 0; i < dimension(); ++i) {
    deviation[i] = parameters_[static_cast<size_t>(i)].StandardDeviation();
  }
  return deviation;
}

Vector Prior::GermStandardDeviation() const {
  Vector deviation(dimension());
  for (int i = 0; i < dimension(); ++i) {
    deviation[i] = germs_[static_cast<size_t>(i)].StandardDeviation();
  }
  return deviation;
}

double Prior::OffBound(int parameter) const {
  constexpr double kOffBound = 1e-9;
  const double width = upper_[parameter] - lower_[parameter];
  return kOffBound * (std::isfinite(width) ? width : 1);
}

bool Prior::Contains(const ConstVectorRef& xi) const {
  for (int i = 0; i < dimension(); ++i) {
    if (!(lower_[i] <= xi[i] && xi[i] <= upper_[i] && std::isfinite(xi[i]))) return false;
  }
  return true;
}

double Prior::NegativeLogDensity(const ConstVectorRef& xi) const {
  if (!Contains(xi)) return std::numeric_limits<double>::infinity();
  double sum = 0;  // J_apriori = −Σ_i log ρ_i(ξ_i)
  for (int i = 0; i < dimension(); ++i) sum -= germs_[static_cast<size_t>(i)].LogDensity(xi[i]);
  return sum;
}

void Prior::NegativeLogDensityMany(const ConstMatrixRef& xis, VectorRef values) const {
  values.setZero();
  for (int i = 0; i < dimension(); ++i) {
    germs_[static_cast<size_t>(i)].SubtractLogDensities(xis.col(i), values);
  }
}

Vector Prior::Gradient(const ConstVectorRef& xi) const {
  Vector gradient(dimension());
  for (int i = 0; i < dimension(); ++i) {
    gradient[i] = -germs_[static_cast<size_t>(i)].LogDensityDerivative(xi[i]);
  }
  return gradient;
}

Vector Prior::Curvature(const ConstVectorRef& xi) const {
  Vector curvature(dimension());
  for (int i = 0; i < dimension(); ++i) {
    curvature[i] = -germs_[static_cast<size_t>(i)].LogDensitySecondDerivative(xi[i]);
  }
  return curvature;
}

}  // namespace polyest::internal
