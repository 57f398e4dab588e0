#include "core/estimator/expansion/search_domain.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

// Adds the row aᵀη ≤ bound.
void Constrain(const Vector& row, double bound, MinimizationProblem& search) {
  search.constraint.conservativeResize(search.constraint.rows() + 1, row.size());
  search.bound.conservativeResize(search.bound.size() + 1);
  search.constraint.bottomRows(1) = row.transpose();
  search.bound.tail(1)[0] = bound;
}

// Returns the box of the search, with Ω and the element in local coordinates as rows a with
// aᵀη ≤ bound.
MinimizationProblem SearchDomain(const ExpansionDesign& design, const Prior& prior,
                                 const Element& element) {
  MinimizationProblem search;
  SamplingBox(design, search.lower, search.upper);
  const int n = prior.dimension();
  search.constraint.resize(0, n);
  search.bound.resize(0);
  for (int i = 0; i < n; ++i) {
    const double off = prior.OffBound(i);
    for (const double sign : {1.0, -1.0}) {
      const double bound = sign > 0 ? prior.upper()[i] : -prior.lower()[i];
      if (!std::isfinite(bound)) continue;
      if (design.whole_prior) {
        if (sign > 0) search.upper[i] = std::min(search.upper[i], bound - off);
        if (sign < 0) search.lower[i] = std::max(search.lower[i], -(bound - off));
        continue;
      }
      Constrain(sign * design.region.axes().row(i).transpose(),
                bound - off - sign * design.region.centre()[i], search);
    }
  }
  for (const Element::Bound& bound : element.bounds()) {
    Constrain(design.region.axes().transpose() * bound.normal,
              bound.offset - bound.normal.dot(design.region.centre()), search);
  }
  return search;
}

}  // namespace

MinimizationProblem SearchOf(const Cost& cost, const ExpansionDesign& design) {
  MinimizationProblem search = SearchDomain(design, cost.prior(), cost.element());
  search.threads = cost.threads();
  search.function = [&cost](const Vector& eta, Vector* gradient) {
    if (gradient == nullptr) return cost.Evaluate(eta).total;
    return cost.EvaluateWithGradient(eta, *gradient).total;
  };
  return search;
}

Matrix SpreadStarts(const Matrix& points, const Vector& costs, int count) {
  const Vector mean = points.colwise().mean().transpose();
  const Matrix centred = points.rowwise() - mean.transpose();
  const Vector scale = (centred.colwise().squaredNorm() / static_cast<double>(points.rows()))
                           .cwiseSqrt()
                           .transpose();
  Matrix starts(count, points.cols());
  Eigen::Index chosen;
  costs.minCoeff(&chosen);
  Vector distance = Vector::Constant(points.rows(), std::numeric_limits<double>::infinity());
  for (int i = 0; i < count; ++i) {
    starts.row(i) = points.row(chosen);
    for (Eigen::Index k = 0; k < points.rows(); ++k) {
      const auto difference = (points.row(k) - starts.row(i)).transpose().array() /
                              scale.array().max(std::numeric_limits<double>::min());
      distance[k] = std::min(distance[k], difference.square().sum());
    }
    distance.maxCoeff(&chosen);
  }
  return starts;
}

}  // namespace polyest::internal
