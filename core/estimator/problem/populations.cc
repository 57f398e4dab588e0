#include "core/estimator/problem/populations.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/bayes/population_cost.h"
#include "core/chaos/germ.h"
#include "core/common/field_error.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Whether the population is normal itself, with a mean and a spread in the quantity's unit.
bool IsOfNormals(const UncertainParameter& member) {
  return member.germ.family == GermFamily::kNormal && member.map == ParameterMap::kAffine;
}

UncertainParameter MeanOf(const UncertainParameter& member) {
  UncertainParameter mean = member;
  mean.name += IsOfNormals(member) ? ".mean" : ".median";
  mean.per_run = mean.population = false;
  mean.part = PopulationPart::kMean;
  return mean;
}

// Standard deviations of the logarithm of the spread from its median, beyond which it is not
// looked for: 6 in 10⁷ of its prior.
constexpr double kFarthestSpread = 5;

// A score's standard deviation of 1 is one of `scale` for a normal germ: of the quantity, or of its
// logarithm.
UncertainParameter SpreadOf(const UncertainParameter& member) {
  const double unit = member.germ.family == GermFamily::kNormal ? member.scale : 1;
  UncertainParameter spread;
  spread.name = member.name + ".spread";
  spread.germ = Germ::TruncatedNormal(-kFarthestSpread, kFarthestSpread);
  spread.location = std::log(PopulationCost::kMedianSpread * unit);
  spread.scale = PopulationCost::kLogDeviation;
  spread.map = ParameterMap::kExponential;
  spread.part = PopulationPart::kSpread;
  return spread;
}

bool IsNameOfPart(const std::string& name, const std::string& member) {
  return name == member + ".mean" || name == member + ".median" || name == member + ".spread";
}

absl::Status ValidateCorrelations(const Problem& problem, const UncertainParameter& member) {
  for (size_t k = 0; k < problem.correlations.size(); ++k) {
    for (const std::string& name :
         {problem.correlations[k].first, problem.correlations[k].second}) {
      if (name != member.name && !IsNameOfPart(name, member.name)) continue;
      return InvalidField({"correlations", k},
                          absl::StrFormat("%s has a population and must not be correlated", name));
    }
  }
  return absl::OkStatus();
}

absl::Status ValidatePopulation(const Problem& problem, size_t i) {
  const UncertainParameter& member = problem.uncertain[i];
  const FieldPath field{"uncertain", i, "population"};
  if (!member.per_run) {
    return InvalidField(field,
                        absl::StrFormat("%s needs perRun: a population is one of values that "
                                        "differ from run to run",
                                        member.name));
  }
  for (const UncertainParameter& other : problem.uncertain) {
    if (other.part == PopulationPart::kNone && IsNameOfPart(other.name, member.name)) {
      return InvalidField(field, absl::StrFormat("%s is another parameter's name", other.name));
    }
  }
  if (!problem.expansion.adaptive) {
    return InvalidField("expansion.adaptive", "false excludes a population of runs");
  }
  if (problem.regularization != 1 || problem.regularization_mode != RegularizationMode::kFixed) {
    return InvalidField("regularization",
                        "must be 1 with a population of runs, whose own spread weighs their prior");
  }
  return ValidateCorrelations(problem, member);
}

}  // namespace

std::string UnitOfPart(PopulationPart part, const UncertainParameter& member,
                       const std::string& unit) {
  return part == PopulationPart::kSpread && !IsOfNormals(member) ? "" : unit;
}

std::vector<UncertainParameter> WithPopulations(std::vector<UncertainParameter> given) {
  const bool complete =
      std::ranges::any_of(given, [](const auto& one) { return one.part != PopulationPart::kNone; });
  const auto member = std::ranges::find(given, true, &UncertainParameter::population);
  if (complete || member == given.end()) return given;
  const UncertainParameter mean = MeanOf(*member), spread = SpreadOf(*member);
  given.push_back(mean);
  given.push_back(spread);
  return given;
}

absl::Status ValidatePopulations(const Problem& problem) {
  const UncertainParameter* first = nullptr;
  for (size_t i = 0; i < problem.uncertain.size(); ++i) {
    const UncertainParameter& parameter = problem.uncertain[i];
    if (!parameter.population) continue;
    if (first != nullptr) {
      return InvalidField(
          {"uncertain", i, "population"},
          absl::StrFormat("%s has one already; a problem has one at most", first->name));
    }
    first = &parameter;
    POLYEST_RETURN_IF_ERROR(ValidatePopulation(problem, i));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
