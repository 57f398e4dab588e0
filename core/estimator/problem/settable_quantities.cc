#include "core/estimator/problem/settable_quantities.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include "core/estimator/problem/drifting_model.h"
#include "core/estimator/problem/process_noise.h"

namespace polyest::internal {
namespace {

// Returns `block`, or an empty matrix if all its elements are `neutral`.
Matrix UnlessNeutral(const Matrix& block, double neutral) {
  return (block.array() == neutral).all() ? Matrix() : block;
}

// Sets the factors of the noise of a measured output, unless they are all 1.
void SetNoise(const SettableQuantities::Settable& noise, const Vector& values,
              EnsembleSpecification& ensemble) {
  const Vector factors = values / noise.unit_value;
  if ((factors.array() == 1).all()) return;
  const auto outputs = std::ssize(ensemble.outputs);
  for (Eigen::Index c = 0; c < outputs; ++c) {
    if (ensemble.outputs[static_cast<size_t>(c)] != noise.column) continue;
    if (ensemble.noise_factors.size() == 0) {
      ensemble.noise_factors.setOnes(values.size(), outputs);
    }
    ensemble.noise_factors.col(c) = factors;
  }
}

}  // namespace

std::string NoiseName(const std::string& output) { return absl::StrCat(output, ".noise"); }

SettableQuantities::SettableQuantities(const ModelDescription& model, const Problem& problem)
    : parameters_(static_cast<int>(model.parameters.size())),
      inputs_(static_cast<int>(model.inputs.size())),
      outputs_(static_cast<int>(model.outputs.size())),
      states_(static_cast<int>(model.states.size())) {
  AddQuantitiesOfModel(model);
  AddHyperparameters(model, problem);
}

void SettableQuantities::AddQuantitiesOfModel(const ModelDescription& model) {
  for (int i = 0; i < parameters_; ++i) {
    const Quantity& parameter = model.parameters[static_cast<size_t>(i)];
    all_.push_back({parameter.name, parameter.unit, parameter.default_value, parameter.has_default,
                    Kind::kParameter, i});
  }
  for (int i = 0; i < inputs_; ++i) {
    const Quantity& input = model.inputs[static_cast<size_t>(i)];
    all_.push_back({input.name + ".amplitude", input.unit, 0, true, Kind::kAmplitude, i});
    all_.push_back({input.name + ".gain", "1", 1, true, Kind::kInputGain, i});
    all_.push_back({input.name + ".delay", "s", 0, true, Kind::kDelay, i});
    all_.push_back({input.name + ".offset", input.unit, 0, true, Kind::kInputOffset, i});
  }
  for (int i = 0; i < outputs_; ++i) {
    const Quantity& output = model.outputs[static_cast<size_t>(i)];
    all_.push_back({output.name + ".gain", "1", 1, true, Kind::kOutputGain, i});
    all_.push_back({output.name + ".delay", "s", 0, true, Kind::kOutputDelay, i});
    all_.push_back({output.name + ".offset", output.unit, 0, true, Kind::kOutputOffset, i});
  }
}

void SettableQuantities::AddHyperparameters(const ModelDescription& model, const Problem& problem) {
  for (const ProcessNoise& noise : problem.process_noise) {
    for (int i = 0; i < states_; ++i) {
      const Quantity& state = model.states[static_cast<size_t>(i)];
      if (state.name != noise.state) continue;
      const std::string unit = state.unit.empty() ? "" : absl::StrCat("(", state.unit, ")^2/s");
      all_.push_back({SpectralDensityName(state.name), unit, noise.spectral_density, true,
                      Kind::kSpectralDensity, i});
    }
  }
  for (const UncertainParameter& parameter : problem.uncertain) {
    const auto column = model.FindParameter(parameter.name);
    if (!parameter.drift || !column) continue;
    const std::string& unit = model.parameters[static_cast<size_t>(*column)].unit;
    all_.push_back({DriftName(parameter.name),
                    unit.empty() ? "" : absl::StrCat("(", unit, ")/s^0.5"),
                    parameter.drift->std_dev_per_sqrt_s, true, Kind::kDriftRate, states_++,
                    parameter.StandardDeviation()});
  }
  if (!UsesFilters(problem)) return;
  for (const MeasuredOutput& measured : problem.measured) {
    const auto column = model.FindOutput(measured.output);
    if (!column || !(measured.noise.absolute > 0)) continue;
    all_.push_back({NoiseName(measured.output), model.outputs[static_cast<size_t>(*column)].unit,
                    measured.noise.absolute, true, Kind::kNoise, *column, measured.noise.absolute});
  }
}

std::optional<int> SettableQuantities::Find(std::string_view name) const {
  for (int i = 0; i < size(); ++i) {
    if ((*this)[i].name == name) return i;
  }
  return std::nullopt;
}

std::vector<std::string> SettableQuantities::Names() const {
  std::vector<std::string> names;
  for (const Settable& settable : all_) names.push_back(settable.name);
  return names;
}

Vector SettableQuantities::Defaults() const {
  Vector defaults(size());
  for (int i = 0; i < size(); ++i) defaults[i] = (*this)[i].default_value;
  return defaults;
}

std::string SettableQuantities::Describe() const {
  std::vector<std::string> parts, inputs, outputs;
  for (const Settable& settable : all_) {
    const std::string channel = settable.name.substr(0, settable.name.rfind('.'));
    if (settable.kind == Kind::kParameter || settable.kind == Kind::kSpectralDensity ||
        settable.kind == Kind::kDriftRate || settable.kind == Kind::kNoise) {
      parts.push_back(settable.name);
    }
    if (settable.kind == Kind::kAmplitude) inputs.push_back(channel);
    if (settable.kind == Kind::kOutputGain) outputs.push_back(channel);
  }
  if (!inputs.empty()) {
    parts.push_back(
        absl::StrCat("{", absl::StrJoin(inputs, ", "), "}.{amplitude, gain, delay, offset}"));
  }
  if (!outputs.empty()) {
    parts.push_back(absl::StrCat("{", absl::StrJoin(outputs, ", "), "}.{gain, delay, offset}"));
  }
  return absl::StrJoin(parts, ", ");
}

void SettableQuantities::Fill(const Matrix& values, EnsembleSpecification& ensemble) const {
  const auto of_inputs = [&](Kind kind) {
    Matrix columns(values.rows(), inputs_);
    for (int i = 0; i < inputs_; ++i) columns.col(i) = values.col(OfInput(kind, i));
    return columns;
  };
  // The model's own outputs have channels; those that show what drifts are read as they are.
  const auto of_outputs = [&](Kind kind, double neutral) {
    Matrix columns = Matrix::Constant(values.rows(), std::ssize(ensemble.outputs), neutral);
    for (Eigen::Index c = 0; c < columns.cols(); ++c) {
      const int output = ensemble.outputs[static_cast<size_t>(c)];
      if (output < outputs_) columns.col(c) = values.col(OfOutput(kind, output));
    }
    return UnlessNeutral(columns, neutral);
  };
  ensemble.parameters = values.leftCols(parameters_);
  ensemble.amplitudes = of_inputs(Kind::kAmplitude).cwiseProduct(of_inputs(Kind::kInputGain));
  ensemble.input_delays_s = UnlessNeutral(of_inputs(Kind::kDelay), 0);
  ensemble.input_offsets = UnlessNeutral(of_inputs(Kind::kInputOffset), 0);
  ensemble.output_gains = of_outputs(Kind::kOutputGain, 1);
  ensemble.output_delays_s = of_outputs(Kind::kOutputDelay, 0);
  ensemble.output_offsets = of_outputs(Kind::kOutputOffset, 0);
  // What only filters use follows the quantities of the outputs.
  for (int i = OfOutput(Kind::kOutputGain, outputs_); i < size(); ++i) {
    const Settable& settable = (*this)[i];
    if (settable.kind == Kind::kNoise) {
      SetNoise(settable, values.col(i), ensemble);
      continue;
    }
    if (ensemble.process_noise.size() == 0) ensemble.process_noise.setZero(values.rows(), states_);
    auto noise = ensemble.process_noise.col(settable.column);
    noise = values.col(i);
    if (settable.kind == Kind::kDriftRate) noise = (noise / settable.unit_value).cwiseAbs2();
  }
}

}  // namespace polyest::internal
