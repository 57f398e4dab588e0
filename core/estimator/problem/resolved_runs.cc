// What a resolved problem says of runs with their own parameters.

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/chaos/collocation_points.h"
#include "core/common/check.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

int ResolvedProblem::max_runs() const {
  const auto given = static_cast<int>(problem_.uncertain.size());
  const bool eliminates = problem_.expansion.adaptive && parameters_per_run_ < given;
  return eliminates ? std::numeric_limits<int>::max() : max_joint_runs();
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

int ResolvedProblem::max_joint_runs() const {
  if (!per_run()) return std::numeric_limits<int>::max();
  const auto of_one_run = static_cast<int>(problem_.uncertain.size());
  int most = 1 + std::max(0, kMaxParametersOfRuns - of_one_run) / parameters_per_run_;
  const auto too_many = [&] {
    return !problem_.expansion.Validate(of_one_run + (most - 1) * parameters_per_run_).ok();
  };
  while (most > 1 && too_many()) --most;
  return most;
}

// Returns the values with those of the first run that has parameters replaced by draws of an ended
// run's: their path (ended_runs.h) and quasi-random normal deviates from it.
Matrix ResolvedProblem::ThetasOfEndedRun(const ConstMatrixRef& thetas, int run) const {
  POLYEST_CHECK(ended_runs_ != nullptr);
  constexpr double kGoldenRatio = 0.6180339887498949;
  const std::vector<int>& runs = ended_runs_->run;
  const auto found = std::ranges::lower_bound(runs, run);
  if (found == runs.end() || *found != run) return thetas;  // a run without rows: nothing is known
  const RunPath path = ended_runs_->Path(static_cast<size_t>(found - runs.begin()));
  const std::vector<int> shared = SharedParameters(), own = OwnParameters(first_run_);
  const Matrix cube = UnitCubePoints(PointSet::kHalton, static_cast<int>(own.size()),
                                     static_cast<int>(thetas.rows()));
  Matrix result = thetas;
  for (Eigen::Index i = 0; i < thetas.rows(); ++i) {
    Vector xi = prior_.ToGerm(thetas.row(i).transpose());
    const Vector deviate = cube.row(i).transpose().unaryExpr([&](double u) {
      const double turned = u + kGoldenRatio * run;
      return Germ::Normal().Quantile(std::clamp(turned - std::floor(turned), 1e-9, 1 - 1e-9));
    });
    xi(own) = path.centre + path.slope * (xi(shared) - ended_runs_->region.centre()) +
              path.spread * deviate;
    for (const int j : own) xi[j] = std::clamp(xi[j], prior_.lower()[j], prior_.upper()[j]);
    result.row(i) = prior_.ToParameters(xi).transpose();
  }
  return result;
}

}  // namespace polyest::internal
