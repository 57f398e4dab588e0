#include "core/estimator/studies/cost_profile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/bayes/weighted_samples.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/cost_slice.h"
#include "core/estimator/studies/study_options.h"

namespace polyest::internal {
namespace {

constexpr double kReach = 4;  // in posterior standard deviations to each side of the minimum

class Profiler {
 public:
  Profiler(const Assessed& assessed, const Cost& cost, const ExpansionDesign& design, int points,
           const Stop& stop)
      : assessed_(assessed),
        cost_(cost),
        design_(design),
        points_(points),
        stop_(stop),
        search_(SearchOf(cost, design)) {
    // z = F (centre + axes η)
    const Region& region = design.region;
    to_scores_ = cost.prior().factor() * region.axes();
    at_centre_ = cost.prior().ToScores(region.centre());
  }

  absl::StatusOr<CostProfile> Run(int i) const {
    const Vector scores = Scores(i);
    const CostSlice slice(search_, to_scores_.row(i).transpose());
    const std::vector<Minimum>& minima = assessed_.posterior.minima;
    const double map_score = at_centre_[i] + to_scores_.row(i).dot(minima.front().point);
    const Eigen::Index middle =
        std::lower_bound(scores.data(), scores.data() + scores.size(), map_score) - scores.data();
    std::vector<std::optional<Minimum>> found(static_cast<size_t>(points_));
    // The search goes outwards on either side; each point starts from its neighbour.
    for (const int step : {1, -1}) {
      std::vector<Vector> starts = {minima.front().point};
      for (const Minimum& minimum : minima) starts.push_back(minimum.point);
      for (Eigen::Index k = step > 0 ? middle : middle - 1; k >= 0 && k < points_; k += step) {
        auto& minimum = found[static_cast<size_t>(k)];
        minimum = slice.Minimize(scores[k] - at_centre_[i], starts, stop_);
        POLYEST_RETURN_IF_ERROR(stop_.Check());
        if (!minimum) break;
        starts.front() = minimum->point;
      }
    }
    return Describe(i, scores, found);
  }

 private:
  // Returns evenly spaced scores over the posterior's width, within Ω and the box of the search.
  Vector Scores(int i) const {
    const Prior& prior = cost_.prior();
    const double map =
        at_centre_[i] + to_scores_.row(i).dot(assessed_.posterior.minima.front().point);
    const double reach = kReach * WeightedStandardDeviation(assessed_.posterior.scores.col(i),
                                                            assessed_.posterior.weights);
    const double middle = at_centre_[i] + to_scores_.row(i).dot(search_.lower + search_.upper) / 2;
    const double half =
        to_scores_.row(i).cwiseAbs().dot((search_.upper - search_.lower).transpose()) / 2;
    const double off = prior.OffBound(i);
    return Vector::LinSpaced(points_,
                             std::max({map - reach, middle - half, prior.lower()[i] + off}),
                             std::min({map + reach, middle + half, prior.upper()[i] - off}));
  }

  CostProfile Describe(int i, const Vector& scores,
                       const std::vector<std::optional<Minimum>>& found) const {
    const Prior& prior = cost_.prior();
    CostProfile profile;
    profile.parameter = prior.parameters()[static_cast<size_t>(i)].name;
    profile.unit = assessed_.estimate.parameters[static_cast<size_t>(i)].unit;
    const Eigen::Index count =
        std::count_if(found.begin(), found.end(), [](const auto& one) { return one.has_value(); });
    profile.value.resize(count);
    profile.total.resize(count);
    profile.mismatch.resize(count);
    profile.prior.resize(count);
    profile.at.resize(count, prior.dimension());
    Eigen::Index row = 0;
    for (size_t k = 0; k < found.size(); ++k) {
      if (!found[k]) continue;
      const CostValue cost = cost_.Evaluate(found[k]->point);
      profile.value[row] = prior.OfScore(i, scores[static_cast<Eigen::Index>(k)]);
      profile.total[row] = cost.total;
      profile.mismatch[row] = cost.mismatch;
      profile.prior[row] = cost.prior;
      profile.at.row(row++) =
          prior.ToParameters(design_.region.ToGerm(found[k]->point)).transpose();
      profile.converged.push_back(found[k]->converged);
    }
    return profile;
  }

