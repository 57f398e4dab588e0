#include "core/estimator/problem/logarithmic_germs.h"

#include <absl/strings/match.h>

#include <algorithm>
#include <cmath>

#include "core/chaos/germ.h"
#include "core/estimator/problem/drifting_model.h"
#include "core/estimator/problem/process_noise.h"
#include "core/estimator/problem/settable_quantities.h"

namespace polyest::internal {
namespace {

bool IsOfLogarithm(const UncertainParameter& parameter) {
  return parameter.map == ParameterMap::kExponential;
}

// Whether it is a quantity of the model, unlike the size of a noise or of a drift.
bool IsOfModel(const UncertainParameter& parameter) {
  return parameter.part == PopulationPart::kNone &&
         !absl::EndsWith(parameter.name, NoiseName("")) &&
         !absl::EndsWith(parameter.name, DriftName("")) &&
         !absl::StartsWith(parameter.name, SpectralDensityName(""));
}

bool MayChangeGerm(const UncertainParameter& parameter,
                   const std::vector<Correlation>& correlations) {
  return parameter.germ.family == GermFamily::kUniform && !IsOfLogarithm(parameter) &&
         !parameter.population && !parameter.drift && IsOfModel(parameter) &&
         std::ranges::none_of(correlations, [&](const Correlation& correlation) {
           return correlation.first == parameter.name || correlation.second == parameter.name;
         });
}

void ChangeGerm(UncertainParameter& parameter) {
  const double lower = parameter.location - parameter.scale;
  const double upper = parameter.location + parameter.scale;
  if (!(lower > 0)) return;
  const double rate = 0.5 * std::log(upper / lower);
  if (!(rate > 0 && rate <= Germ::kMaxRate)) return;
  parameter.location = 0.5 * (std::log(lower) + std::log(upper));
  parameter.scale = rate;
  parameter.germ = Germ::Exponential(rate);
  parameter.map = ParameterMap::kExponential;
}

}  // namespace

std::vector<UncertainParameter> ByLogarithms(std::vector<UncertainParameter> parameters,
                                             const std::vector<Correlation>& correlations) {
  const bool mixed = std::ranges::any_of(parameters, [](const UncertainParameter& parameter) {
    return IsOfLogarithm(parameter) && IsOfModel(parameter) && !parameter.drift;
  });
  if (!mixed) return parameters;
  for (UncertainParameter& parameter : parameters) {
    if (MayChangeGerm(parameter, correlations)) ChangeGerm(parameter);
  }
  return parameters;
}

}  // namespace polyest::internal
