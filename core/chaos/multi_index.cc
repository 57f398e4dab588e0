#include "core/chaos/multi_index.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// The set's members in descending lexicographic order.
class HyperbolicSet {
 public:
  HyperbolicSet(int dimension, const Truncation& truncation)
      : exponent_(truncation.exponent), index_(Eigen::ArrayXi::Zero(dimension)) {
    POLYEST_CHECK(dimension >= 1 && truncation.order >= 0);
    POLYEST_CHECK(exponent_ > 0 && exponent_ <= 1);
    for (int degree = 0; degree <= truncation.order; ++degree) {
      powers_.push_back(std::pow(degree, exponent_));
    }
  }

  // Calls visit(member) until it returns false.
  template <typename Visitor>
  bool Visit(const Visitor& visit) {
    return VisitFrom(0, powers_.back(), visit);
  }

 private:
  static constexpr double kRounding = 1e-9;

  // Visits all degrees of the variables from k on; `left` is what the earlier ones leave of p^q.
  template <typename Visitor>
  bool VisitFrom(Eigen::Index k, double left, const Visitor& visit) {
    if (k == index_.size()) return visit(index_);
    const auto beyond = std::ranges::upper_bound(powers_, left + kRounding) - powers_.begin();
    for (auto degree = static_cast<int>(beyond) - 1; degree >= 0; --degree) {
      index_[k] = degree;
      if (!VisitFrom(k + 1, left - powers_[static_cast<size_t>(degree)], visit)) return false;
    }
    return true;
  }

  double exponent_;
  Eigen::ArrayXi index_;
  std::vector<double> powers_;  // j^q
};

}  // namespace

int64_t TotalDegreeTermCount(int dimension, int order) {
  POLYEST_CHECK(dimension >= 0 && order >= 0);
  // (n+p)!/(n! p!) = Π_{i=1}^{min} (max + i)/i; each partial product is a binomial coefficient.
  const int64_t smaller = std::min(dimension, order), larger = std::max(dimension, order);
  int64_t count = 1;
  for (int64_t i = 1; i <= smaller; ++i) {
    // The fraction is cancelled before it is multiplied, so that only the result itself can
    // overflow.
    const int64_t common = std::gcd(count, i);
    const int64_t factor = (larger + i) / (i / common);
    if (count / common > std::numeric_limits<int64_t>::max() / factor) {
      return std::numeric_limits<int64_t>::max();
    }
    count = count / common * factor;
  }
  return count;
}

int64_t TermCount(int dimension, const Truncation& truncation, int64_t most) {
  if (truncation.exponent == 1) {
    return std::min(TotalDegreeTermCount(dimension, truncation.order), most + 1);
  }
  if (truncation.order >= most) return most + 1;  // one variable alone has order + 1 terms
  int64_t count = 0;
  HyperbolicSet(dimension, truncation).Visit([&](const Eigen::ArrayXi&) {
    return ++count <= most;
  });
  return count;
}

Eigen::ArrayXXi MultiIndices(int dimension, const Truncation& truncation) {
  std::vector<Eigen::ArrayXi> members;
  HyperbolicSet(dimension, truncation).Visit([&](const Eigen::ArrayXi& index) {
    members.push_back(index);
    return true;
  });
  std::ranges::stable_sort(members, {}, [](const Eigen::ArrayXi& index) { return index.sum(); });
  Eigen::ArrayXXi indices(std::ssize(members), dimension);
  for (size_t s = 0; s < members.size(); ++s) {
    indices.row(static_cast<Eigen::Index>(s)) = members[s].transpose();
  }
  return indices;
}

}  // namespace polyest::internal