  const Assessed& assessed_;
  const Cost& cost_;
  const ExpansionDesign& design_;
  int points_;
  const Stop& stop_;
  MinimizationProblem search_;
  Matrix to_scores_;
  Vector at_centre_;
};

}  // namespace

namespace {

// Returns a profile's total at a value, interpolated between its points; +∞ outside.
double TotalAt(const CostProfile& profile, double value) {
  const double* const first = profile.value.data();
  const double* const last = first + profile.value.size();
  const Eigen::Index above = std::lower_bound(first, last, value) - first;
  if (above == profile.value.size()) return std::numeric_limits<double>::infinity();
  if (profile.value[above] == value) return profile.total[above];
  if (above == 0) return std::numeric_limits<double>::infinity();
  const double part =
      (value - profile.value[above - 1]) / (profile.value[above] - profile.value[above - 1]);
  return (1 - part) * profile.total[above - 1] + part * profile.total[above];
}

// Returns the points of all profiles at which no other profile is lower.
CostProfile LowestOf(const std::vector<CostProfile>& profiles) {
  struct Point {
    size_t profile;
    Eigen::Index row;
  };
  std::vector<Point> points;
  for (size_t k = 0; k < profiles.size(); ++k) {
    for (Eigen::Index row = 0; row < profiles[k].value.size(); ++row) {
      const bool lowest = std::ranges::all_of(profiles, [&](const CostProfile& other) {
        return TotalAt(other, profiles[k].value[row]) >= profiles[k].total[row];
      });
      if (lowest) points.push_back({k, row});
    }
  }
  std::ranges::stable_sort(
      points, {}, [&](const Point& point) { return profiles[point.profile].value[point.row]; });
  CostProfile lowest = profiles.front();
  const auto count = static_cast<Eigen::Index>(points.size());
  for (Vector* column : {&lowest.value, &lowest.total, &lowest.mismatch, &lowest.prior}) {
    column->resize(count);
  }
  lowest.at.resize(count, profiles.front().at.cols());
  lowest.converged.clear();
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto [k, row] = points[static_cast<size_t>(i)];
    const CostProfile& from = profiles[k];
    lowest.value[i] = from.value[row];
    lowest.total[i] = from.total[row];
    lowest.mismatch[i] = from.mismatch[row];
    lowest.prior[i] = from.prior[row];
    lowest.at.row(i) = from.at.row(row);
    lowest.converged.push_back(from.converged[static_cast<size_t>(row)]);
  }
  return lowest;
}

}  // namespace

CostProfiles LowestOf(const std::vector<CostProfiles>& components,
                      const std::vector<double>& heights) {
  CostProfiles result = components.front();
  for (size_t i = 0; i < result.profiles.size(); ++i) {
    std::vector<CostProfile> profiles;
    for (size_t k = 0; k < components.size(); ++k) {
      profiles.push_back(components[k].profiles[i]);
      profiles.back().total.array() += heights[k] - heights.front();
      profiles.back().mismatch.array() += heights[k] - heights.front();
    }
    result.profiles[i] = LowestOf(profiles);
  }
  for (size_t k = 1; k < components.size(); ++k) {
    CostValue least = components[k].least;
    least.total += heights[k] - heights.front();
    least.mismatch += heights[k] - heights.front();
    if (least.total >= result.least.total) continue;
    result.least = least;
    result.map = components[k].map;
  }
  return result;
}

absl::Status Validate(const ProfileOptions& options, const Prior& prior) {
  for (size_t i = 0; i < options.parameters.size(); ++i) {
    const FieldPath field{"parameters", i};
    POLYEST_RETURN_IF_ERROR(FindUncertain(prior, field, options.parameters[i]).status());
  }
  return CheckRange("points", options.points, 3, kMaxProfilePoints);
}

absl::StatusOr<CostProfiles> ProfileCost(const Assessed& assessed, const Cost& cost,
                                         const ExpansionDesign& design,
                                         const ProfileOptions& options, const Stop& stop) {
  const Prior& prior = cost.prior();
  const Profiler profiler(assessed, cost, design, options.points, stop);
  CostProfiles result;
  result.parameters = prior.Names();
  for (int i = 0; i < prior.dimension(); ++i) {
    const std::string& name = result.parameters[static_cast<size_t>(i)];
    const bool wanted = options.parameters.empty() ||
                        std::find(options.parameters.begin(), options.parameters.end(), name) !=
                            options.parameters.end();
    if (!wanted) continue;
    POLYEST_ASSIGN_OR_RETURN(CostProfile profile, profiler.Run(i));
    result.profiles.push_back(std::move(profile));
  }
  result.least = assessed.estimate.cost;
  result.map.resize(prior.dimension());
  for (int i = 0; i < prior.dimension(); ++i) {
    result.map[i] = assessed.estimate.parameters[static_cast<size_t>(i)].map;
  }
  result.diagnostics = assessed.estimate.diagnostics;
  return result;
}

}  // namespace polyest::internal
