#pragma once

// Makes ensembles of the tests' FMUs: parameters by name, one value a point.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/common/check.h"
#include "core/fmu/fmu_folder.h"
#include "core/propagation/ensemble_propagator.h"
#include "polyest/catalogue.h"

namespace polyest::internal {

inline ModelFolder TestFmus(const WorkerLimits& limits = {}) {
  return *ModelFolder::Open(POLYEST_TEST_FMUS, FmuFiles(limits));
}

inline std::vector<double> TimesUntil(double end_s, double step_s) {
  std::vector<double> times_s;
  for (int i = 0; i * step_s <= end_s + step_s / 2; ++i) times_s.push_back(i * step_s);
  return times_s;
}

// Holds an ensemble with all parameters at their defaults and all inputs 0.
struct FmuEnsemble {
  FmuEnsemble(std::shared_ptr<const Model> model, int points, std::vector<const char*> outputs) {
    specification.model = std::move(model);
    const ModelDescription& description = Description();
    specification.parameters.resize(points, std::ssize(description.parameters));
    for (Eigen::Index j = 0; j < specification.parameters.cols(); ++j) {
      specification.parameters.col(j).setConstant(
          description.parameters[static_cast<size_t>(j)].default_value);
    }
    specification.amplitudes.setZero(points, std::ssize(description.inputs));
    for (const char* output : outputs) {
      specification.outputs.push_back(*description.FindOutput(output));
    }
    inputs.assign(description.inputs.size(), *InputSignal::Make(ConstantInput{}));
  }
  FmuEnsemble(const char* fmu, int points, std::vector<const char*> outputs,
              const WorkerLimits& limits = {})
      : FmuEnsemble(*TestFmus(limits).Find(fmu), points, std::move(outputs)) {}

  void Set(const char* parameter, int point, double value) {
    specification.parameters(point, *Description().FindParameter(parameter)) = value;
  }
  void Set(const char* parameter, double value) {
    specification.parameters.col(*Description().FindParameter(parameter)).setConstant(value);
  }
  void Drive(const char* input, InputSpecification signal, double amplitude) {
    const int index = *Description().FindInput(input);
    inputs[static_cast<size_t>(index)] = *InputSignal::Make(std::move(signal));
    specification.amplitudes.col(index).setConstant(amplitude);
  }

  const ModelDescription& Description() const { return specification.model->description(); }
  int points() const { return static_cast<int>(specification.parameters.rows()); }

  // Returns the outputs at these times, points × (outputs · times).
  absl::StatusOr<Matrix> TryPropagate(const std::vector<double>& times_s,
                                      const Stop& stop = Stop()) {
    EnsemblePropagator propagator(specification, &inputs);
    Matrix outputs(points(), std::ssize(times_s) * std::ssize(specification.outputs));
    const absl::Status status = propagator.Advance(times_s, outputs, stop);
    failures = propagator.failures();
    if (!status.ok()) return status;
    return outputs;
  }
  Matrix Propagate(const std::vector<double>& times_s) {
    absl::StatusOr<Matrix> outputs = TryPropagate(times_s);
    if (!outputs.ok()) std::fprintf(stderr, "%s\n", outputs.status().ToString().c_str());
    POLYEST_CHECK(outputs.ok());
    return *std::move(outputs);
  }

  EnsembleSpecification specification;
  InputSignals inputs;
  std::vector<PointFailure> failures;  // of the last propagation
};

// The built-in model as an FMU is to the integrator: nothing is known of its equations, so that it
// is not stepped exactly, and no step is longer than the interval between two samples.
class UnknownEquations final : public StateSpaceModel {
 public:
  explicit UnknownEquations(std::shared_ptr<const Model> model, bool uses_time = true)
      : owner_(std::move(model)),
        model_(dynamic_cast<const StateSpaceModel&>(*owner_)),
        uses_time_(uses_time) {}
  const ModelDescription& description() const override { return model_.description(); }
  void InitialStates(const ConstBlock& parameters, Block states) const override {
    model_.InitialStates(parameters, states);
  }
  void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock& inputs, Block derivatives) const override {
    model_.Derivatives(time_s, states, parameters, inputs, derivatives);
  }
  void Outputs(double time_s, const ConstBlock& states, const ConstBlock& parameters,
               const ConstBlock& inputs, Block outputs) const override {
    model_.Outputs(time_s, states, parameters, inputs, outputs);
  }
  bool uses_time() const override { return uses_time_; }

 private:
  std::shared_ptr<const Model> owner_;
  const StateSpaceModel& model_;
  const bool uses_time_;
};

}  // namespace polyest::internal
