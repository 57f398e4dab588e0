#pragma once

// A problem whose names have been resolved in its model. The estimator and the studies work on it.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/bayes/prior.h"
#include "core/estimator/problem/ended_runs.h"
#include "core/estimator/problem/process_noise.h"
#include "core/estimator/problem/row_gate.h"
#include "core/estimator/problem/settable_quantities.h"
#include "core/model/equations/expressions.h"
#include "core/model/input_signal.h"
#include "core/propagation/ensemble_propagator.h"
#include "polyest/problem.h"

namespace polyest::internal {

// Maximum number of uncertain parameters of an expansion over several runs with their own
// parameters. A run that would bring more leaves all earlier runs without theirs (ended_runs.h).
inline constexpr int kMaxParametersOfRuns = 12;

// A problem whose names have all been resolved in its model, for a record of a given number of
// runs. Its uncertain parameters are the problem's own, a per-run one named "x_0[0]" for run 0,
// followed by the per-run ones for run 1, "x_0[1]", for run 2, … While run r is the last of more
// runs than kMaxParametersOfRuns allow, they are the problem's own, a per-run one named "x_0[r]".
// The mean and the spread of a population are uncertain parameters that follow the problem's own
// (populations.h); the model does not know them.
class ResolvedProblem {
 public:
  // Resolves the problem for `runs` ≥ 1 runs. Returns InvalidArgument or ResourceExhausted that
  // name the field, the value and the rule; for an unknown name the message lists the known ones.
  // `measured` may be empty (a propagation needs no measured outputs).
  // The parameters of runs before `first_run` < `runs` are left out.
  static absl::StatusOr<ResolvedProblem> Make(Problem problem, int runs = 1, int first_run = 0);
  // Returns every error of Make, not only the first.
  static std::vector<absl::Status> Check(Problem problem);

  const Problem& problem() const { return problem_; }
  int runs() const { return runs_; }
  int first_run() const { return first_run_; }  // the first one with parameters in the problem
  // Whether runs have their own parameters, so that each new run adds to the dimension.
  bool per_run() const { return parameters_per_run_ > 0; }
  // Returns the problem resolved for another number of runs, all with their parameters, or for one
  // run alone. Errors are those of Make.
  absl::StatusOr<ResolvedProblem> WithRuns(int runs) const { return Make(problem_, runs); }
  absl::StatusOr<ResolvedProblem> OfRun(int run) const { return Make(problem_, run + 1, run); }
  // Returns the problem while `run` is the last run of the record: with the parameters of all runs
  // up to max_joint_runs(), of this one alone beyond.
  absl::StatusOr<ResolvedProblem> AtRun(int run) const {
    return run < max_joint_runs() ? WithRuns(run + 1) : OfRun(run);
  }
  // Returns the maximum number of runs with parameters in one expansion: as many as
  // kMaxParametersOfRuns and the expansion's limits allow, one if they share a population, or any
  // number if runs have no parameters of their own.
  int max_joint_runs() const;
  // Returns the maximum number of runs of a record: that of one expansion where ended runs cannot
  // be eliminated, because the expansion is not adaptive or the runs share no parameter, else any.
  int max_runs() const;
  // What is known of the runs before the first one whose parameters are in the problem; null if
  // there are none.
  const EndedRuns* ended_runs() const { return ended_runs_.get(); }
  void set_ended_runs(std::shared_ptr<const EndedRuns> ended) { ended_runs_ = std::move(ended); }
  // Returns the first row of the record that an expansion of this problem takes.
  int64_t first_row() const { return ended_runs_ ? ended_runs_->rows : 0; }
  // Returns the uncertain parameters that all runs share, and those of one run.
  std::vector<int> SharedParameters() const;
  std::vector<int> OwnParameters(int run) const;
  // Whether the variance of what filters predict, and little else, depends on an uncertain
  // parameter: a spectral density, the rate of a drift or the noise of a sensor.
  bool IsOfVariance(int parameter) const;
  // Returns `thetas` (draws × n) with draws of an ended run's own parameters, given the shared
  // ones, in place of those of first_run(). Requires run < first_run().
  Matrix ThetasOfEndedRun(const ConstMatrixRef& thetas, int run) const;
  // The germs of the population that a parameter of the runs shares, and which of OwnParameters
  // that parameter is; nothing without a population.
  struct Population {
    int mean = 0;
    int spread = 0;
    int own = 0;
  };
  std::optional<Population> population() const;
  // Sets the tolerance of ensembles made from now on; it must be above 0 and within the limits of
  // IntegrationOptions.
  void set_relative_tolerance(double tolerance) {
    problem_.integration.relative_tolerance = tolerance;
  }
  const Prior& prior() const { return prior_; }
  int dimension() const { return prior_.dimension(); }                         // n
  int channels() const { return static_cast<int>(problem_.measured.size()); }  // m
  const std::vector<int>& outputs() const { return outputs_; }  // columns of the model, by channel
  const std::vector<std::string>& units() const { return units_; }  // by uncertain parameter

