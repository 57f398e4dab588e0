// The ensembles and inputs of a problem (resolved_problem.h).

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/common/check.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

InputSignals ResolvedProblem::MakeInputs() const {
  const ModelDescription& model = problem_.model->description();
  InputSignals signals;
  for (const Quantity& input : model.inputs) {
    InputSpecification specification = ConstantInput{};
    for (const NamedInput& given : problem_.inputs) {
      if (given.name == input.name) specification = given.signal;
    }
    absl::StatusOr<InputSignal> signal = InputSignal::Make(specification);
    POLYEST_CHECK(signal.ok());
    signals.push_back(*std::move(signal));
  }
  return signals;
}

EnsembleSpecification ResolvedProblem::MakeEnsemble(const ConstMatrixRef& thetas,
                                                    std::vector<int> outputs, int threads,
                                                    int run) const {
  POLYEST_CHECK(thetas.cols() == dimension() && (run < runs_ || !per_run()));
  if (per_run() && run < first_run_) {
    return MakeEnsemble(ThetasOfEndedRun(thetas, run), std::move(outputs), threads, first_run_);
  }
  Matrix values = base_.transpose().replicate(thetas.rows(), 1);
  for (size_t i = 0; i < targets_.size(); ++i) {
    if (targets_[i] < 0 || (target_run_[i] >= 0 && target_run_[i] != run)) continue;
    values.col(targets_[i]) = thetas.col(static_cast<Eigen::Index>(i));
  }
  if (derived_ != nullptr) Derive(values);
  EnsembleSpecification specification;
  specification.model = model_;
  specification.outputs = std::move(outputs);
  settable_.Fill(values, specification);
  specification.inputs_ahead_s = output_lead_s_;
  specification.integration = problem_.integration;
  specification.threads = threads;
  if (uses_filters()) specification.heavy_tailed = AreHeavyTailed(specification.outputs);
  return specification;
}

bool ResolvedProblem::IsOfVariance(int parameter) const {
  const int target = targets_[static_cast<size_t>(parameter)];
  if (target < 0) return false;
  const auto kind = settable_[target].kind;
  return kind == SettableQuantities::Kind::kSpectralDensity ||
         kind == SettableQuantities::Kind::kDriftRate || kind == SettableQuantities::Kind::kNoise;
}

// Whether outliers are handled in the samples of each output (a column of the model's).
std::vector<bool> ResolvedProblem::AreHeavyTailed(const std::vector<int>& outputs) const {
  std::vector<bool> tailed;
  for (const int output : outputs) {
    const auto channel = std::ranges::find(outputs_, output) - outputs_.begin();
    tailed.push_back(channel < std::ssize(outputs_) &&
                     problem_.measured[static_cast<size_t>(channel)].noise.outliers !=
                         OutlierHandling::kNone);
  }
  return tailed;
}

// A derived value that is not finite makes the whole point fail: the model's parameters and the
// amplitudes of its inputs are then not numbers. Delays, gains and the like stay as they are, since
// what is done with them for all points must not depend on one that fails.
void ResolvedProblem::Derive(Matrix& values) const {
  Matrix results(values.rows(), std::ssize(derived_targets_));
  derived_->Evaluate(values(Eigen::all, derived_variables_), results);
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    if (results.row(row).allFinite()) {
      values(row, derived_targets_) = results.row(row);
      continue;
    }
    for (int i = 0; i < settable_.size(); ++i) {
      const auto kind = settable_[i].kind;
      if (kind == SettableQuantities::Kind::kParameter ||
          kind == SettableQuantities::Kind::kAmplitude) {
        values(row, i) = std::numeric_limits<double>::quiet_NaN();
      }
    }
  }
}

}  // namespace polyest::internal
