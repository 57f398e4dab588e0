#include "core/bayes/mismatch_sums.h"

#include <algorithm>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr Eigen::Index kRowsAtOnce = 8;  // of a column of G: as wide as the processor's vectors

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
  using Rows = Eigen::Array<double, kRowsAtOnce, 1>;
  const Eigen::Index terms = b_.size();
  std::array<double, kTogether> factors;
  for (Eigen::Index j = 0; j < terms; ++j) {
    for (int k = 0; k < waiting_; ++k) factors[k] = weights_[k] * coefficients_(j, k);  // c_j/R
    double* const column = &g_(0, j);
    Eigen::Index i = j;
    for (; i + kRowsAtOnce <= terms; i += kRowsAtOnce) {
      Rows sum = Rows::Map(column + i);
      for (int k = 0; k < waiting_; ++k) sum += factors[k] * Rows::Map(&coefficients_(i, k));
      Rows::Map(column + i) = sum;
    }
    for (; i < terms; ++i) {
      for (int k = 0; k < waiting_; ++k) column[i] += factors[k] * coefficients_(i, k);
    }
  }
  waiting_ = 0;
  is_whole_ = false;
}

void MismatchSums::Add(const MismatchSums& other) {
  POLYEST_CHECK(other.b_.size() == b_.size());
  Complete();
  g_ += other.G();
  b_ += other.b_;
  w_ += other.w_;
  count_ += other.count_;
}

void MismatchSums::AddLinear(const ConstVectorRef& coefficients, double at_reference) {
  POLYEST_CHECK(coefficients.size() == b_.size());
  // ½ (… − 2 bᵀd + w) + lᵀd + lᵀφ_0
  b_ -= coefficients;
  w_ += 2 * at_reference;
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
