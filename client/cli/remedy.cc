#include "client/cli/remedy.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>

#include "client/cli/number_format.h"
#include "core/estimator/posterior/residual_tests.h"
#include "proto/wire/convert/noise.h"
#include "proto/wire/convert/problem.h"

namespace polyest::internal {
namespace {

// Factors from a size to the bounds around it.
constexpr double kDensityMargin = 30;
constexpr double kRateMargin = 6;

// Digits of a size that nobody knows yet.
constexpr int kSizeDigits = 1;

std::vector<double> RoundedSizes(std::vector<double> sizes) {
  for (double& size : sizes) size = Rounded(size, kSizeDigits);
  return sizes;
}

bool IsWhite(const v1::MeasuredOutput::Noise& noise) {
  return !noise.correlation().auto_() && !noise.correlation().has_time_constant_s();
}

std::string NoiseParameter(const std::string& output) { return absl::StrCat(output, ".noise"); }

bool IsUncertain(const v1::Problem& problem, const std::string& name) {
  return std::ranges::any_of(problem.uncertain(),
                             [&](const auto& parameter) { return parameter.name() == name; });
}

// Returns χ² per sample of the output, 0 if it has none.
double ChiSquaredPerSample(const v1::Estimate& estimate, const std::string& output) {
  for (const v1::ChannelEstimate& channel : estimate.channels()) {
    if (channel.output() == output && channel.samples() > 0) {
      return channel.chi_squared() / static_cast<double>(channel.samples());
    }
  }
  return 0;
}

// Returns the standard deviation of the residuals where they are too large for the noise stated by
// `absolute` alone, else 0.
double LargerSize(const v1::MeasuredOutput& output, const v1::Estimate& estimate, bool filtered) {
  const v1::MeasuredOutput::Noise& noise = output.noise();
  const OutlierHandling outliers = ToOutlierHandling(noise).value_or(OutlierHandling::kNone);
  const double ratio = ChiSquaredPerSample(estimate, output.output());
  const bool is_absolute = noise.absolute() > 0 && !noise.unknown() && noise.relative() == 0 &&
                           noise.relative_to_max() == 0;
  return is_absolute && ratio >= ExcessRatio(outliers, filtered)
             ? Rounded(noise.absolute() * std::sqrt(ratio), 2)
             : 0;
}

// Adds correlated noise of all outputs whose noise is white. It stays white where residuals are.
void AddCorrelatedNoise(const v1::Problem& problem, const v1::Estimate& estimate,
                        std::vector<Remedy>& remedies) {
  Remedy remedy{Remedy::Kind::kCorrelatedNoise, {}, {}};
  const bool filtered = UsesFilters(problem);
  for (const v1::MeasuredOutput& output : problem.measured()) {
    if (!IsWhite(output.noise())) continue;
    remedy.names.push_back(output.output());
    remedy.sizes.push_back(LargerSize(output, estimate, filtered));
  }
  if (!remedy.names.empty()) remedies.push_back(remedy);
}

// Adds larger noise of the outputs whose residuals are larger than the noise stated.
void AddLargerNoise(const v1::Problem& problem, const v1::Estimate& estimate,
                    std::vector<Remedy>& remedies) {
  Remedy remedy{Remedy::Kind::kLargerNoise, {}, {}};
  const bool filtered = UsesFilters(problem);
  for (const v1::MeasuredOutput& output : problem.measured()) {
    const std::string name = NoiseParameter(output.output());
    const double size = LargerSize(output, estimate, filtered);
    if (size == 0 || IsUncertain(problem, name) || problem.fixed().contains(name)) continue;
    remedy.names.push_back(output.output());
    remedy.sizes.push_back(size);
  }
  if (!remedy.names.empty()) remedies.push_back(remedy);
}

void AddProcessNoise(const v1::Problem& problem, const std::vector<StateSpread>& states,
                     bool velocities, double duration_s, std::vector<Remedy>& remedies) {
  for (const StateSpread& state : states) {
    const bool has_noise = std::ranges::any_of(
        problem.process_noise(), [&](const auto& noise) { return noise.state() == state.state; });
    if (has_noise || state.is_velocity != velocities) continue;
    const double density = state.spread * state.spread / duration_s;
    remedies.push_back({Remedy::Kind::kProcessNoise,
                        {state.state},
                        RoundedSizes({1e-2 * density, density, 1e-4 * density})});
  }
}

void AddDrifts(const v1::Problem& problem, const v1::Estimate& estimate, double duration_s,
               std::vector<Remedy>& remedies) {
  for (const v1::UncertainParameter& parameter : problem.uncertain()) {
    if (parameter.has_drift() || parameter.per_run() || parameter.population()) continue;
    for (const v1::ParameterEstimate& p : estimate.parameters()) {
      if (p.name() != parameter.name() || !(p.prior_std_dev() > 0)) continue;
      const double rate = p.prior_std_dev() / std::sqrt(duration_s);
      remedies.push_back(
          {Remedy::Kind::kDrift, {p.name()}, RoundedSizes({1e-1 * rate, rate, 1e-2 * rate})});
    }
  }
}

v1::UncertainParameter& Named(v1::Problem& problem, const std::string& name) {
  return *std::ranges::find(*problem.mutable_uncertain(), name, &v1::UncertainParameter::name);
}

void Correlate(v1::Problem& problem, const Remedy& remedy) {
  for (v1::MeasuredOutput& output : *problem.mutable_measured()) {
    const auto named = std::ranges::find(remedy.names, output.output());
    if (named == remedy.names.end()) continue;
    const double size = remedy.sizes[static_cast<size_t>(named - remedy.names.begin())];
    v1::MeasuredOutput::Noise& noise = *output.mutable_noise();
    noise.mutable_correlation()->set_auto_(true);
    if (size > 0) noise.set_absolute(size);
  }
}

void Enlarge(v1::Problem& problem, const Remedy& remedy) {
  problem.set_likelihood(v1::Problem::PREDICTION_ERROR);
  for (size_t i = 0; i < remedy.names.size(); ++i) {
    v1::UncertainParameter& parameter = *problem.add_uncertain();
    parameter.set_name(NoiseParameter(remedy.names[i]));
    parameter.mutable_lognormal()->set_mean(remedy.sizes[i]);
    parameter.mutable_lognormal()->set_std_dev(remedy.sizes[i]);
  }
}

// Returns the message as JSON in one line, without fields that have their default value.
std::string ShortJson(const google::protobuf::Message& message) {
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(message, &json);
  return status.ok() ? json : "";
}

template <typename Messages>
std::string ListJson(const char* field, const Messages& messages) {
  return absl::StrCat("\"", field, "\": [",
                      absl::StrJoin(messages, ", ",
                                    [](std::string* out, const auto& message) {
                                      absl::StrAppend(out, ShortJson(message));
                                    }),
                      "]");
}

}  // namespace

std::vector<Remedy> ListRemedies(const v1::Problem& problem, const v1::Estimate& estimate,
                                 const std::vector<StateSpread>& states, double duration_s) {
  std::vector<Remedy> remedies;
  AddCorrelatedNoise(problem, estimate, remedies);
  AddLargerNoise(problem, estimate, remedies);
  if (!(duration_s > 0)) return remedies;
  AddProcessNoise(problem, states, true, duration_s, remedies);
  AddDrifts(problem, estimate, duration_s, remedies);
  AddProcessNoise(problem, states, false, duration_s, remedies);
  return remedies;
}

bool HasSize(const Remedy& remedy) {
  return remedy.kind == Remedy::Kind::kProcessNoise || remedy.kind == Remedy::Kind::kDrift;
}

v1::Problem WithKnownSize(v1::Problem problem, const Remedy& remedy, double size) {
  if (HasSize(remedy) && problem.likelihood() == v1::Problem::OUTPUT_ERROR) {
    problem.set_likelihood(v1::Problem::PREDICTION_ERROR);
  }
  switch (remedy.kind) {
    case Remedy::Kind::kCorrelatedNoise:
      Correlate(problem, remedy);
      break;
    case Remedy::Kind::kLargerNoise:
      Enlarge(problem, remedy);
      break;
    case Remedy::Kind::kProcessNoise: {
      v1::ProcessNoise& noise = *problem.add_process_noise();
      noise.set_state(remedy.names.front());
      noise.set_spectral_density(size);
      break;
    }
    case Remedy::Kind::kDrift:
      Named(problem, remedy.names.front())
          .mutable_drift()
          ->mutable_random_walk()
          ->set_std_dev_per_sqrt_s(size);
      break;
  }
  return problem;
}

v1::Problem WithUnknownSize(v1::Problem problem, const Remedy& remedy, double size) {
  problem = WithKnownSize(std::move(problem), remedy, size);
  const auto bound = [size](auto& unknown, double margin) {
    unknown.set_unknown(true);
    unknown.set_lower(Rounded(size / margin, kSizeDigits));
    unknown.set_upper(Rounded(size * margin, kSizeDigits));
  };
  if (remedy.kind == Remedy::Kind::kProcessNoise) {
    v1::ProcessNoise& noise = *problem.mutable_process_noise()->rbegin();
    noise.clear_spectral_density();
    bound(noise, kDensityMargin);
  } else if (remedy.kind == Remedy::Kind::kDrift) {
    v1::UncertainParameter::RandomWalk& walk =
        *Named(problem, remedy.names.front()).mutable_drift()->mutable_random_walk();
    walk.clear_std_dev_per_sqrt_s();
    bound(walk, kRateMargin);
  }
  return problem;
}

std::string RemedyText(const Remedy& remedy) {
  const std::string names = absl::StrJoin(remedy.names, ", ");
  switch (remedy.kind) {
    case Remedy::Kind::kCorrelatedNoise:
      return absl::StrCat("correlated noise of ", names);
    case Remedy::Kind::kLargerNoise:
      return absl::StrCat("larger noise of ", names);
    case Remedy::Kind::kProcessNoise:
      return absl::StrCat("process noise on ", names);
    case Remedy::Kind::kDrift:
      return absl::StrCat("drift of ", names);
  }
  return "";
}

std::vector<std::string> RemedyJson(const v1::Problem& remedied, const Remedy& remedy) {
  std::vector<std::string> fields;
  switch (remedy.kind) {
    case Remedy::Kind::kCorrelatedNoise:
      return {ListJson("measured", remedied.measured())};
    case Remedy::Kind::kProcessNoise:
      fields.push_back(ListJson("processNoise", remedied.process_noise()));
      break;
    case Remedy::Kind::kLargerNoise:
    case Remedy::Kind::kDrift:
      fields.push_back(ListJson("uncertain", remedied.uncertain()));
      break;
  }
  if (remedied.likelihood() == v1::Problem::PREDICTION_ERROR) {
    fields.push_back("\"likelihood\": \"PREDICTION_ERROR\"");
  }
  return fields;
}

}  // namespace polyest::internal
