#include "core/chaos/basis.h"

#include <algorithm>
#include <map>
#include <utility>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// The number of points that EvaluateMany evaluates at a time, so that the columns of all terms stay
// in the cache.
constexpr Eigen::Index kPointsAtATime = 128;

}  // namespace

Basis::Basis(std::vector<Germ> germs, Truncation truncation)
    : germs_(std::move(germs)), truncation_(truncation) {
  POLYEST_CHECK(!germs_.empty());
  const int n = dimension();
  indices_ = MultiIndices(n, truncation_);
  a_.resize(order() + 1, n);
  sqrt_b_.resize(order() + 1, n);
  for (int k = 0; k < n; ++k) {
    const RecurrenceCoefficients recurrence =
        germs_[static_cast<size_t>(k)].Recurrence(order() + 1);
    a_.col(k) = recurrence.a;
    sqrt_b_.col(k) = recurrence.b.cwiseSqrt();
  }
  FindTerms();
}

void Basis::FindTerms() {
  const int n = dimension();
  std::map<std::vector<int>, int> position;
  const auto at = [&](int variable, int degree) {
    std::vector<int> index(static_cast<size_t>(n), 0);
    index[static_cast<size_t>(variable)] = degree;
    return position.at(index);
  };
  position[std::vector<int>(static_cast<size_t>(n), 0)] = 0;
  for (int s = 1; s < size(); ++s) {
    std::vector<int> index(static_cast<size_t>(n));
    int k = 0;
    for (int i = 0; i < n; ++i) {
      index[static_cast<size_t>(i)] = indices_(s, i);
      if (indices_(s, i) > 0) k = i;
    }
    position[index] = s;
    const int degree = indices_(s, k);
    index[static_cast<size_t>(k)] = 0;
    Term term{k, degree, position.at(index), at(k, degree), -1, -1};
    if (term.parent == 0) {
      term.previous = at(k, degree - 1);
      if (degree > 1) term.second = at(k, degree - 2);
    }
    terms_.push_back(term);
  }
}

void Basis::Evaluate(const ConstVectorRef& xi, VectorRef phi) const {
  POLYEST_CHECK(xi.size() == dimension() && phi.size() == size());
  phi[0] = 1;
  for (int s = 1; s < size(); ++s) {
    const Term& term = terms_[static_cast<size_t>(s - 1)];
    if (term.parent != 0) {
      // φ_s = φ_parent P_j
      phi[s] = phi[term.parent] * phi[term.single];
      continue;
    }
    // √b_j P_j = (ξ − a_{j−1}) P_{j−1} − √b_{j−1} P_{j−2}
    const int k = term.variable, j = term.degree;
    double value = (xi[k] - a_(j - 1, k)) * phi[term.previous];
    if (term.second >= 0) value -= sqrt_b_(j - 1, k) * phi[term.second];
    phi[s] = value / sqrt_b_(j, k);
  }
}

void Basis::EvaluateWithGradient(const ConstVectorRef& xi, VectorRef phi,
                                 MatrixRef gradient) const {
  POLYEST_CHECK(gradient.rows() == size() && gradient.cols() == dimension());
  Evaluate(xi, phi);
  gradient.setZero();
  for (int s = 1; s < size(); ++s) {
    const Term& term = terms_[static_cast<size_t>(s - 1)];
    const int k = term.variable, j = term.degree;
    if (term.parent != 0) {
      // ∂_i φ_s = ∂_i φ_parent P_j for i < k, and ∂_k φ_s = φ_parent P'_j
      for (int i = 0; i < k; ++i) gradient(s, i) = gradient(term.parent, i) * phi[term.single];
      gradient(s, k) = phi[term.parent] * gradient(term.single, k);
      continue;
    }
    // √b_j P'_j = P_{j−1} + (ξ − a_{j−1}) P'_{j−1} − √b_{j−1} P'_{j−2}
    double slope = phi[term.previous] + (xi[k] - a_(j - 1, k)) * gradient(term.previous, k);
    if (term.second >= 0) slope -= sqrt_b_(j - 1, k) * gradient(term.second, k);
    gradient(s, k) = slope / sqrt_b_(j, k);
  }
}

Matrix Basis::WeightedHessian(const ConstVectorRef& xi, const ConstVectorRef& phi,
                              const ConstMatrixRef& gradient, const ConstVectorRef& weights) const {
  POLYEST_CHECK(phi.size() == size() && gradient.rows() == size() && weights.size() == size());
  // A product φ_s = φ_parent P_j has the Hessian
  //   P_j ∇²φ_parent + φ_parent ∇²P_j + ∇φ_parent ∇P_jᵀ + ∇P_j ∇φ_parentᵀ,
  // so that its factors, which come before it, inherit its weight.
  Vector inherited = weights;
  Matrix sum = Matrix::Zero(dimension(), dimension());  // its upper triangle, to begin with
  for (int s = size() - 1; s > 0; --s) {
    const Term& term = terms_[static_cast<size_t>(s - 1)];
    if (term.parent == 0) continue;
    const int k = term.variable;
    inherited[term.parent] += inherited[s] * phi[term.single];
    inherited[term.single] += inherited[s] * phi[term.parent];
    const double factor = inherited[s] * gradient(term.single, k);
    for (int i = 0; i < k; ++i) sum(i, k) += factor * gradient(term.parent, i);
  }
  Vector second = Vector::Zero(size());  // P''_j of the polynomials of one germ alone
  for (int s = 1; s < size(); ++s) {
    const Term& term = terms_[static_cast<size_t>(s - 1)];
    if (term.parent != 0) continue;
    // √b_j P''_j = 2 P'_{j−1} + (ξ − a_{j−1}) P''_{j−1} − √b_{j−1} P''_{j−2}
    const int k = term.variable, j = term.degree;
    double value = 2 * gradient(term.previous, k) + (xi[k] - a_(j - 1, k)) * second[term.previous];
    if (term.second >= 0) value -= sqrt_b_(j - 1, k) * second[term.second];
    second[s] = value / sqrt_b_(j, k);
    sum(k, k) += inherited[s] * second[s];
  }
  sum.triangularView<Eigen::StrictlyLower>() = sum.transpose();
  return sum;
}

void Basis::EvaluateMany(const ConstMatrixRef& points, Matrix& values) const {
  POLYEST_CHECK(points.cols() == dimension());
  values.resize(points.rows(), size());
  for (Eigen::Index first = 0; first < points.rows(); first += kPointsAtATime) {
    const Eigen::Index count = std::min(kPointsAtATime, points.rows() - first);
    const auto column = [&](int s) { return values.col(s).segment(first, count).array(); };
    column(0).setOnes();
    for (int s = 1; s < size(); ++s) {
      const Term& term = terms_[static_cast<size_t>(s - 1)];
      if (term.parent != 0) {
        // φ_s = φ_parent P_j
        column(s) = column(term.parent) * column(term.single);
        continue;
      }
      // √b_j P_j = (ξ − a_{j−1}) P_{j−1} − √b_{j−1} P_{j−2}
      const int k = term.variable, j = term.degree;
      const auto xi = points.col(k).segment(first, count).array();
      const double scale = 1 / sqrt_b_(j, k), shift = a_(j - 1, k);
      if (term.second >= 0) {
        column(s) = scale * ((xi - shift) * column(term.previous) -
                             sqrt_b_(j - 1, k) * column(term.second));
      } else {
        column(s) = scale * (xi - shift);
      }
    }
  }
}

}  // namespace polyest::internal
