#include "core/bayes/factored_sums.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

constexpr double kNegligibleTrace = 1e-6;
// Fewer terms than these are multiplied by G faster than the sums are factored.
constexpr int kMinTerms = 100;

// Returns F, as the header says.
Matrix FactorOf(const MismatchSums& sums, bool relative) {
  const Matrix& g = sums.G();
  const Vector& b = sums.b();
  const Eigen::Index terms = g.rows();
  const double samples = std::max<double>(1, static_cast<double>(sums.count()));
  // What is left of G_ii is known to the rounding of G_ii itself.
  const Vector rounding =
      static_cast<double>(terms) * std::numeric_limits<double>::epsilon() * g.diagonal();
  Vector left = g.diagonal();  // of G − F Fᵀ
  Matrix factor(terms, terms);
  Vector solution(terms);   // y of F y = b, row by row
  double least = sums.w();  // w − ‖y‖², the least χ² that the columns so far allow
  Eigen::Index rank = 0;
  for (; rank < terms; ++rank) {
    left = (left.array() > rounding.array()).select(left, 0);
    const double mean_square = relative ? std::clamp(least / samples, 0.0, 1.0) : 1;
    if (left.sum() <= kNegligibleTrace * mean_square) break;
    Eigen::Index pivot;
    const double root = std::sqrt(left.maxCoeff(&pivot));
    if (!(root > 0)) break;
    const auto before = factor.leftCols(rank);
    auto column = factor.col(rank);
    column = g.col(pivot);
    column.noalias() -= before * before.row(pivot).transpose();
    column /= root;
    solution[rank] = (b[pivot] - before.row(pivot).dot(solution.head(rank))) / root;
    least -= solution[rank] * solution[rank];
    left -= column.cwiseAbs2();
    left[pivot] = 0;
  }
  factor.conservativeResize(terms, rank);
  return factor;
}

}  // namespace

const Matrix& FactoredSums::Factor() const {
  std::call_once(once_, [this] { factor_ = FactorOf(*sums_, relative_); });
  return factor_;
}

// Whether two products with F are less work than one with G.
bool FactoredSums::FactorPays() const {
  return sums_->terms() >= kMinTerms && 2 * rank() <= sums_->terms();
}

double FactoredSums::ChiSquared(const ConstVectorRef& d) const {
  if (!FactorPays()) return sums_->ChiSquared(d);
  // As a sum of squares, χ² is below 0 only by rounding.
  return std::max(0.0,
                  (factor_.transpose() * d).squaredNorm() - 2 * sums_->b().dot(d) + sums_->w());
}

double FactoredSums::ChiSquaredWithGradient(const ConstVectorRef& d, VectorRef gradient) const {
  if (!FactorPays()) return sums_->ChiSquaredWithGradient(d, gradient);
  const Vector product = factor_.transpose() * d;
  gradient.noalias() = 2 * (factor_ * product);
  gradient -= 2 * sums_->b();
  return std::max(0.0, product.squaredNorm() - 2 * sums_->b().dot(d) + sums_->w());
}

Matrix FactoredSums::Information(const ConstMatrixRef& phi_gradient) const {
  if (!FactorPays()) return phi_gradient.transpose() * (sums_->G() * phi_gradient);
  const Matrix product = factor_.transpose() * phi_gradient;
  return product.transpose() * product;
}

void FactoredSums::ChiSquaredMany(const ConstMatrixRef& differences, Matrix& product,
                                  VectorRef values) const {
  const Matrix& factor = Factor();
  product.resize(differences.rows(), factor.cols());
  product.noalias() = differences * factor;
  values.noalias() = -2 * (differences * sums_->b());
  for (Eigen::Index k = 0; k < product.cols(); ++k) values += product.col(k).cwiseAbs2();
  values = (values.array() + sums_->w()).max(0.0);
}

}  // namespace polyest::internal
