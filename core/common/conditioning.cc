#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// Finds singular values of an upper bidiagonal n × n matrix B one at a time. They are the
// eigenvalues above 0 of the symmetric tridiagonal matrix T of size 2n that has zeros on its
// diagonal and b_11, b_12, b_22, b_23, … beside it (Golub and Kahan, 1965). By Sylvester's law of
// inertia as many eigenvalues of T lie below x as T − x I = L D Lᵀ has negative pivots. Eigen's own
// decompositions, which make the singular vectors as well, take the compiler five times as long.
class BidiagonalSpectrum {
 public:
  // Takes the entries of T beside its diagonal.
  explicit BidiagonalSpectrum(Vector beside)
      : beside_(std::move(beside)), size_((beside_.size() + 1) / 2) {}

  // Returns an upper bound of all singular values (Gershgorin).
  double Bound() const {
    double bound = 0;
    double previous = 0;
    for (const double b : beside_) {
      bound = std::max(bound, previous + std::abs(b));
      previous = std::abs(b);
    }
    return std::max(bound, previous);
  }

  // Returns the number of singular values below x > 0.
  Eigen::Index CountBelow(double x) const {
    Eigen::Index negative = 1;  // the first pivot is −x
    double pivot = -x;
    for (const double b : beside_) {
      pivot = -x - b * b / pivot;
      if (std::abs(pivot) < kTiny) pivot = -kTiny;  // the next one must not overflow
      if (pivot < 0) ++negative;
    }
    return negative - size_;
  }

  // Returns singular value k = 0, 1, …, n − 1 in ascending order, to rounding; it must lie in
  // (lower, upper].
  double Find(Eigen::Index k, double lower, double upper) const {
    while (true) {
      const double middle = lower + (upper - lower) / 2;
      if (middle <= lower || middle >= upper) return upper;
      (CountBelow(middle) > k ? upper : lower) = middle;
    }
  }

 private:
  static constexpr double kTiny = 1e-290;  // of entries of at most 1

  const Vector beside_;
  const Eigen::Index size_;
};

// The decomposition of larger matrices takes long.
constexpr Eigen::Index kMaxDirect = 256;
// Steps after which the extreme singular values of any matrix are known to about a percent
// (Kuczynski and Wozniakowski, SIAM Journal on Matrix Analysis and Applications 13, 1992).
constexpr Eigen::Index kSteps = 60;

// Takes away what a vector has of the first columns of an orthonormal matrix, and returns the
// length of the rest, to which it is normalized. Twice, because of rounding.
double Orthonormalize(const Matrix& columns, Eigen::Index count, Vector& vector) {
  for (int pass = 0; pass < 2; ++pass) {
    const Vector along = columns.leftCols(count).transpose() * vector;
    vector -= columns.leftCols(count) * along;
  }
  const double length = vector.norm();
  if (length > 0) vector /= length;
  return length;
}

// Returns the largest singular value of a square matrix A of which only the products A v and Aᵀ u
// are known, by the bidiagonalization of Golub, Kahan and Lanczos (Golub and Van Loan, Matrix
// Computations, 10.4): that of the bidiagonal matrix is a lower bound, which converges first.
template <typename Apply, typename ApplyTransposed>
double LargestSingularValue(Eigen::Index size, const Apply& apply,
                            const ApplyTransposed& apply_transposed) {
  Matrix left(size, kSteps), right(size, kSteps);
  std::vector<double> entries;
  // Any vector will do that is orthogonal to no singular vector.
  Vector v = Vector::LinSpaced(size, 0, static_cast<double>(size - 1)).array().sin() + 0.5;
  v.normalize();
  for (Eigen::Index k = 0; k < kSteps; ++k) {
    right.col(k) = v;
    Vector u = apply(v);
    const double diagonal = Orthonormalize(left, k, u);
    entries.push_back(diagonal);
    if (diagonal == 0 || k + 1 == kSteps) break;
    left.col(k) = u;
    v = apply_transposed(u);
    const double beside = Orthonormalize(right, k + 1, v);
    if (beside == 0) break;
    entries.push_back(beside);
  }
  if (entries.size() % 2 == 0) entries.pop_back();
  const Eigen::Map<const Vector> all(entries.data(), std::ssize(entries));
  // A solution with a triangle that is all but singular may overflow.
  if (!all.allFinite()) return std::numeric_limits<double>::infinity();
  const double scale = all.cwiseAbs().maxCoeff();
  if (scale == 0) return 0;
  const BidiagonalSpectrum spectrum(all / scale);
  return scale * spectrum.Find((std::ssize(entries) - 1) / 2, 0, spectrum.Bound());
}

}  // namespace

Conditioning ConditioningOfTriangular(const Matrix& upper) {
  const Eigen::Index size = upper.cols();
  if (size <= kMaxDirect) return ConditioningOf(upper);
  Conditioning result{0, std::numeric_limits<double>::infinity()};
  const double scale = upper.cwiseAbs().maxCoeff();
  if (!upper.allFinite() || scale == 0) return result;
  const double zero = static_cast<double>(size) * std::numeric_limits<double>::epsilon();
  result.rank = (upper.diagonal().cwiseAbs().array() > zero * scale).count();
  if (result.rank < size) return result;
  const auto triangle = upper.triangularView<Eigen::Upper>();
  const double largest = LargestSingularValue(
      size, [&](const Vector& v) -> Vector { return triangle * v; },
      [&](const Vector& u) -> Vector { return triangle.transpose() * u; });
  const double inverse_of_smallest = LargestSingularValue(
      size, [&](const Vector& v) -> Vector { return triangle.solve(v); },
      [&](const Vector& u) -> Vector { return triangle.transpose().solve(u); });
  const double number = largest * inverse_of_smallest;
  if (number * zero < 1) {
    result.number = number;
  } else {
    result.rank = size - 1;
  }
  return result;
}

Conditioning ConditioningOf(const Matrix& matrix) {
  Conditioning result{0, std::numeric_limits<double>::infinity()};
  const double scale = matrix.cwiseAbs().maxCoeff();
  if (!matrix.allFinite() || scale == 0) return result;
  const Eigen::Index size = matrix.cols();
  auto bidiagonal = Eigen::internal::UpperBidiagonalization<Matrix>(matrix / scale).bidiagonal();
  Vector beside(2 * size - 1);
  for (Eigen::Index i = 0; i < size; ++i) {
    beside[2 * i] = bidiagonal.diagonal<0>()[i];
    if (i + 1 < size) beside[2 * i + 1] = bidiagonal.diagonal<1>()[i];
  }
  const BidiagonalSpectrum spectrum(std::move(beside));
  const double largest = spectrum.Find(size - 1, 0, spectrum.Bound());
  // Rounding turns a singular value of 0 into one below this.
  const double zero = static_cast<double>(size) * std::numeric_limits<double>::epsilon() * largest;
  result.rank = size - spectrum.CountBelow(zero);
  if (result.rank == size) result.number = largest / spectrum.Find(0, zero / 2, largest);
  return result;
}

}  // namespace polyest::internal
