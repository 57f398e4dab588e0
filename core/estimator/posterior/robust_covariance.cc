#include "core/estimator/posterior/robust_covariance.h"

#include <algorithm>
#include <cmath>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr size_t kMinWindows = 12;
// The fit must leave at least this share of the scores' covariance.
constexpr double kMinLeft = 0.5;
// Quantile of the largest eigenvalue's limiting law (Tracy–Widom, real) with tail 3·10⁻⁵.
constexpr double kMaxEigenvalue = 4.5;

// Returns the value that the largest eigenvalue of a sample covariance of white n-vectors with ν
// degrees of freedom exceeds by chance with probability 3·10⁻⁵ (I. Johnstone, "On the distribution
// of the largest eigenvalue in principal components analysis", Annals of Statistics 29 (2001), with
// the centring of Z. Ma, Bernoulli 18 (2012)):
//   μ = (√(ν − ½) + √(n − ½))²,   σ = √μ (1/√(ν − ½) + 1/√(n − ½))^{1/3}.
double LargestByChance(double degrees, double dimension) {
  const double a = std::sqrt(std::max(0.5, degrees - 0.5));
  const double b = std::sqrt(std::max(0.5, dimension - 0.5));
  const double spread = (a + b) * std::cbrt(1 / a + 1 / b);
  return ((a + b) * (a + b) + kMaxEigenvalue * spread) / std::max(1.0, degrees);
}

// Returns whether the scores' scatter in direction u is more than chance allows, in a fit of
// `fitted` parameters. Under a right model the centred scores uᵀĝ_w are normal with covariance
//   M = diag(uᵀI_w u) − Aᵀ C A,   A = [I_1 u … I_W u],
// so that Σ (uᵀĝ_w)² has mean tr M and about tr(M)²/tr(M²) degrees of freedom (F. Satterthwaite,
// "An approximate distribution of estimates of variance components", Biometrics 2 (1946)).
bool IsSignificant(const std::vector<WindowScore>& windows, const Matrix& c, const Vector& shift,
                   const Vector& u, double fitted) {
  const auto count = static_cast<Eigen::Index>(windows.size());
  Matrix a(u.size(), count);
  double scatter = 0;
  for (Eigen::Index w = 0; w < count; ++w) {
    const WindowScore& window = windows[static_cast<size_t>(w)];
    a.col(w) = window.information * u;
    const double score = u.dot(window.score) - a.col(w).dot(shift);
    scatter += score * score;
  }
  Matrix m = -(a.transpose() * Matrix(c * a));
  m.diagonal() += a.transpose() * u;
  const double mean = m.trace();
  const double degrees = mean * mean / m.squaredNorm();
  return mean > 0 && scatter / mean > LargestByChance(std::max(1.0, degrees), fitted);
}

// One length of windows.
struct Sandwich {
  double largest = 0;  // r²; 0 if it cannot be determined
  bool significant = false;
  Vector ratio;
};

Sandwich SandwichOf(const std::vector<WindowScore>& windows, const Matrix& precision) {
  const WindowScore sum = SumOf(windows);
  Sandwich result;
  const Matrix total = sum.information + precision;
  if (!total.allFinite() || !sum.score.allFinite()) return result;
  const CholeskyFactor factor((total + total.transpose()) / 2);
  if (!factor.positive_definite()) return result;
  const Matrix c = Inverse(total);
  const Vector shift = factor.Solve(sum.score);
  Matrix j = Matrix::Zero(total.rows(), total.cols());
  double taken = 0;
  for (const WindowScore& window : windows) {
    const Vector centred = window.score - window.information * shift;
    j += centred * centred.transpose();
    const Matrix leverage = window.information * c;
    taken += leverage.cwiseProduct(leverage.transpose()).sum();  // tr((I_w C)²)
  }
  const double fitted = sum.information.cwiseProduct(c.transpose()).sum();  // q = tr(I C)
  if (!(fitted - taken > kMinLeft * fitted)) return result;
  j *= fitted / (fitted - taken);

  // The eigenvalues of J + P against I + P = L Lᵀ.
  const Matrix lower = factor.Lower();
  const Matrix half = SolveLower(lower, Matrix(j + precision));
  const SymmetricEigen eigen = DecomposeSymmetric(SolveLower(lower, Matrix(half.transpose())));
  if (!eigen.converged) return result;
  const Eigen::Index last = eigen.values.size() - 1;
  result.largest = eigen.values[last];
  const Vector direction = SolveTransposed(lower, eigen.vectors.col(last));
  result.significant = IsSignificant(windows, c, shift, direction, std::max(1.0, fitted));
  const Matrix change = c * (j - sum.information) * c;
  result.ratio = (1 + change.diagonal().cwiseQuotient(c.diagonal()).array()).max(0.0).sqrt();
  return result;
}

// Returns the parameters of which any window says something: not those of a run without windows,
// whose directions would all have the eigenvalue 1.
std::vector<int> InformedParameters(const std::vector<WindowScore>& windows) {
  std::vector<int> informed;
  if (windows.empty()) return informed;
  const Matrix information = SumOf(windows).information;
  for (int i = 0; i < information.rows(); ++i) {
    if (information(i, i) != 0) informed.push_back(i);
  }
  return informed;
}

}  // namespace

RobustCovariance RobustCovarianceOf(std::vector<WindowScore> windows, const Matrix& precision) {
  RobustCovariance robust;
  const std::vector<int> informed = InformedParameters(windows);
  for (WindowScore& window : windows) {
    window.score = Vector(window.score(informed));
    window.information = Matrix(window.information(informed, informed));
  }
  const Matrix precision_of_informed = precision(informed, informed);
  double largest = 0;
  for (; !informed.empty() && windows.size() >= kMinWindows; windows = MergePairs(windows)) {
    const Sandwich sandwich = SandwichOf(windows, precision_of_informed);
    robust.significant = robust.significant || sandwich.significant;
    if (sandwich.largest <= largest) continue;
    largest = sandwich.largest;
    robust.ratio = Vector::Ones(precision.rows());
    robust.ratio(informed) = sandwich.ratio;
  }
  robust.disagreement = std::sqrt(largest);
  return robust;
}

}  // namespace polyest::internal
