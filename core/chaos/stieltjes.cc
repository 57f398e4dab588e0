#include "core/chaos/stieltjes.h"

#include <cmath>
#include <utility>

#include "core/common/check.h"

namespace polyest::internal {

// Computes p_{k+1} √b_{k+1} = (ξ − a_k) p_k − √b_k p_{k−1} with a_k = ∫ ξ p_k² ρ and the b_{k+1}
// that makes ∫ p_{k+1}² ρ = 1.
RecurrenceCoefficients StieltjesRecurrence(const DiscreteMeasure& measure, int count) {
  POLYEST_CHECK(count >= 1);
  RecurrenceCoefficients result{Vector::Zero(count), Vector::Ones(count)};
  Eigen::ArrayXd previous = Eigen::ArrayXd::Zero(measure.weights.size());
  Eigen::ArrayXd present = Eigen::ArrayXd::Ones(measure.weights.size());
  for (int k = 0; k < count; ++k) {
    const double mean = (measure.weights * measure.offsets * present.square()).sum();
    result.a[k] = measure.start + mean;
    if (k + 1 == count) break;
    Eigen::ArrayXd next = (measure.offsets - mean) * present;
    if (k > 0) next -= std::sqrt(result.b[k]) * previous;
    result.b[k + 1] = (measure.weights * next.square()).sum();
    previous = std::move(present);
    present = next / std::sqrt(result.b[k + 1]);
  }
  return result;
}

}  // namespace polyest::internal
