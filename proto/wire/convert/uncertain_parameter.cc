#include "proto/wire/convert/uncertain_parameter.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/common/field_error.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// A number that a message lacks is 0.
absl::Status RequireStdDev(const char* family, double std_dev) {
  if (std_dev != 0) return absl::OkStatus();
  return InvalidField({family, "std_dev"}, "is missing, or 0; it must be > 0");
}

absl::StatusOr<UncertainParameter> ToTruncatedNormal(
    const std::string& name, const v1::UncertainParameter::TruncatedNormalPrior& prior) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!prior.has_lower() && !prior.has_upper()) {
    return InvalidField("truncated_normal", "lower or upper must be given");
  }
  POLYEST_RETURN_IF_ERROR(RequireStdDev("truncated_normal", prior.std_dev()));
  return UncertainParameter::TruncatedNormal(name, prior.mean(), prior.std_dev(),
                                             prior.has_lower() ? prior.lower() : -kInfinity,
                                             prior.has_upper() ? prior.upper() : kInfinity);
}

// Returns the run of which `name` is the name of `parameter`, as 2 of x_0[2] and x_0; nothing if it
// is none.
std::optional<int> RunOfName(absl::string_view name, absl::string_view parameter) {
  int run = 0;
  if (!absl::ConsumePrefix(&name, parameter) || !absl::ConsumePrefix(&name, "[") ||
      !absl::ConsumeSuffix(&name, "]") || !absl::SimpleAtoi(name, &run) || run < 0) {
    return std::nullopt;
  }
  // Other ways to write the number, such as 02, are no name of a run.
  return absl::StrCat(run) == name ? std::optional(run) : std::nullopt;
}

}  // namespace

absl::StatusOr<UncertainParameter> ToPrior(const v1::UncertainParameter& parameter) {
  const std::string& name = parameter.name();
  switch (parameter.prior_case()) {
    case v1::UncertainParameter::kUniform: {
      const auto& prior = parameter.uniform();
      return UncertainParameter::Uniform(name, prior.lower(), prior.upper());
    }
    case v1::UncertainParameter::kNormal: {
      const auto& prior = parameter.normal();
      POLYEST_RETURN_IF_ERROR(RequireStdDev("normal", prior.std_dev()));
      return UncertainParameter::Normal(name, prior.mean(), prior.std_dev());
    }
    case v1::UncertainParameter::kBeta: {
      const auto& prior = parameter.beta();
      return UncertainParameter::Beta(name, prior.alpha(), prior.beta(), prior.lower(),
                                      prior.upper());
    }
    case v1::UncertainParameter::kGamma: {
      const auto& prior = parameter.gamma();
      return UncertainParameter::Gamma(name, prior.shape(), prior.scale(), prior.shift());
    }
    case v1::UncertainParameter::kLognormal: {
      const auto& prior = parameter.lognormal();
      POLYEST_RETURN_IF_ERROR(RequireStdDev("lognormal", prior.std_dev()));
      return UncertainParameter::Lognormal(name, prior.mean(), prior.std_dev());
    }
    case v1::UncertainParameter::kTruncatedNormal:
      return ToTruncatedNormal(name, parameter.truncated_normal());
    case v1::UncertainParameter::PRIOR_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError(absl::StrFormat(
      "%s needs a prior: uniform, normal, beta, gamma, lognormal or truncatedNormal",
      name.empty() ? "the parameter" : name));
}

absl::StatusOr<std::optional<RandomWalk>> ToDrift(const v1::UncertainParameter& parameter) {
  if (!parameter.has_drift()) return std::nullopt;
  if (!parameter.drift().has_random_walk()) {
    return InvalidField("drift", "needs a kind: {\"randomWalk\": {\"stdDevPerSqrtS\": 0.1}}");
  }
  const auto& walk = parameter.drift().random_walk();
  return RandomWalk{.std_dev_per_sqrt_s = walk.std_dev_per_sqrt_s(),
                    .unknown = walk.unknown(),
                    .lower = walk.lower(),
                    .upper = walk.upper()};
}

std::vector<absl::Status> CheckNamesOfRuns(const v1::Problem& problem) {
  std::vector<absl::Status> refusals;
  for (int i = 0; i < problem.uncertain_size(); ++i) {
    // Two parameters of each run with different names never share one in a run.
    if (problem.uncertain(i).per_run()) continue;
    const std::string& name = problem.uncertain(i).name();
    for (const v1::UncertainParameter& other : problem.uncertain()) {
      const auto run = RunOfName(name, other.name());
      if (!other.per_run() || !run) continue;
      refusals.push_back(InvalidField(
          {"uncertain", i},
          absl::StrFormat("%s is also the name of %s in run %d; one of them must be fixed, or %s "
                          "must do without perRun",
                          name, other.name(), *run, other.name())));
    }
  }
  return refusals;
}

}  // namespace polyest::internal
