#pragma once

// Makes ensembles of a built-in model for tests: parameters by name, one value a point.

#include <memory>
#include <utility>
#include <vector>

#include "core/common/check.h"
#include "core/propagation/ensemble_propagator.h"
#include "polyest/catalogue.h"

namespace polyest::internal {

inline InputSignal Signal(InputSpecification specification) {
  return *InputSignal::Make(std::move(specification));
}

inline std::vector<double> TimesUntil(double end_s, double step_s) {
  std::vector<double> times_s;
  for (int i = 0; i * step_s <= end_s + step_s / 2; ++i) times_s.push_back(i * step_s);
  return times_s;
}

struct Ensemble {
  Ensemble(const char* model, int points, std::vector<const char*> outputs)
      : Ensemble(*FindBuiltinModel(model), points, std::move(outputs)) {}
  Ensemble(std::shared_ptr<const Model> model, int points, std::vector<const char*> outputs) {
    specification.model = std::move(model);
    const ModelDescription& description = specification.model->description();
    specification.parameters.resize(points, std::ssize(description.parameters));
    for (Eigen::Index j = 0; j < specification.parameters.cols(); ++j) {
      specification.parameters.col(j).setConstant(description.parameters[j].default_value);
    }
    specification.amplitudes.setZero(points, std::ssize(description.inputs));
    for (const char* output : outputs) {
      specification.outputs.push_back(*description.FindOutput(output));
    }
    inputs.assign(description.inputs.size(), Signal(ConstantInput{}));
  }

  void Set(const char* parameter, int point, double value) {
    specification.parameters(point, *Description().FindParameter(parameter)) = value;
  }
  void Set(const char* parameter, double value) {
    specification.parameters.col(*Description().FindParameter(parameter)).setConstant(value);
  }
  // Sets u(t) = amplitude · shape(t) for all points.
  void Drive(const char* input, InputSpecification specified, double amplitude) {
    const int index = *Description().FindInput(input);
    inputs[index] = Signal(std::move(specified));
    specification.amplitudes.col(index).setConstant(amplitude);
  }

  const ModelDescription& Description() const { return specification.model->description(); }
  int points() const { return static_cast<int>(specification.parameters.rows()); }

  // Returns the outputs at these times, points × (outputs · times).
  Matrix Propagate(const std::vector<double>& times_s) {
    EnsemblePropagator propagator(specification, &inputs);
    return Advance(propagator, times_s);
  }
  Matrix Advance(EnsemblePropagator& propagator, const std::vector<double>& times_s) {
    Matrix outputs(points(), std::ssize(times_s) * std::ssize(specification.outputs));
    POLYEST_CHECK(propagator.Advance(times_s, outputs, Stop()).ok());
    failures = propagator.failures();
    return outputs;
  }

  EnsembleSpecification specification;
  InputSignals inputs;
  std::vector<PointFailure> failures;  // of the last propagation
};

}  // namespace polyest::internal
