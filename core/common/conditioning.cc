#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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

}  // namespace

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
