#pragma once

// A problem whose names have been found in its model: what the estimator and the studies work on.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/bayes/prior.h"
#include "core/estimator/problem/settable_quantities.h"
#include "core/model/equations/expressions.h"
#include "core/model/input_signal.h"
#include "core/propagation/ensemble_propagator.h"
#include "polyest/problem.h"

namespace polyest::internal {

// Uncertain parameters of a record whose runs have parameters of their own.
inline constexpr int kMaxParametersOfRuns = 12;

// A problem whose every name has been found in its model, for a record of so many runs. Its
// uncertain parameters are the problem's, one that is per run under the name "x_0[0]" for run 0,
// and after them those that are per run for run 1, "x_0[1]", for run 2, …
class ResolvedProblem {
 public:
  // INVALID_ARGUMENT or RESOURCE_EXHAUSTED name the field, the value and the rule; an unknown name
  // is answered with the names there are. `measured` may be empty (a propagation needs none).
  // runs ≥ 1.
  static absl::StatusOr<ResolvedProblem> Make(Problem problem, int runs = 1);
  // All that Make has to say against it, not only the first.
  static std::vector<absl::Status> Check(Problem problem);

  const Problem& problem() const { return problem_; }
  int runs() const { return runs_; }
  // Whether runs have parameters of their own, so that each new one adds to the dimension.
  bool per_run() const { return parameters_per_run_ > 0; }
  // The same problem for a record of so many runs; as Make.
  absl::StatusOr<ResolvedProblem> WithRuns(int runs) const { return Make(problem_, runs); }
  // The most runs there may be: as many as keep to kMaxParametersOfRuns; any number without
  // parameters of their own.
  int max_runs() const;
  // 0 < tolerance, within IntegrationOptions' limits; for ensembles made from then on.
  void set_relative_tolerance(double tolerance) {
    problem_.integration.relative_tolerance = tolerance;
  }
  const Prior& prior() const { return prior_; }
  int dimension() const { return prior_.dimension(); }                         // n
  int channels() const { return static_cast<int>(problem_.measured.size()); }  // m
  const std::vector<int>& outputs() const { return outputs_; }  // the model's columns, by channel
  const std::vector<std::string>& units() const { return units_; }  // by uncertain parameter

  // One signal for each of the model's inputs, in its order.
  InputSignals MakeInputs() const;
  // The streamed inputs: their columns among the model's inputs.
  const std::vector<int>& streamed_inputs() const { return streamed_inputs_; }

  // Rows that must follow a row of the data before the streamed inputs are settled up to it.
  int knots_ahead() const { return knots_ahead_; }

  // An ensemble with one trajectory for each row of thetas (Q × n, the uncertain parameters'
  // values), reading `outputs` of the model. 0 ≤ run < runs() where runs have parameters of their
  // own.
  EnsembleSpecification MakeEnsemble(const ConstMatrixRef& thetas, std::vector<int> outputs,
                                     int threads, int run = 0) const;

 private:
  class Resolver;

  ResolvedProblem(Problem problem, Prior prior, int runs)
      : problem_(std::move(problem)),
        prior_(std::move(prior)),
        runs_(runs),
        settable_(problem_.model->description()),
        base_(settable_.Defaults()) {}

  void Derive(Matrix& values) const;

  Problem problem_;
  Prior prior_;
  int runs_;
  int parameters_per_run_ = 0;
  SettableQuantities settable_;
  Vector base_;                  // values of the settable quantities that are not uncertain
  std::vector<int> targets_;     // the settable quantity of each uncertain parameter,
  std::vector<int> target_run_;  // and the run it is of; −1: of all
  std::vector<int> derived_targets_;
  std::vector<int> derived_variables_;
  std::shared_ptr<const Expressions> derived_;  // over all settable quantities; null without any
  std::vector<int> outputs_;
  std::vector<std::string> units_;
  std::vector<int> streamed_inputs_;
  int knots_ahead_ = 0;
};

}  // namespace polyest::internal
