#include "core/bayes/mismatch_sums.h"

#include <algorithm>
#include <cmath>

#include "core/common/check.h"
#include "core/common/finite_matrix.h"

namespace polyest::internal {
namespace {

constexpr Eigen::Index kRowsAtOnce = 8;  // of a column of G: as wide as the processor's vectors
constexpr int kColumnsAtOnce = 6;        // of G: as many as have room in registers

}  // namespace

MismatchSums::MismatchSums(int terms) : g_(Matrix::Zero(terms, terms)), b_(Vector::Zero(terms)) {}

void MismatchSums::Add(const ConstVectorRef& coefficients, double error, double variance) {
  POLYEST_CHECK(coefficients.size() == b_.size() && variance > 0);
  const double weight = 1 / variance;
  coefficients_.resize(b_.size(), kTogether);
  coefficients_.col(waiting_) = coefficients;
  weights_[static_cast<size_t>(waiting_)] = weight;
  if (++waiting_ == kTogether) AddWaiting();
  b_ += (weight * error) * coefficients;  // b += c e/R
  w_ += weight * error * error;           // w += e²/R
  ++count_;
}

bool MismatchSums::IsValid(int terms) const {
  return IsFiniteMatrix(G(), terms, terms) && IsFiniteMatrix(b_, terms) && std::isfinite(w_) &&
         count_ >= 0;
}

const Matrix& MismatchSums::G() const {
  Complete();
  return g_;
}

void MismatchSums::Complete() const {
  if (waiting_ > 0) AddWaiting();
  if (is_whole_) return;  // several threads may come here
  g_.triangularView<Eigen::StrictlyUpper>() = g_.transpose();
  is_whole_ = true;
}

// Adds c cᵀ/R to the lower triangle of G for each sample that waits, in their order.
void MismatchSums::AddWaiting() const {
  const Eigen::Index terms = b_.size();
  Eigen::Index first = 0;
  for (; first + kColumnsAtOnce <= terms; first += kColumnsAtOnce) AddTo<kColumnsAtOnce>(first);
  for (; first < terms; ++first) AddTo<1>(first);
  waiting_ = 0;
  is_whole_ = false;
}

// Adds whole vectors of rows, from the last row upwards. What they add above the diagonal is
// overwritten when G is completed.
template <int kColumns>
void MismatchSums::AddTo(Eigen::Index first) const {
  using Rows = Eigen::Array<double, kRowsAtOnce, 1>;
  std::array<std::array<double, kColumns>, kTogether> factors;  // c_j/R
  for (int k = 0; k < waiting_; ++k) {
    for (int j = 0; j < kColumns; ++j) factors[k][j] = weights_[k] * coefficients_(first + j, k);
  }
  Eigen::Index row = b_.size();
  while (row > first && row >= kRowsAtOnce) {
    row -= kRowsAtOnce;
    std::array<Rows, kColumns> sums;
    for (int j = 0; j < kColumns; ++j) sums[j] = Rows::Map(&g_(row, first + j));
    for (int k = 0; k < waiting_; ++k) {
      const Rows values = Rows::Map(&coefficients_(row, k));
      for (int j = 0; j < kColumns; ++j) sums[j] += factors[k][j] * values;
    }
    for (int j = 0; j < kColumns; ++j) Rows::Map(&g_(row, first + j)) = sums[j];
  }
  while (row > first) {
    --row;
    for (int j = 0; j < kColumns; ++j) {
      double& sum = g_(row, first + j);
      for (int k = 0; k < waiting_; ++k) sum += factors[k][j] * coefficients_(row, k);
    }
  }
}

void MismatchSums::Add(const MismatchSums& other) {
  POLYEST_CHECK(other.b_.size() == b_.size());
  Complete();
  g_ += other.G();
  b_ += other.b_;
  w_ += other.w_;
  count_ += other.count_;
}

MismatchSums MismatchSums::Substituted(const ConstMatrixRef& t, const ConstVectorRef& shift,
                                       double variance) const {
  POLYEST_CHECK(t.cols() == b_.size() && shift.size() == b_.size() && variance > 0);
  const Vector moved = b_ - G() * shift;
  MismatchSums sums(static_cast<int>(t.rows()));
  sums.g_ = t * G() * t.transpose();
  sums.g_ = (0.5 / variance * (sums.g_ + sums.g_.transpose())).eval();
  sums.b_ = t * moved / variance;
  sums.w_ = std::max(0.0, w_ - shift.dot(b_ + moved)) / variance;
  sums.count_ = count_;
  return sums;
}

double MismatchSums::ChiSquared(const ConstVectorRef& d) const {
  // The χ² is dᵀ G d − 2 bᵀ d + w; as a sum of squares it is below 0 only by rounding.
  return std::max(0.0, d.dot(G() * d) - 2 * b_.dot(d) + w_);
}

double MismatchSums::ChiSquaredWithGradient(const ConstVectorRef& d, VectorRef gradient) const {
  gradient.noalias() = G() * d;
  const double value = std::max(0.0, d.dot(gradient) - 2 * b_.dot(d) + w_);
  gradient = 2 * (gradient - b_);  // 2 (G d − b)
  return value;
}

}  // namespace polyest::internal
