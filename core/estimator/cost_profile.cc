#include "core/estimator/cost_profile.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/bayes/weighted_samples.h"
#include "core/common/status.h"
#include "core/estimator/search_domain.h"

namespace polyest {
namespace {

constexpr double kReach = 4;        // posterior standard deviations to each side of the minimum
constexpr double kOffBound = 1e-9;  // kept from a bound of Ω, of its width (or of 1)

std::vector<std::string> Names(const Prior& prior) {
  std::vector<std::string> names;
  for (const UncertainParameter& parameter : prior.parameters()) names.push_back(parameter.name);
  return names;
}

// J over the points of one hyperplane aᵀη = b of the search, η = base + N v with N an orthonormal
// basis of the directions in it and base its point nearest to where the last one was solved.
class Slice {
 public:
  Slice(const MinimizationProblem& search, const Vector& normal) : search_(search), a_(normal) {
    const Eigen::HouseholderQR<Matrix> factors{Matrix(normal)};
    const Eigen::Index n = normal.size();
    const Matrix q = factors.householderQ() * Matrix::Identity(n, n);
    n_ = q.rightCols(n - 1);
    // −η ≤ −lower, η ≤ upper and the search's own rows, all in v
    const Eigen::Index rows = search.constraint.rows();
    rows_.resize(2 * n + rows, n);
    rows_ << -Matrix::Identity(n, n), Matrix::Identity(n, n), search.constraint;
    bounds_.resize(2 * n + rows);
    bounds_ << -search.lower, search.upper, search.bound;
    KeepRowsThatCross();
  }

  // The least of J on aᵀη = b from several starts η; none where it is nowhere finite.
  std::optional<Minimum> Minimize(double b, const std::vector<Vector>& starts,
                                  const Stop& stop) const {
    const Vector base = ToSlice(starts.front(), b);
    if (n_.cols() == 0) {
      Minimum only;
      only.value = search_.function(base, nullptr);
      only.converged = true;
      return At(base, std::move(only));
    }
    MinimizationProblem problem;
    problem.function = [&](const Vector& v, Vector* gradient) {
      if (gradient == nullptr) return search_.function(base + n_ * v, nullptr);
      Vector slope(a_.size());
      const double value = search_.function(base + n_ * v, &slope);
      *gradient = n_.transpose() * slope;
      return value;
    };
    const double extent = (search_.upper - search_.lower).norm();
    problem.lower = Vector::Constant(n_.cols(), -extent);
    problem.upper = -problem.lower;
    problem.constraint = rows_ * n_;
    problem.bound = bounds_ - rows_ * base;
    Matrix points(static_cast<Eigen::Index>(starts.size()), n_.cols());
    for (size_t i = 0; i < starts.size(); ++i) {
      points.row(static_cast<Eigen::Index>(i)) = n_.transpose() * (ToSlice(starts[i], b) - base);
    }
    Minimum minimum = FindMinima(problem, points, MinimizerOptions(), stop).front();
    return At(base + n_ * minimum.point, minimum);
  }

 private:
  // Those parallel to the hyperplane say nothing in it; rounding would make up a direction of them.
  void KeepRowsThatCross() {
    constexpr double kParallel = 1e-9;
    Eigen::Index kept = 0;
    for (Eigen::Index i = 0; i < rows_.rows(); ++i) {
      if (!((rows_.row(i) * n_).norm() > kParallel * rows_.row(i).norm())) continue;
      rows_.row(kept) = rows_.row(i).eval();
      bounds_[kept++] = bounds_[i];
    }
    rows_.conservativeResize(kept, rows_.cols());
    bounds_.conservativeResize(kept);
  }

  // The nearest point of the hyperplane.
  Vector ToSlice(const Vector& eta, double b) const {
    return eta + a_ * ((b - a_.dot(eta)) / a_.squaredNorm());
  }

  static std::optional<Minimum> At(const Vector& eta, Minimum minimum) {
    if (!std::isfinite(minimum.value)) return std::nullopt;
    minimum.point = eta;
    return minimum;
  }

  const MinimizationProblem& search_;
  Vector a_;
  Matrix n_;
  Matrix rows_;
  Vector bounds_;
};

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
    const Slice slice(search_, to_scores_.row(i).transpose());
    const std::vector<Minimum>& minima = assessed_.posterior.minima;
    const double map_score = at_centre_[i] + to_scores_.row(i).dot(minima.front().point);
    const Eigen::Index middle =
        std::lower_bound(scores.data(), scores.data() + scores.size(), map_score) - scores.data();
    std::vector<std::optional<Minimum>> found(static_cast<size_t>(points_));
    // Outwards to either side, each from its neighbour.
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
  // Evenly spaced scores over the posterior's width, in Ω and in the box of the search.
  Vector Scores(int i) const {
    const Prior& prior = cost_.prior();
    const double map =
        at_centre_[i] + to_scores_.row(i).dot(assessed_.posterior.minima.front().point);
    const double reach = kReach * WeightedStandardDeviation(assessed_.posterior.scores.col(i),
                                                            assessed_.posterior.weights);
    const double middle = at_centre_[i] + to_scores_.row(i).dot(search_.lower + search_.upper) / 2;
    const double half =
        to_scores_.row(i).cwiseAbs().dot((search_.upper - search_.lower).transpose()) / 2;
    const double width = prior.upper()[i] - prior.lower()[i];
    const double off = kOffBound * (std::isfinite(width) ? width : 1);
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

absl::Status ProfileOptions::Validate(const Prior& prior) const {
  const std::vector<std::string> names = Names(prior);
  for (size_t i = 0; i < parameters.size(); ++i) {
    if (std::find(names.begin(), names.end(), parameters[i]) != names.end()) continue;
    return absl::InvalidArgumentError(
        absl::StrFormat("parameters[%d]: \"%s\" is not among the uncertain parameters %s", i,
                        parameters[i], absl::StrJoin(names, ", ")));
  }
  if (points < 3 || points > kMostProfilePoints) {
    return absl::InvalidArgumentError(
        absl::StrFormat("points: %d must be from 3 to %d", points, kMostProfilePoints));
  }
  return absl::OkStatus();
}

absl::StatusOr<CostProfiles> ProfileCost(const Assessed& assessed, const Cost& cost,
                                         const ExpansionDesign& design,
                                         const ProfileOptions& options, const Stop& stop) {
  const Prior& prior = cost.prior();
  const Profiler profiler(assessed, cost, design, options.points, stop);
  CostProfiles result;
  result.parameters = Names(prior);
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

}  // namespace polyest
