#include "core/estimator/problem_fingerprint.h"

#include <zlib.h>

#include <sstream>
#include <variant>

#include "core/chaos/germ.h"
#include "core/estimator/state_archive.h"

namespace polyest::internal {
namespace {

using Archive = cereal::PortableBinaryOutputArchive;

template <class Choice>
requires std::is_enum_v<Choice>
int Number(Choice choice) { return static_cast<int>(choice); }

void Add(Archive& archive, const std::vector<Quantity>& quantities) {
  archive(static_cast<int64_t>(quantities.size()));
  for (const Quantity& quantity : quantities) {
    archive(quantity.name, quantity.unit, quantity.default_value);
  }
}

void Add(Archive& archive, const ModelDescription& model) {
  archive(model.name, model.equations, model.identity);
  for (const auto* quantities : {&model.states, &model.parameters, &model.inputs, &model.outputs}) {
    Add(archive, *quantities);
  }
}

void Add(Archive& archive, const UncertainParameter& parameter) {
  const Germ germ(parameter.germ);
  archive(parameter.name, Number(germ.family()), germ.first_shape(), germ.second_shape(),
          parameter.location, parameter.scale, Number(parameter.map), parameter.per_run,
          parameter.drift.has_value());
  const RandomWalk walk = parameter.drift.value_or(RandomWalk());
  archive(walk.std_dev_per_sqrt_s, walk.unknown, walk.lower, walk.upper);
  // Their values follow from those of the parameter that has the population.
  if (parameter.population) archive(std::string("population"));
}

void Add(Archive& archive, const ConstantInput& input) { archive(input.amplitude); }
void Add(Archive& archive, const StepInput& input) { archive(input.amplitude, input.time_s); }
void Add(Archive& archive, const SinusoidInput& input) {
  archive(input.amplitude, input.frequency_hz, input.phase_rad);
}
void Add(Archive& archive, const ChirpInput& input) {
  archive(input.amplitude, input.start_frequency_hz, input.end_frequency_hz, input.start_s,
          input.duration_s, input.phase_rad);
}
void Add(Archive& archive, const HalfSineBumpInput& input) {
  archive(input.amplitude, input.start_s, input.duration_s);
}
void Add(Archive& archive, const TableInput& input) {
  archive(input.amplitude, input.time_s, input.value, Number(input.interpolation));
}
void Add(Archive& archive, const StreamedInput& input) {
  archive(input.amplitude, Number(input.interpolation));
}

void Add(Archive& archive, const NamedInput& input) {
  archive(input.name, static_cast<int64_t>(input.signal.index()));
  std::visit([&archive](const auto& signal) { Add(archive, signal); }, input.signal);
}

void Add(Archive& archive, const MeasuredOutput& measured) {
  const NoiseModel& noise = measured.noise;
  archive(measured.output, noise.absolute, noise.relative, noise.relative_to_max, noise.unknown,
          Number(noise.correlation), noise.time_constant_s, noise.white_share,
          Number(noise.outliers), noise.full_scale, noise.least);
}

void Add(Archive& archive, const ProcessNoise& noise) {
  archive(noise.state, noise.spectral_density, noise.unknown, noise.lower, noise.upper);
}

void AddOptions(Archive& archive, const Problem& problem) {
  const ExpansionOptions& expansion = problem.expansion;
  const IntegrationOptions& integration = problem.integration;
  archive(expansion.order, expansion.hyperbolic_exponent, expansion.points_per_term,
          Number(expansion.points), expansion.adaptive, problem.regularization,
          Number(problem.regularization_mode), Number(integration.method),
          integration.relative_tolerance, integration.max_steps,
          integration.samples_between_checkpoints, problem.tolerance_follows_noise,
          expansion.max_replay_row_count);
}

template <class Element>
void AddEach(Archive& archive, const std::vector<Element>& elements) {
  archive(static_cast<int64_t>(elements.size()));
  for (const Element& element : elements) Add(archive, element);
}

}  // namespace

uint32_t FingerprintOf(const Problem& problem) {
  std::ostringstream stream;
  {
    Archive archive(stream);
    Add(archive, problem.model->description());
    archive(static_cast<int64_t>(problem.fixed.size()));
    for (const auto& [name, value] : problem.fixed) archive(name, value);
    archive(static_cast<int64_t>(problem.derived.size()));
    for (const auto& [name, text] : problem.derived) archive(name, text);
    AddEach(archive, problem.uncertain);
    archive(static_cast<int64_t>(problem.correlations.size()));
    for (const Correlation& one : problem.correlations) {
      archive(one.first, one.second, one.coefficient);
    }
    AddEach(archive, problem.inputs);
    AddEach(archive, problem.measured);
    AddOptions(archive, problem);
    archive(problem.use_when);
    archive(problem.likelihood ? Number(*problem.likelihood) : -1);
    AddEach(archive, problem.process_noise);
  }
  const std::string bytes = std::move(stream).str();
  return static_cast<uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace polyest::internal