  // Returns one signal for each of the model's inputs, in its order.
  InputSignals MakeInputs() const;
  // Returns the columns of the streamed inputs among the model's inputs.
  const std::vector<int>& streamed_inputs() const { return streamed_inputs_; }

  // Returns InputSignal::knots_needed of each streamed input.
  const std::vector<int>& knots_needed() const { return knots_needed_; }

  // Returns, by channel, the time from which samples are used, in s: the largest delay of the
  // output that the problem allows, and at least 0.
  const std::vector<double>& used_from_s() const { return used_from_s_; }
  // How far beyond a time its samples need the streamed inputs, in s, ≥ 0: the inputs' negative
  // delays and those of the outputs together.
  double lead_s() const { return input_lead_s_ + output_lead_s_; }
  // The condition under which rows are used; null if all are.
  const RowGate* gate() const { return gate_.get(); }
  // Whether the likelihood is that of the prediction errors of filters (process_noise.h), which
  // MakeEnsemble then specifies.
  bool uses_filters() const { return uses_filters_; }
  // Returns the model whose states the ensembles have: the problem's, with states for parameters
  // that drift (drifting_model.h).
  const std::shared_ptr<const Model>& model() const { return model_; }
  // Whether an output may have a delay other than 0.
  bool delays_outputs() const { return delays_outputs_; }
  // Whether ensembles have a State at the checkpoints inside of a run.
  bool has_checkpoints_in_runs() const {
    return HasCheckpointsInRuns(*problem_.model) && !delays_outputs_;
  }

  // Returns an ensemble with one trajectory for each row of `thetas` (Q × n, values of the
  // uncertain parameters) that reads the model's `outputs`. If runs have their own parameters, 0 ≤
  // run < runs() is required. Those of an ended run are draws of their posterior given the shared
  // ones.
  EnsembleSpecification MakeEnsemble(const ConstMatrixRef& thetas, std::vector<int> outputs,
                                     int threads, int run = 0) const;

 private:
  class Resolver;

  ResolvedProblem(Problem problem, Prior prior, int runs, int first_run)
      : problem_(std::move(problem)),
        prior_(std::move(prior)),
        uses_filters_(UsesFilters(problem_)),
        runs_(runs),
        first_run_(first_run),
        settable_(problem_.model->description(), problem_),
        base_(settable_.Defaults()) {}

  // Sets the targets and units of the uncertain parameters; `found` are the settable quantities of
  // the problem's, where there are any.
  void SetTargets(const std::vector<std::optional<int>>& found);
  void Derive(Matrix& values) const;
  std::vector<bool> AreHeavyTailed(const std::vector<int>& outputs) const;

  Problem problem_;
  Prior prior_;
  bool uses_filters_;
  int runs_;
  int first_run_;  // the first one whose parameters are among the uncertain ones
  int parameters_per_run_ = 0;
  std::shared_ptr<const EndedRuns> ended_runs_;
  std::shared_ptr<const Model> model_;
  SettableQuantities settable_;
  Vector base_;                  // values of the settable quantities that are not uncertain
  std::vector<int> targets_;     // settable quantity of each uncertain parameter; −1 for none
  std::vector<int> target_run_;  // and its run; −1 for all runs
  std::vector<int> derived_targets_;
  std::vector<int> derived_variables_;
  std::shared_ptr<const Expressions> derived_;  // over all settable quantities; null without any
  std::vector<int> outputs_;
  std::vector<std::string> units_;
  std::vector<int> streamed_inputs_;
  std::vector<int> knots_needed_;
  std::vector<double> used_from_s_;
  double input_lead_s_ = 0, output_lead_s_ = 0;
  bool delays_outputs_ = false;
  std::shared_ptr<const RowGate> gate_;
};

}  // namespace polyest::internal
