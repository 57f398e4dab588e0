#include "core/chaos/collocation_points.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <utility>

#include "core/chaos/gauss_rule.h"
#include "core/common/check.h"
#include "core/common/field_error.h"

namespace polyest::internal {
namespace {

constexpr int kLastFaureBase = 89;  // of 24 dimensions

std::vector<int> FirstPrimes(int count) {
  std::vector<int> primes;
  for (int candidate = 2; static_cast<int>(primes.size()) < count; ++candidate) {
    bool is_prime = true;
    for (const int prime : primes) {
      if (prime * prime > candidate) break;
      if (candidate % prime == 0) {
        is_prime = false;
        break;
      }
    }
    if (is_prime) primes.push_back(candidate);
  }
  return primes;
}

// Returns Faure's (1992) permutation of the digits 0 … base − 1, which fixes 0.
std::vector<int> DigitPermutation(int base) {
  if (base == 2) return {0, 1};
  std::vector<int> permutation;
  if (base % 2 == 0) {
    const std::vector<int> half = DigitPermutation(base / 2);
    for (const int digit : half) permutation.push_back(2 * digit);
    for (const int digit : half) permutation.push_back(2 * digit + 1);
    return permutation;
  }
  const int middle = (base - 1) / 2;
  permutation = DigitPermutation(base - 1);
  for (int& digit : permutation) digit += digit >= middle ? 1 : 0;
  permutation.insert(permutation.begin() + middle, middle);
  return permutation;
}

// Returns a permutation of the digits 0 … base − 1 that fixes 0 and is otherwise random, the same
// at each call.
std::vector<int> RandomPermutation(int base) {
  std::vector<int> permutation(static_cast<size_t>(base));
  std::iota(permutation.begin(), permutation.end(), 0);
  std::mt19937_64 generator(static_cast<uint64_t>(base));
  for (uint64_t i = permutation.size() - 1; i > 1; --i) {
    std::swap(permutation[i], permutation[1 + generator() % i]);
  }
  return permutation;
}

std::vector<int> Digits(int base, bool scrambled) {
  if (scrambled) {
    return base > kLastFaureBase ? RandomPermutation(base) : DigitPermutation(base);
  }
  std::vector<int> digits;
  for (int digit = 0; digit < base; ++digit) digits.push_back(digit);
  return digits;
}

// Computes the radical inverse Σ_i σ(d_i) base^(−i−1) of each index Σ_i d_i base^i from 1 to the
// number of values. The inverses of indices of k + 1 digits with the leading digit d_k are those of
// the indices below base^k, plus σ(d_k) base^(−k−1).
void FillRadicalInverses(int base, const std::vector<int>& permutation, VectorRef values) {
  Vector inverse(values.size() + 1);  // of each index from 0
  inverse[0] = 0;
  double weight = 1;
  for (Eigen::Index power = 1; power < inverse.size(); power *= base) {
    weight /= base;
    for (int digit = 1; digit < base; ++digit) {
      const Eigen::Index first = digit * power;
      if (first >= inverse.size()) break;
      const Eigen::Index count = std::min(power, inverse.size() - first);
      inverse.segment(first, count) =
          inverse.head(count).array() + weight * permutation[static_cast<size_t>(digit)];
    }
  }
  values = inverse.tail(values.size());
}

constexpr int kPlainDimensions = 3;

// Returns the points of the unit cube mapped by each germ's quantile function.
Matrix MappedPoints(PointSet set, const std::vector<Germ>& germs, int count) {
  Matrix points = UnitCubePoints(set, static_cast<int>(germs.size()), count);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const Germ& germ = germs[static_cast<size_t>(k)];
    for (double& coordinate : points.col(k)) coordinate = germ.Quantile(coordinate);
  }
  return points;
}

absl::StatusOr<Matrix> GaussTensor(const std::vector<Germ>& germs, int order, int max_points) {
  const Eigen::Index side = order + 1, n = static_cast<Eigen::Index>(germs.size());
  Eigen::Index count = 1;
  for (Eigen::Index k = 0; k < n; ++k) {
    if (count > max_points / side) {
      return FieldError(absl::StatusCode::kResourceExhausted, "expansion.points",
                        absl::StrCat("a Gauss tensor grid of order ", order, " in ", n,
                                     " uncertain quantities has ", side, "^", n,
                                     " points, more than the limit ", max_points, "; use HALTON"));
    }
    count *= side;
  }
  Matrix points(count, n);
  Eigen::Index repeat = count;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vector nodes = MakeGaussRule(germs[static_cast<size_t>(k)], order + 1).nodes;
    repeat /= side;  // the last germ varies fastest
    for (Eigen::Index q = 0; q < count; ++q) points(q, k) = nodes[q / repeat % side];
  }
  return points;
}

}  // namespace

Matrix UnitCubePoints(PointSet set, int dimension, int count) {
  POLYEST_CHECK(set != PointSet::kGaussTensor && dimension >= 1 && count >= 0);
  const std::vector<int> primes = FirstPrimes(dimension);
  Matrix points(count, dimension);
  int column = 0;
  if (set == PointSet::kHammersley) {
    points.col(column++) = (Vector::LinSpaced(count, 0, count - 1).array() + 0.5) / count;
  }
  for (int k = 0; column < dimension; ++k, ++column) {
    const int prime = primes[static_cast<size_t>(k)];
    FillRadicalInverses(prime, Digits(prime, k >= kPlainDimensions), points.col(column));
  }
  return points;
}

Matrix HaltonDraws(const std::vector<Germ>& germs, int count) {
  return MappedPoints(PointSet::kHalton, germs, count);
}

absl::StatusOr<Matrix> CollocationPoints(PointSet set, const std::vector<Germ>& germs, int order,
                                         int count, int max_points) {
  POLYEST_CHECK(!germs.empty() && order >= 0);
  if (set == PointSet::kGaussTensor) return GaussTensor(germs, order, max_points);
  return MappedPoints(set, germs, count);
}

}  // namespace polyest::internal
