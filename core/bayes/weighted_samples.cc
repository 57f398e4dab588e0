#include "core/bayes/weighted_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "core/common/check.h"
#include "core/common/golden_fraction.h"

namespace polyest::internal {
namespace {

constexpr double kLeftOut = 5e-4;  // probability left out of a density at each side

using WeightedDraw = std::pair<double, double>;

// Returns the draws in ascending order, each with its weight. It deals them to stretches of equal
// length first, a quarter as many as draws, because to sort the few draws of each takes less time.
std::vector<WeightedDraw> Sorted(const ConstVectorRef& draws, const ConstVectorRef& weights) {
  const double lowest = draws.minCoeff(), span = draws.maxCoeff() - lowest;
  const double last = static_cast<double>(draws.size() / 4);  // stretch
  const double scale = last / span;
  const bool divided = span > 0 && span < kInfinity && scale < kInfinity;
  const auto stretch_of = [&](double draw) {
    return divided ? static_cast<size_t>(std::min(last, std::max(0.0, scale * (draw - lowest))))
                   : 0;
  };
  // Where the first draw of each stretch goes and, while draws are put there, the next one.
  std::vector<Eigen::Index> place(static_cast<size_t>(last) + 2, 0);
  for (const double draw : draws) ++place[stretch_of(draw) + 1];
  std::partial_sum(place.begin(), place.end(), place.begin());
  std::vector<WeightedDraw> sorted(static_cast<size_t>(draws.size()));
  for (Eigen::Index i = 0; i < draws.size(); ++i) {
    Eigen::Index& next = place[stretch_of(draws[i])];
    sorted[static_cast<size_t>(next++)] = {draws[i], weights[i]};
  }
  // Each place is now the end of its stretch.
  auto begin = sorted.begin();
  for (const Eigen::Index end : place) {
    std::sort(begin, sorted.begin() + end);
    begin = sorted.begin() + end;
  }
  return sorted;
}

// The bins of equal width over the central part of the draws.
class Bins {
 public:
  Bins(const ConstVectorRef& draws, const ConstVectorRef& weights, int count) : count_(count) {
    const WeightedQuantiles quantile(draws, weights);
    lowest_ = quantile(kLeftOut);
    width_ = (quantile(1 - kLeftOut) - lowest_) / count;
    // One bin serves draws that do not vary, or so little that the density would overflow.
    if (width_ > std::numeric_limits<double>::min()) return;
    count_ = 1;
    width_ = 1;
    lowest_ -= 0.5;
  }

  int count() const { return count_; }
  double width() const { return width_; }
  Vector Centres() const {
    return lowest_ + (Vector::LinSpaced(count_, 0, count_ - 1).array() + 0.5) * width_;
  }
  // Returns the bin of a draw; −1 outside.
  int Of(double draw) const {
    const double position = (draw - lowest_) / width_;
    if (!(position >= 0 && position <= count_)) return -1;
    return std::min(static_cast<int>(position), count_ - 1);
  }

 private:
  int count_;
  double lowest_ = 0;
  double width_ = 0;
};

// Returns the rows at `count` pointers, one in each stretch of 1/count of the weight, at the part
// place(i) of the i-th stretch (0 … 1).
template <typename Place>
std::vector<Eigen::Index> RowsAt(const ConstVectorRef& weights, int count, Place place) {
  POLYEST_CHECK(weights.size() > 0 && count >= 0);
  std::vector<Eigen::Index> chosen;
  chosen.reserve(static_cast<size_t>(count));
  Eigen::Index source = 0;
  double cumulative = weights[0];
  const double all = weights.sum();
  for (int i = 0; i < count; ++i) {
    const double pointer = all * (i + place(i)) / count;
    while (cumulative < pointer && source + 1 < weights.size()) cumulative += weights[++source];
    chosen.push_back(source);
  }
  return chosen;
}

}  // namespace

double EffectiveSizeOfWeights(const ConstVectorRef& weights) {
  return weights.sum() * weights.sum() / weights.squaredNorm();
}

double WeightedMean(const ConstVectorRef& draws, const ConstVectorRef& weights) {
  return weights.dot(draws);
}

double WeightedStandardDeviation(const ConstVectorRef& draws, const ConstVectorRef& weights) {
  const double mean = WeightedMean(draws, weights);
  return std::sqrt(weights.dot((draws.array() - mean).square().matrix()));
}

WeightedQuantiles::WeightedQuantiles(const ConstVectorRef& draws, const ConstVectorRef& weights)
    : draws_(draws.size()), cumulative_(draws.size()) {
  POLYEST_CHECK(draws.size() > 0 && draws.size() == weights.size());
  const std::vector<WeightedDraw> sorted = Sorted(draws, weights);
  double below = 0;
  for (Eigen::Index i = 0; i < draws.size(); ++i) {
    const auto [draw, weight] = sorted[static_cast<size_t>(i)];
    draws_[i] = draw;
    cumulative_[i] = below + weight / 2;
    below += weight;
  }
}

double WeightedQuantiles::operator()(double probability) const {
  POLYEST_CHECK(probability >= 0 && probability <= 1);
  const double* const first = cumulative_.data();
  const Eigen::Index above =
      std::lower_bound(first, first + cumulative_.size(), probability) - first;
  if (above == 0) return draws_[0];
  if (above == draws_.size()) return draws_[above - 1];
  const double span = cumulative_[above] - cumulative_[above - 1];
  if (!(span > 0)) return draws_[above];
  const double fraction = (probability - cumulative_[above - 1]) / span;
  return (1 - fraction) * draws_[above - 1] + fraction * draws_[above];
}

DensityEstimate WeightedDensity(const ConstVectorRef& draws, const ConstVectorRef& weights,
                                int count) {
  POLYEST_CHECK(count >= 1);
  const Bins bins(draws, weights, count);
  DensityEstimate estimate{bins.Centres(), Vector::Zero(bins.count())};
  for (Eigen::Index i = 0; i < draws.size(); ++i) {
    const int bin = bins.Of(draws[i]);
    if (bin >= 0) estimate.density[bin] += weights[i] / bins.width();
  }
  return estimate;
}

JointDensity WeightedJointDensity(const ConstVectorRef& first, const ConstVectorRef& second,
                                  const ConstVectorRef& weights, int count) {
  POLYEST_CHECK(count >= 1 && first.size() == second.size());
  const Bins rows(first, weights, count);
  const Bins columns(second, weights, count);
  JointDensity joint{rows.Centres(), columns.Centres(),
                     Matrix::Zero(rows.count(), columns.count())};
  for (Eigen::Index i = 0; i < first.size(); ++i) {
    const int row = rows.Of(first[i]);
    const int column = columns.Of(second[i]);
    if (row < 0 || column < 0) continue;
    joint.density(row, column) += weights[i] / rows.width() / columns.width();
  }
  return joint;
}

std::vector<Eigen::Index> EquallyWeighted(const ConstVectorRef& weights, int count) {
  return RowsAt(weights, count, [](int) { return 0.5; });
}

std::vector<Eigen::Index> StratifiedDraws(const ConstVectorRef& weights, int count) {
  return RowsAt(weights, count, [](int i) {
    const double place = 0.5 + i * kGoldenFraction;
    return place - std::floor(place);
  });
}

void Shuffle(std::vector<Eigen::Index>& rows, std::mt19937_64& generator) {
  for (size_t end = rows.size(); end > 1; --end) {
    std::swap(rows[end - 1], rows[static_cast<size_t>(generator() % end)]);
  }
}

}  // namespace polyest::internal
