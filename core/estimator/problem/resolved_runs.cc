// What a resolved problem says of runs with their own parameters.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/bayes/population_cost.h"
#include "core/chaos/collocation_points.h"
#include "core/common/check.h"
#include "core/common/golden_fraction.h"
#include "core/estimator/problem/populations.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

int ResolvedProblem::max_runs() const {
  const auto given = static_cast<int>(problem_.uncertain.size());
  const bool eliminates =
      problem_.expansion.adaptive && parameters_per_run_ < given && !uses_filters();
  return eliminates ? std::numeric_limits<int>::max() : max_joint_runs();
}

void ResolvedProblem::SetTargets(const std::vector<std::optional<int>>& found) {
  size_t member = 0;  // which has a population; it comes before the parts of it
  std::string unit;
  for (int run = first_run_; run < runs_; ++run) {
    for (size_t i = 0; i < found.size(); ++i) {
      const UncertainParameter& parameter = problem_.uncertain[i];
      const bool is_part = parameter.part != PopulationPart::kNone;
      if ((!found[i] && !is_part) || (run > first_run_ && !parameter.per_run)) continue;
      targets_.push_back(is_part ? -1 : *found[i]);
      target_run_.push_back(parameter.per_run ? run : -1);
      units_.push_back(is_part ? UnitOfPart(parameter.part, problem_.uncertain[member], unit)
                               : settable_[*found[i]].unit);
      if (parameter.population) {
        member = i;
        unit = units_.back();
      }
      if (parameter.per_run && run == first_run_) ++parameters_per_run_;
    }
  }
}

std::vector<int> ResolvedProblem::SharedParameters() const {
  return OwnParameters(-1);  // their target_run_
}

std::vector<int> ResolvedProblem::OwnParameters(int run) const {
  std::vector<int> own;
  for (size_t i = 0; i < target_run_.size(); ++i) {
    if (target_run_[i] == run) own.push_back(static_cast<int>(i));
  }
  return own;
}

std::optional<ResolvedProblem::Population> ResolvedProblem::population() const {
  std::optional<Population> found;
  const std::vector<UncertainParameter>& all = prior_.parameters();
  for (size_t i = 0; i < all.size(); ++i) {
    if (all[i].part == PopulationPart::kNone) continue;
    if (!found) found = Population();
    (all[i].part == PopulationPart::kMean ? found->mean : found->spread) = static_cast<int>(i);
  }
  if (!found) return found;
  const std::vector<int> own = OwnParameters(first_run_);
  const auto member =
      std::ranges::find_if(own, [&](int i) { return all[static_cast<size_t>(i)].population; });
  found->own = static_cast<int>(member - own.begin());
  return found;
}

int ResolvedProblem::max_joint_runs() const {
  if (!per_run()) return std::numeric_limits<int>::max();
  if (population()) return 1;
  const auto of_one_run = static_cast<int>(problem_.uncertain.size());
  int most = 1 + std::max(0, kMaxParametersOfRuns - of_one_run) / parameters_per_run_;
  const auto too_many = [&] {
    return !problem_.expansion.Validate(of_one_run + (most - 1) * parameters_per_run_).ok();
  };
  while (most > 1 && too_many()) --most;
  return most;
}

namespace {

// Takes a draw of a run's own germs, given by its difference from their centre, from where the
// population counts for nothing to where it counts, the same quantile. The others follow by
// regression.
void MoveIntoPopulation(const ResolvedProblem::Population& among, const Vector& xi,
                        const RunPath& path, const ScoreMixture& shape, const Vector& centre,
                        Vector& drawn) {
  const int i = among.own;
  const Vector with = path.spread * path.spread.row(i).transpose();
  const RunScore alone{centre[i], std::min(1.0, with[i])};
  const double probability = Germ::Normal().CumulativeProbability(drawn[i] / std::sqrt(with[i]));
  const double moved =
      QuantileInPopulation(alone, shape, PopulationOfGerms(xi[among.mean], xi[among.spread]),
                           std::clamp(probability, 1e-9, 1 - 1e-9));
  drawn += (moved - centre[i] - drawn[i]) / with[i] * with;
}

}  // namespace

// Returns the values with those of the first run that has parameters replaced by draws of an ended
// run's: their path (ended_runs.h) and quasi-random normal deviates from it.
Matrix ResolvedProblem::ThetasOfEndedRun(const ConstMatrixRef& thetas, int run) const {
  POLYEST_CHECK(ended_runs_ != nullptr);
  const std::vector<int>& runs = ended_runs_->run;
  const auto found = std::ranges::lower_bound(runs, run);
  if (found == runs.end() || *found != run) return thetas;  // a run without rows: nothing is known
  const auto place = static_cast<size_t>(found - runs.begin());
  const RunPath path = ended_runs_->Path(place);
  const std::vector<int> shared = SharedParameters(), own = OwnParameters(first_run_);
  const Matrix cube = UnitCubePoints(PointSet::kHalton, static_cast<int>(own.size()),
                                     static_cast<int>(thetas.rows()));
  const std::optional<Population> among = population();
  Matrix result = thetas;
  for (Eigen::Index i = 0; i < thetas.rows(); ++i) {
    Vector xi = prior_.ToGerm(thetas.row(i).transpose());
    const Vector deviate = cube.row(i).transpose().unaryExpr([&](double u) {
      const double turned = u + kGoldenFraction * run;
      return Germ::Normal().Quantile(std::clamp(turned - std::floor(turned), 1e-9, 1 - 1e-9));
    });
    const Vector centre = path.centre + path.slope * (xi(shared) - ended_runs_->region.centre());
    Vector drawn = path.spread * deviate;
    if (among) MoveIntoPopulation(*among, xi, path, ended_runs_->shapes[place], centre, drawn);
    xi(own) = centre + drawn;
    for (const int j : own) xi[j] = std::clamp(xi[j], prior_.lower()[j], prior_.upper()[j]);
    result.row(i) = prior_.ToParameters(xi).transpose();
  }
  return result;
}

}  // namespace polyest::internal
