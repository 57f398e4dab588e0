#include "core/estimator/posterior/model_correction.h"

#include <cmath>

#include "core/bayes/pareto_tail.h"
#include "core/bayes/weighted_samples.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr int kMaxDegree = 2;
// Check points, by their effective number, for each term of the polynomial.
constexpr double kChecksPerTerm = 2;
// Part of the mean square left over that a higher degree must do without.
constexpr double kGain = 0.7;
// Mean square left over that is worth no higher degree: a thousandth of a standard deviation.
constexpr double kNegligible = 1e-6;
// Part of the draws' effective number that the correction must leave.
constexpr double kMinEffective = 0.2;

// The posterior's standardized coordinates u = L⁻¹ (η − mean), L Lᵀ = covariance.
class Standardization {
 public:
  Standardization(const ConstMatrixRef& etas, const ConstVectorRef& weights)
      : mean_(etas.transpose() * weights) {
    const Matrix centred = etas.rowwise() - mean_.transpose();
    const CholeskyFactor factor(centred.transpose() * weights.asDiagonal() * centred);
    if (factor.positive_definite()) lower_ = factor.Lower();
  }

  bool possible() const { return lower_.size() > 0; }
  Matrix Apply(const ConstMatrixRef& etas) const {
    return SolveLower(lower_, Matrix((etas.rowwise() - mean_.transpose()).transpose())).transpose();
  }

 private:
  Vector mean_;
  Matrix lower_;  // empty if the draws do not span all directions
};

int TermsOf(int degree, Eigen::Index n) {
  const int linear = static_cast<int>(n) + 1;
  return degree == 0 ? 1 : degree == 1 ? linear : linear * (linear + 1) / 2;
}

// Returns the monomials of up to the degree, of each row of u.
Matrix Monomials(const Matrix& u, int degree) {
  const Eigen::Index n = u.cols();
  Matrix terms(u.rows(), TermsOf(degree, n));
  terms.col(0).setOnes();
  if (degree > 0) terms.middleCols(1, n) = u;
  Eigen::Index column = n + 1;
  for (Eigen::Index i = 0; degree > 1 && i < n; ++i) {
    for (Eigen::Index j = i; j < n; ++j) terms.col(column++) = u.col(i).cwiseProduct(u.col(j));
  }
  return terms;
}

struct Fit {
  Vector coefficients;
  double left = kInfinity;  // mean square at points left out, weighted
};

// Fits ΔJ by weighted least squares, weights Σ = 1. `left` is +∞ if the points do not determine it.
Fit FitPolynomial(const Matrix& terms, const Vector& differences, const Vector& weights) {
  const CholeskyFactor normal(terms.transpose() * weights.asDiagonal() * terms);
  if (!normal.positive_definite()) return {};
  Fit fit{normal.Solve(terms.transpose() * weights.cwiseProduct(differences)), 0};
  const Vector errors = differences - terms * fit.coefficients;
  for (Eigen::Index i = 0; i < terms.rows(); ++i) {
    // By the hat matrix's diagonal h, the error at a point left out is e/(1 − h).
    const Vector term = terms.row(i).transpose();
    const double open = 1 - weights[i] * term.dot(normal.Solve(term));
    const double error = open > 0 ? errors[i] / open : errors[i] == 0 ? 0 : kInfinity;
    fit.left += weights[i] * error * error;
  }
  return fit;
}

double EffectiveNumber(const ConstVectorRef& log_weights) {
  return EffectiveSizeOfWeights((log_weights.array() - log_weights.maxCoeff()).exp().matrix());
}

}  // namespace

ModelCorrection CorrectByModel(const CheckDifferences& checks, const ConstMatrixRef& etas,
                               const ConstVectorRef& weights, double largest_shift) {
  ModelCorrection correction;
  if (checks.differences.size() < 2) return correction;
  // Where the posterior has moved away from the draws, their weights tell nothing of the model.
  const bool represent = TailShape(checks.log_weights).value_or(0) <= kMaxTrustedShape;
  if (represent || !(largest_shift <= kNegligibleShift)) {
    correction.pareto_shape = TailShape(checks.log_weights - checks.differences);
  }
  const Standardization standard(etas, weights);
  if (!standard.possible()) return correction;
  Vector at_checks = (checks.log_weights.array() - checks.log_weights.maxCoeff()).exp();
  at_checks /= at_checks.sum();
  const double effective = 1 / at_checks.squaredNorm();
  const Matrix u_checks = standard.Apply(checks.etas);
  const Matrix u = standard.Apply(etas);
  double left = FitPolynomial(Monomials(u_checks, 0), checks.differences, at_checks).left;
  const Vector log_weights = weights.array().log();
  const double effective_draws = EffectiveNumber(log_weights);
  for (int degree = 1; degree <= kMaxDegree; ++degree) {
    if (left < kNegligible || effective < kChecksPerTerm * TermsOf(degree, u.cols())) break;
    const Fit fit = FitPolynomial(Monomials(u_checks, degree), checks.differences, at_checks);
    if (!(fit.left < kGain * left)) continue;
    const Vector factors = -(Monomials(u, degree) * fit.coefficients);
    if (EffectiveNumber(log_weights + factors) < kMinEffective * effective_draws) continue;
    left = fit.left;
    correction.degree = degree;
    correction.log_factors = factors;
    correction.shift = std::sqrt(left);
  }
  return correction;
}

}  // namespace polyest::internal
