#include "core/estimator/posterior/diagnosis.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>

#include "core/common/status.h"
#include "core/estimator/expansion/carry_over.h"
#include "core/estimator/posterior/residual_diagnosis.h"
#include "core/estimator/posterior/undersampling.h"
#include "core/estimator/record/suspicious_data.h"

namespace polyest::internal {
namespace {

constexpr double kAtBound = 1e-6;  // fraction of the width of Ω
// As kAtBound, for a correlated parameter: its score has no bound, and only approaches the
// parameter's.
constexpr double kNearBound = 1e-4;
// Conflict of data and prior, in standard deviations, from which on chance hardly explains it.
constexpr double kConflict = 4;
// Posterior's standard deviation in that of the prior: from where on the data say nothing of a
// bound, and up to where a posterior at a bound is one that would go on beyond it.
constexpr double kAsWide = 0.9;
constexpr double kPiledUp = 0.1;
// Maximum ratio of the posterior's and the curvature's standard deviations, in either direction.
constexpr double kGaussianRatio = 1.2;
constexpr size_t kFailuresNamed = 3;
constexpr std::string_view kByPosterior =
    "go by the posterior's own mean, standard deviation and interval";
constexpr std::string_view kByCurvature = "go by the curvature's, which is the wider";
constexpr std::string_view kReplaced = "what is reported is the posterior's";

void AddIdentifiability(const Findings& findings, const Estimate& estimate,
                        std::vector<Diagnostic>& diagnostics) {
  std::vector<std::string> names;
  for (const ParameterEstimate& parameter : estimate.parameters) {
    if (parameter.verdict == Verdict::kNotIdentified) names.push_back(parameter.name);
  }
  if (names.empty()) return;
  std::string message = absl::StrFormat(
      "the data say less than the prior about %s; what is reported there rests on the prior",
      absl::StrJoin(names, ", "));
  for (const TradeOff& trade_off : estimate.trade_offs) {
    absl::StrAppendFormat(
        &message, "; %s is known to %.2g %%, %s and %s separately only to %.2g %% and %.2g %%",
        trade_off.combination, 100 * trade_off.relative_std_dev, findings.NameOf(trade_off.first),
        findings.NameOf(trade_off.second), 100 * trade_off.first_alone,
        100 * trade_off.second_alone);
  }
  diagnostics.push_back({DiagnosticCode::kNotIdentified, std::move(message)});
}

// Returns < 0 if the estimate lies on the lower bound of parameter i, > 0 on the upper one, else 0.
// The marginal's own germ is examined because it has bounds even where the score of a correlated
// parameter has none.
int BoundReached(const Findings& findings, int i) {
  const Prior& prior = findings.problem->prior();
  const Germ germ(prior.parameters()[static_cast<size_t>(i)].germ);
  const double x = prior.MarginalGerm(i, prior.ToScores(findings.map_xi)[i]);
  const double width = germ.Upper() - germ.Lower();
  const double part = prior.germs()[static_cast<size_t>(i)] == germ ? kAtBound : kNearBound;
  const double near = part * (std::isfinite(width) ? width : 1);
  if (x - germ.Lower() < near) return -1;
  return germ.Upper() - x < near ? 1 : 0;
}

// Whether the prior alone puts the estimate at a bound: it is densest there, the data do not inform
// the parameter, and nothing contradicts their noise.
bool PriorAsksForBound(const Findings& findings, const Estimate& estimate, int i) {
  const Germ& germ = findings.problem->prior().germs()[static_cast<size_t>(i)];
  return (germ.Mode() == germ.Lower() || germ.Mode() == germ.Upper()) &&
         findings.expansion->noise().misfit == 1 &&
         estimate.parameters[static_cast<size_t>(i)].verdict == Verdict::kNotIdentified;
}

// Whether the posterior is about as wide as the prior: it then means nothing where it is densest.
bool IsAsWideAsPrior(const ParameterEstimate& parameter) {
  return parameter.posterior_std_dev > kAsWide * parameter.prior_std_dev;
}

void AddBounds(const Findings& findings, const Estimate& estimate,
               std::vector<Diagnostic>& diagnostics) {
  for (int i = 0; i < findings.problem->dimension(); ++i) {
    const int bound = BoundReached(findings, i);
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    if (bound == 0 || IsAsWideAsPrior(parameter) || PriorAsksForBound(findings, estimate, i)) {
      continue;
    }
    std::string message = absl::StrFormat("%s lies on the %s bound of its prior: the data ",
                                          findings.NameOf(i), bound < 0 ? "lower" : "upper");
    const bool piled_up = parameter.verdict == Verdict::kNotIdentified &&
                          parameter.posterior_std_dev < kPiledUp * parameter.prior_std_dev;
    if (findings.GoesByDraws(i) && !piled_up) {
      absl::StrAppendFormat(&message, "tell only that it is %s %.3g (97.5 %%)",
                            bound < 0 ? "below" : "above",
                            bound < 0 ? parameter.upper95 : parameter.lower95);
    } else {
      message += "ask for values beyond it";
    }
    diagnostics.push_back({DiagnosticCode::kAtPriorBound, std::move(message)});
  }
}

// Reports that data and prior contradict each other. A parameter on its bound is reported as such.
void AddPriorConflict(const Findings& findings, const Estimate& estimate,
                      std::vector<Diagnostic>& diagnostics) {
  bool any = false;
  for (int i = 0; i < findings.problem->dimension(); ++i) {
    const double conflict = findings.conflict.of_parameters[i];
    if (!(conflict > kConflict) || BoundReached(findings, i) != 0 ||
        estimate.parameters[static_cast<size_t>(i)].verdict == Verdict::kNotIdentified) {
      continue;
    }
    any = true;
    diagnostics.push_back(
        {DiagnosticCode::kPriorDataConflict,
         absl::StrFormat(
             "the data and the prior of %s differ by %.3g combined standard deviations; "
             "check its unit and its prior, and whether %s makes up for something that "
             "is wrong in the model",
             findings.NameOf(i), conflict, findings.NameOf(i))});
  }
  if (any || !(findings.conflict.of_all > kConflict)) return;
  diagnostics.push_back(
      {DiagnosticCode::kPriorDataConflict,
       absl::StrFormat("the parameters are together as improbable by their priors as a normal "
                       "variable beyond %.3g standard deviations, though none is on its own; check "
                       "the priors and their correlations",
                       findings.conflict.of_all)});
}

// Reports a posterior that differs from the curvature's Gaussian. Parameters that the data do not
// inform are skipped, because the reported values are then the prior's by definition. Where the
// reported standard deviation is the curvature's, the advice is to go by the wider of the two.
void AddNonGaussian(const Findings& findings, const Estimate& estimate,
                    std::vector<Diagnostic>& diagnostics) {
  std::vector<std::string> ratios;
  for (int i = 0; i < findings.problem->dimension(); ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    if (parameter.verdict == Verdict::kNotIdentified) continue;
    const bool replaced = findings.GoesByDraws(i);
    const double ratio =
        replaced ? findings.drawn_to_curvature[i] : parameter.posterior_std_dev / parameter.std_dev;
    if (ratio <= kGaussianRatio && ratio >= 1 / kGaussianRatio) continue;
    ratios.push_back(absl::StrFormat("that of %s is %.3g times as large; %s", parameter.name, ratio,
                                     replaced    ? kReplaced
                                     : ratio > 1 ? kByPosterior
                                                 : kByCurvature));
  }
  if (ratios.empty()) return;
  diagnostics.push_back(
      {DiagnosticCode::kNonGaussian,
       absl::StrFormat("the posterior's standard deviation is not what the curvature of the cost "
                       "says: %s",
                       absl::StrJoin(ratios, "; "))});
}

void AddFailures(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  const auto& failures = findings.expansion->failures();
  if (failures.empty()) return;
  std::string message = absl::StrFormat(
      "%d of %d trajectories could not be integrated and were "
      "left out: ",
      failures.size(), findings.expansion->points());
  for (size_t i = 0; i < std::min(failures.size(), kFailuresNamed); ++i) {
    absl::StrAppendFormat(&message, "%s%s", i == 0 ? "" : "; ",
                          DescribeFailure(failures[i], findings.problem->prior()));
  }
  if (failures.size() > kFailuresNamed) message += "; …";
  diagnostics.push_back({DiagnosticCode::kPointsFailed, message});
}

// Reports the pieces of a mixture with their weights.
void AddComponents(const Findings& findings, const Estimate& estimate,
                   std::vector<Diagnostic>& diagnostics) {
  if (estimate.components.empty()) return;
  std::vector<std::string> pieces;
  for (const ComponentEstimate& component : estimate.components) {
    std::vector<std::string> values;
    for (const ParameterEstimate& parameter : component.parameters) {
      values.push_back(absl::StrFormat("%s = %.6g", parameter.name, parameter.map));
    }
    pieces.push_back(
        absl::StrFormat("%.3g %% at %s", 100 * component.weight, absl::StrJoin(values, ", ")));
  }
  std::string message = absl::StrFormat("the posterior is in %d separated pieces: %s",
                                        pieces.size(), absl::StrJoin(pieces, "; "));
  if (findings.left_out > 0) {
    absl::StrAppendFormat(&message, "; there were more, left out with %.2g %%",
                          100 * findings.left_out);
  }
  diagnostics.push_back({DiagnosticCode::kMultipleMinima, std::move(message)});
}

// Returns the parameters' values as "k = 40.2, c = 0.2".
std::string PlaceOf(const Findings& findings, const Vector& theta) {
  std::vector<std::string> values;
  for (int i = 0; i < theta.size(); ++i) {
    values.push_back(absl::StrFormat("%s = %.6g", findings.NameOf(i), theta[i]));
  }
  return absl::StrJoin(values, ", ");
}

void AddMinima(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  if (!findings.other_minima.empty()) {
    std::vector<std::string> places;
    for (const Vector& theta : findings.other_minima) places.push_back(PlaceOf(findings, theta));
    diagnostics.push_back(
        {DiagnosticCode::kMultipleMinima,
         absl::StrFormat("beside that at %s the cost has other minima of comparable depth at %s",
                         PlaceOf(findings, findings.problem->prior().ToParameters(findings.map_xi)),
                         absl::StrJoin(places, " and at "))});
  }
  if (!findings.converged) {
    diagnostics.push_back({DiagnosticCode::kNotConverged,
                           absl::StrFormat("the minimizer gave up before it had converged: %s",
                                           findings.minimizer_reason)});
  }
  if (!findings.not_mixed.empty()) {
    diagnostics.push_back(
        {DiagnosticCode::kNotConverged,
         absl::StrFormat("the Markov chains have not mixed, and what they say of the posterior may "
                         "be wrong: %s; narrower priors of parameters that the data tell only in "
                         "combination would help",
                         findings.not_mixed)});
  }
}

std::string_view RemedyForInaccuracy(const ExpansionOptions& expansion) {
  if (!expansion.adaptive) return "raise expansion.order or let it be adaptive";
  if (expansion.order) return "raise expansion.order or leave it to \"AUTO\"";
  return "narrower priors or more informative data would let the expansion hold";
}

void AddInaccuracy(const Findings& findings, const Estimate& estimate,
                   std::vector<Diagnostic>& diagnostics) {
  const std::string_view remedy = RemedyForInaccuracy(findings.problem->problem().expansion);
  if (!findings.UsesData()) {
    diagnostics.push_back(
        {DiagnosticCode::kExpansionInaccurate,
         absl::StrFormat("no expansion of order %d follows the model where the data put the "
                         "parameters, so that the data could not be used; what is reported is "
                         "the prior; %s",
                         estimate.expansion.order, remedy)});
  } else if (findings.power < 1) {
    diagnostics.push_back(
        {DiagnosticCode::kExpansionInaccurate,
         absl::StrFormat(
             "the expansion of order %d differs from the model by %.3g times the noise; "
             "the uncertainty reported is that of the likelihood to the power %.2g, as "
             "far as the model's own trajectories confirm it; %s",
             estimate.expansion.order, estimate.expansion.residual_to_noise, findings.power,
             remedy)});
  } else if (findings.shift > kInaccurateShift && !findings.IntegrationPrevails() &&
             !findings.PopulationPrevails()) {
    const bool in_part = findings.inaccurate_weight < 0.995;
    const std::string place =
        in_part ? absl::StrFormat(" in %.2g %% of the posterior", 100 * findings.inaccurate_weight)
                : "";
    diagnostics.push_back(
        {DiagnosticCode::kExpansionInaccurate,
         absl::StrFormat(
             "the expansion of order %d differs from the model by %.3g times the noise; "
             "estimates may be off by %s%.3g standard deviations of the fit%s, by which the "
             "uncertainty has been widened%s; %s",
             estimate.expansion.order, estimate.expansion.residual_to_noise,
             in_part ? "up to " : "", findings.shift, place, in_part ? " there" : "", remedy)});
  }
}

std::string_view RemedyForIntegration(const Problem& problem) {
  if (!problem.expansion.adaptive || !problem.tolerance_follows_noise) {
    return "lower integration.relativeTolerance, or leave it and expansion.adaptive to their "
           "defaults";
  }
  return "it is lowered where the record's next window ends, but not below 1e-12, where only a "
         "shorter record helps";
}

void AddIntegrationError(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  if (!(findings.shift > kInaccurateShift) || !findings.IntegrationPrevails()) return;
  const Problem& problem = findings.problem->problem();
  diagnostics.push_back(
      {DiagnosticCode::kExpansionInaccurate,
       absl::StrFormat(
           "trajectories integrated with a tenth of integration.relativeTolerance = %.2g differ "
           "so much that the error of integration may put estimates off by %.3g standard "
           "deviations of the fit, by which the uncertainty has been widened; %s",
           problem.integration.relative_tolerance, findings.integration_shift,
           RemedyForIntegration(problem))});
}

void AddPopulation(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  if (!(findings.shift > kInaccurateShift) || !findings.PopulationPrevails()) return;
  diagnostics.push_back(
      {DiagnosticCode::kExpansionInaccurate,
       absl::StrFormat(
           "what the population keeps of ended runs leaves out so much of their data that "
           "estimates may be off by %.3g standard deviations of the fit, by which the uncertainty "
           "has been widened; more samples in each run, or a prior closer to the population, "
           "would leave out less",
           findings.population_shift)});
}

// Reports what the limit on the rows that are propagated again has put off.
void AddPostponed(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  const Postponed& postponed = findings.postponed;
  std::vector<std::string> parts;
  const auto add = [&parts](int64_t rows, const char* what) {
    if (rows > 0) parts.push_back(absl::StrFormat("since row %d %s", rows, what));
  };
  add(postponed.expansion, "the expansion has not followed the posterior");
  add(postponed.noise, "the noise has not been learned again");
  add(postponed.tolerance, "the integrators' tolerance has not been lowered");
  if (findings.CarriesError()) {
    parts.push_back(absl::StrFormat(
        "sums carried over may put estimates off by %.2g standard deviations of the fit, by which "
        "the uncertainty has been widened",
        findings.carried_shift));
  }
  if (parts.empty()) return;
  diagnostics.push_back(
      {DiagnosticCode::kReplayPostponed,
       absl::StrFormat(
           "expansion.maxReplayRowCount = %d keeps the record from being propagated again: "
           "%s; %sraise it, or narrow the priors so that the expansion moves early",
           findings.problem->problem().expansion.max_replay_row_count.value_or(0),
           absl::StrJoin(parts, ", "),
           postponed.any() ? "no parameter is called IDENTIFIED until then; " : "")});
}

void AddEdge(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  if (!findings.leans) return;
  diagnostics.push_back(
      {DiagnosticCode::kExpansionInaccurate,
       absl::StrFormat(
           "the posterior goes on beyond the region in which the expansion is made, where "
           "it is not looked at; %s",
           findings.problem->problem().expansion.adaptive
               ? "more samples let the region move there"
               : "let expansion.adaptive be true, or widen the prior")});
}

void AddRegularization(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  if (findings.regularization_not_determined.empty()) return;
  diagnostics.push_back(
      {DiagnosticCode::kRegularizationNotDetermined,
       absl::StrFormat("α² is 1, as Bayes' rule has it, for the rule asked for does not choose: %s",
                       findings.regularization_not_determined)});
}

}  // namespace

double Findings::WideningForShift() const {
  return shift > kInaccurateShift || CarriesError() ? std::sqrt(1 + shift * shift) : 1;
}

bool Findings::CarriesError() const {
  return problem->problem().expansion.max_replay_row_count && carried_shift > kMaxCarriedShift;
}

const std::string& Findings::NameOf(int parameter) const {
  return problem->prior().parameters()[static_cast<size_t>(parameter)].name;
}

absl::StatusOr<std::vector<Diagnostic>> Diagnose(const Findings& findings, const Estimate& estimate,
                                                 const Stop& stop) {
  std::vector<Diagnostic> diagnostics;
  AddIdentifiability(findings, estimate, diagnostics);
  AddUndersampling(findings, estimate, stop, diagnostics);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  AddInaccuracy(findings, estimate, diagnostics);
  AddIntegrationError(findings, diagnostics);
  AddPopulation(findings, diagnostics);
  AddPostponed(findings, diagnostics);
  AddEdge(findings, diagnostics);
  DiagnoseResiduals(findings, estimate, diagnostics);
  AddBounds(findings, estimate, diagnostics);
  AddPriorConflict(findings, estimate, diagnostics);
  AddNonGaussian(findings, estimate, diagnostics);
  AddComponents(findings, estimate, diagnostics);
  AddMinima(findings, diagnostics);
  AddRegularization(findings, diagnostics);
  AddFailures(findings, diagnostics);
  for (std::string& warning : WarnOfSuspiciousData(*findings.problem, findings.record->facts(),
                                                   FitsOf(findings, estimate))) {
    diagnostics.push_back({DiagnosticCode::kSuspiciousData, std::move(warning)});
  }
  return diagnostics;
}

}  // namespace polyest::internal
