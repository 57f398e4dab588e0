#include "core/bayes/factored_sums.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

constexpr double kNegligibleTrace = 1e-6;

}  // namespace

FactoredSums::FactoredSums(const MismatchSums& sums, bool relative) : b_(sums.b()), w_(sums.w()) {
  const Matrix& g = sums.G();
  const Eigen::Index terms = g.rows();
  const double samples = std::max<double>(1, static_cast<double>(sums.count()));
  // What is left of G_ii is known to the rounding of G_ii itself.
  const Vector rounding =
      static_cast<double>(terms) * std::numeric_limits<double>::epsilon() * g.diagonal();
  Vector left = g.diagonal();  // of G − F Fᵀ
  factor_.resize(terms, terms);
  Vector solution(terms);  // y of F y = b, row by row
  double least = w_;       // w − ‖y‖², the least χ² that the columns so far allow
  Eigen::Index rank = 0;
  for (; rank < terms; ++rank) {
    left = (left.array() > rounding.array()).select(left, 0);
    const double mean_square = relative ? std::clamp(least / samples, 0.0, 1.0) : 1;
    if (left.sum() <= kNegligibleTrace * mean_square) break;
    Eigen::Index pivot;
    const double root = std::sqrt(left.maxCoeff(&pivot));
    if (!(root > 0)) break;
    const auto before = factor_.leftCols(rank);
    auto column = factor_.col(rank);
    column = g.col(pivot);
    column.noalias() -= before * before.row(pivot).transpose();
    column /= root;
    solution[rank] = (b_[pivot] - before.row(pivot).dot(solution.head(rank))) / root;
    least -= solution[rank] * solution[rank];
    left -= column.cwiseAbs2();
    left[pivot] = 0;
  }
  factor_.conservativeResize(terms, rank);
}

void FactoredSums::ChiSquaredMany(const ConstMatrixRef& differences, Matrix& product,
                                  VectorRef values) const {
  product.resize(differences.rows(), factor_.cols());
  product.noalias() = differences * factor_;
  values.noalias() = -2 * (differences * b_);
  for (Eigen::Index k = 0; k < product.cols(); ++k) values += product.col(k).cwiseAbs2();
  // As a sum of squares, χ² is below 0 only by rounding.
  values = (values.array() + w_).max(0.0);
}

}  // namespace polyest::internal
