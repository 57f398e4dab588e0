#include "core/estimator/posterior/diagnosis.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>

#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/posterior/residual_tests.h"
#include "core/estimator/posterior/undersampling.h"
#include "core/estimator/record/suspicious_data.h"

namespace polyest::internal {
namespace {

// For a correct model, χ² has mean N and standard deviation √(2N). Residuals that are too small,
// which is the less dangerous error, are reported when χ² is below N both by many standard
// deviations and by a third.
constexpr double kMisfitDeviations = 6;
constexpr double kTooSmallRatio = 1.5;
// Relative noise whose bias, if it is taken of the samples, is mentioned.
constexpr double kLargeRelativeNoise = 0.05;
// A record of fewer time constants than five hardly knows them: that of a random walk, which has
// none, is mostly found to be a fifth of the record or more.
constexpr double kMaxTimeConstant = 0.2;
constexpr double kAtBound = 1e-6;  // fraction of the width of Ω
// As kAtBound, for a correlated parameter: its score has no bound, and only approaches the
// parameter's.
constexpr double kNearBound = 1e-4;
// As kAtBound, where residuals contradict the noise.
constexpr double kNearBoundByMisfit = 1e-2;
// Maximum ratio of the posterior's and the curvature's standard deviations, in either direction.
constexpr double kGaussianRatio = 1.2;
constexpr size_t kFailuresNamed = 3;
constexpr std::string_view kByPosterior =
    "the posterior's own mean, standard deviation and interval";
constexpr std::string_view kByCurvature = "the curvature's, which is the wider";
constexpr double kNoticeable = 1.05;  // factor of a standard deviation that is worth a word

const std::string& Name(const Findings& findings, int i) {
  return findings.problem->prior().parameters()[static_cast<size_t>(i)].name;
}

void AddIdentifiability(const Findings& findings, const Estimate& estimate,
                        std::vector<Diagnostic>& diagnostics) {
  std::vector<std::string> names;
  for (const ParameterEstimate& parameter : estimate.parameters) {
    if (parameter.verdict == Verdict::kNotIdentified) names.push_back(parameter.name);
  }
  if (names.empty()) return;
  std::string message = absl::StrFormat(
      "the data say less than the prior about %s; what is reported there is the prior's",
      absl::StrJoin(names, ", "));
  for (const TradeOff& trade_off : estimate.trade_offs) {
    absl::StrAppendFormat(
        &message, "; %s is known to %.2g %%, %s and %s separately only to %.2g %% and %.2g %%",
        trade_off.combination, 100 * trade_off.relative_std_dev, Name(findings, trade_off.first),
        Name(findings, trade_off.second), 100 * trade_off.first_alone,
        100 * trade_off.second_alone);
  }
  diagnostics.push_back({DiagnosticCode::kNotIdentified, std::move(message)});
  for (int i = 0; i < findings.problem->dimension(); ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    if (parameter.verdict != Verdict::kNotIdentified) continue;
    const SamplingInformation information =
        InformationBetweenSamples(*findings.problem, findings.expansion->noise(),
                                  findings.record->beginning(), findings.map_xi, i);
    if (!information.undersampled) continue;
    diagnostics.push_back(
        {DiagnosticCode::kUndersampled,
         absl::StrFormat("the samples miss what %s changes: as many samples between them would "
                         "know it %.0f times better than the prior (in variance); sample at other "
                         "times, or more often",
                         parameter.name, information.between)});
  }
}

// Returns what has become of the uncertainty because residuals or windows contradict the estimate.
std::string WideningText(const Findings& findings) {
  const Vector& widening = findings.windows.widening;
  Eigen::Index widest = 0;
  const double factor = widening.size() > 0 ? widening.maxCoeff(&widest) : 1;
  if (factor < kNoticeable) return "windows of the record ask for no wider uncertainty";
  return absl::StrFormat(
      "standard deviations and intervals have been widened, that of %s %.2g times",
      Name(findings, static_cast<int>(widest)), factor);
}

// A learned scale is skipped: it was learned from χ², which is therefore no test of it.
void AddMisfit(const Findings& findings, const Estimate& estimate,
               std::vector<Diagnostic>& diagnostics) {
  for (size_t c = 0; c < estimate.channels.size(); ++c) {
    const ChannelEstimate& channel = estimate.channels[c];
    if (findings.problem->problem().measured[c].noise.unknown) continue;
    const auto samples = static_cast<double>(channel.samples);
    if (ExceedsNoise(channel, findings.problem->problem().measured[c].noise.outliers)) {
      diagnostics.push_back(
          {DiagnosticCode::kModelMisfit,
           absl::StrFormat("output %s: residuals are %.3g times the noise assumed; model, noise or "
                           "prior is wrong; %s",
                           channel.output, std::sqrt(channel.chi_squared / samples),
                           WideningText(findings))});
    }
    // The expansion's own error reduces χ² by as much as it reduces the samples' weights.
    const double expected = samples - findings.expansion->Discount(static_cast<int>(c));
    if (channel.chi_squared < expected / kTooSmallRatio &&
        channel.chi_squared < expected - kMisfitDeviations * std::sqrt(2 * samples)) {
      diagnostics.push_back(
          {DiagnosticCode::kModelMisfit,
           absl::StrFormat(
               "output %s: residuals are only %.3g times the noise assumed, which makes "
               "the uncertainty reported too large; give the noise its own size or let "
               "it be unknown",
               channel.output, std::sqrt(channel.chi_squared / samples))});
    }
  }
}

// Reports residuals that are correlated in time, if the noise is assumed white or differently
// correlated.
void AddCorrelation(const Findings& findings, const Estimate& estimate,
                    std::vector<Diagnostic>& diagnostics) {
  if (findings.record->channels().empty()) return;  // no row yet
  for (size_t c = 0; c < estimate.channels.size(); ++c) {
    const ChannelEstimate& channel = estimate.channels[c];
    const double correlation = channel.lag1_correlation;
    if (!AreCorrelated(channel, findings.record->channels()[c].Runs())) continue;
    const NoiseModel& noise = findings.problem->problem().measured[c].noise;
    if (noise.correlation != NoiseCorrelation::kWhite) {
      diagnostics.push_back(
          {DiagnosticCode::kModelMisfit,
           absl::StrFormat("output %s: successive residuals are correlated (%.2f) even after the "
                           "noise's own correlation is taken out; model or noise is wrong",
                           channel.output, correlation)});
    } else if (correlation > 0) {
      diagnostics.push_back(
          {DiagnosticCode::kCorrelatedResiduals,
           absl::StrFormat("output %s: successive residuals are correlated (%.2f), so that %d "
                           "samples tell no more than %.0f independent ones; %s; let the noise "
                           "have a correlation ({\"auto\": true}), or improve the model",
                           channel.output, correlation, channel.samples, channel.effective_samples,
                           WideningText(findings))});
    } else {
      diagnostics.push_back(
          {DiagnosticCode::kCorrelatedResiduals,
           absl::StrFormat(
               "output %s: successive residuals alternate (correlation %.2f); the noise "
               "is not white",
               channel.output, correlation)});
    }
  }
}

// Returns why a channel's noise has not been learned; empty if it has or need not be.
std::string ReasonNotLearned(const Findings& findings, size_t c) {
  const NoiseModel& model = findings.problem->problem().measured[c].noise;
  const bool correlation = model.correlation == NoiseCorrelation::kUnknown;
  const RecordSummary::Channel& channel = findings.record->channels()[c];
  if (channel.samples == 0) return "";
  const ChannelNoise& noise = findings.expansion->noise().channels[c];
  const double relative = noise.scale * model.relative;
  if (relative > kLargeRelativeNoise && !noise.of_prediction) {
    return absl::StrFormat(
        "its relative noise of %.3g %% is taken of the samples and not of the predictions, which "
        "makes predictions too small by about %.2g %%",
        100 * relative, 200 * relative * relative);
  }
  if (!model.unknown && !correlation) return "";
  if (!noise.learned) {
    const std::string why =
        model.unknown && channel.largest <= 0
            ? "all samples are 0, from which its noise cannot be learned"
            : absl::StrFormat("too few samples (%d), fewer than %d, to learn its noise from",
                              channel.samples, MinSamplesForNoise(findings.problem->dimension()));
    return absl::StrCat(why, "; it is taken to be ",
                        model.unknown ? "as large as the signal"
                                      : "white, and if it is not, the uncertainty is too small");
  }
  if (!correlation || noise.grid.empty()) return "";
  if (noise.time_constant_s < kMaxTimeConstant * channel.longest_run_s) return "";
  return absl::StrFormat(
      "its noise is correlated over %.3g s or longer, a large part of the record of "
      "%.3g s, so that its time constant and its size are hardly known",
      noise.time_constant_s, channel.longest_run_s);
}

void AddUnlearnedNoise(const Findings& findings, const Estimate& estimate,
                       std::vector<Diagnostic>& diagnostics) {
  for (size_t c = 0; c < estimate.channels.size(); ++c) {
    if (findings.record->channels().empty()) return;
    const std::string reason = ReasonNotLearned(findings, c);
    if (reason.empty()) continue;
    diagnostics.push_back({DiagnosticCode::kNoiseNotLearned,
                           absl::StrFormat("output %s: %s", estimate.channels[c].output, reason)});
  }
}

// Returns < 0 if the estimate lies on the lower bound of parameter i, > 0 on the upper one, else 0.
// The marginal's own germ is examined because it has bounds even where the score of a correlated
// parameter has none.
int BoundReached(const Findings& findings, int i) {
  const Prior& prior = findings.problem->prior();
  const Germ germ(prior.parameters()[static_cast<size_t>(i)].germ);
  const double x = prior.MarginalGerm(i, prior.ToScores(findings.map_xi)[i]);
  const double width = germ.Upper() - germ.Lower();
  double part = prior.germs()[static_cast<size_t>(i)] == germ ? kAtBound : kNearBound;
  if (findings.expansion->noise().misfit > 1) part = std::max(part, kNearBoundByMisfit);
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

void AddBounds(const Findings& findings, const Estimate& estimate,
               std::vector<Diagnostic>& diagnostics) {
  for (int i = 0; i < findings.problem->dimension(); ++i) {
    const int bound = BoundReached(findings, i);
    if (bound == 0 || PriorAsksForBound(findings, estimate, i)) continue;
    diagnostics.push_back({DiagnosticCode::kAtPriorBound,
                           absl::StrFormat("%s lies on the %s bound of its prior: the data ask for "
                                           "values beyond it",
                                           Name(findings, i), bound < 0 ? "lower" : "upper")});
  }
}

// Returns "0.93 ± 0.01 (t = 0 to 10 s)", the value of parameter i in a window.
std::string DescribeChange(const Findings& findings, int i, const WindowChange& window,
                           bool name_runs) {
  const WindowParameter changed = ChangedParameter(findings.problem->prior(), findings.map_xi, i,
                                                   window.change, window.std_dev);
  const WindowSpan& span = window.span;
  const std::string first = name_runs ? absl::StrFormat("run %d, ", span.first_run) : "";
  const std::string last =
      span.last_run != span.first_run ? absl::StrFormat("run %d, ", span.last_run) : "";
  return absl::StrFormat("%.6g ± %.2g (%st = %.6g to %s%.6g s)", changed.value, changed.std_dev,
                         first, span.start_s, last, span.end_s);
}

// Reports a parameter that differs between windows of the record.
void AddInconsistency(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  if (!findings.windows.inconsistency) return;
  const Inconsistency& found = *findings.windows.inconsistency;
  const bool name_runs = found.second.span.last_run > 0;
  diagnostics.push_back(
      {DiagnosticCode::kInconsistentOverTime,
       absl::StrFormat(
           "%s is not constant over the record: %s and %s, %.3g standard deviations apart; the "
           "model or an input lacks what changes",
           Name(findings, found.parameter),
           DescribeChange(findings, found.parameter, found.first, name_runs),
           DescribeChange(findings, found.parameter, found.second, name_runs), found.separation)});
}

// Reports scores of windows that scatter more than the noise explains.
void AddDisagreement(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  if (!findings.windows.Disagree()) return;
  diagnostics.push_back(
      {DiagnosticCode::kWindowsDisagree,
       absl::StrFormat("windows of the record disagree %.2g times as much as the noise explains "
                       "(1.1 to 1.7 is usual); model or noise is wrong; %s",
                       findings.windows.robust.disagreement, WideningText(findings))});
}

// Reports a posterior that differs from the curvature's Gaussian. Parameters that the data do not
// inform are skipped, because the reported values are then the prior's by definition. The advice is
// always to go by the wider of the two.
void AddNonGaussian(const Estimate& estimate, std::vector<Diagnostic>& diagnostics) {
  std::vector<std::string> ratios;
  for (const ParameterEstimate& parameter : estimate.parameters) {
    if (parameter.verdict == Verdict::kNotIdentified) continue;
    const double ratio = parameter.posterior_std_dev / parameter.std_dev;
    if (ratio <= kGaussianRatio && ratio >= 1 / kGaussianRatio) continue;
    ratios.push_back(absl::StrFormat("that of %s is %.3g times as large; go by %s", parameter.name,
                                     ratio, ratio > 1 ? kByPosterior : kByCurvature));
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

void AddMinima(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  if (!findings.other_minima.empty()) {
    std::vector<std::string> places;
    for (const Vector& theta : findings.other_minima) {
      std::vector<std::string> values;
      for (int i = 0; i < theta.size(); ++i) {
        values.push_back(absl::StrFormat("%s = %.6g", Name(findings, i), theta[i]));
      }
      places.push_back(absl::StrJoin(values, ", "));
    }
    diagnostics.push_back({DiagnosticCode::kMultipleMinima,
                           absl::StrFormat("the cost has other minima of comparable depth at %s",
                                           absl::StrJoin(places, " and at "))});
  }
  if (!findings.converged) {
    diagnostics.push_back({DiagnosticCode::kNotConverged,
                           absl::StrFormat("the minimizer gave up before it had converged: %s",
                                           findings.minimizer_reason)});
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
  if (findings.power < 1) {
    diagnostics.push_back(
        {DiagnosticCode::kExpansionInaccurate,
         absl::StrFormat(
             "the expansion of order %d differs from the model by %.3g times the noise; "
             "the uncertainty reported is that of the likelihood to the power %.2g, as "
             "far as the model's own trajectories confirm it; %s",
             estimate.expansion.order, estimate.expansion.residual_to_noise, findings.power,
             remedy)});
  } else if (findings.shift > kInaccurateShift) {
    diagnostics.push_back(
        {DiagnosticCode::kExpansionInaccurate,
         absl::StrFormat(
             "the expansion of order %d differs from the model by %.3g times the noise; "
             "estimates may be off by %.3g standard deviations of the fit, by which the "
             "uncertainty has been widened; %s",
             estimate.expansion.order, estimate.expansion.residual_to_noise, findings.shift,
             remedy)});
  }
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

std::vector<Diagnostic> Diagnose(const Findings& findings, const Estimate& estimate) {
  std::vector<Diagnostic> diagnostics;
  AddIdentifiability(findings, estimate, diagnostics);
  AddInaccuracy(findings, estimate, diagnostics);
  AddEdge(findings, diagnostics);
  AddMisfit(findings, estimate, diagnostics);
  AddCorrelation(findings, estimate, diagnostics);
  AddInconsistency(findings, diagnostics);
  AddDisagreement(findings, diagnostics);
  AddUnlearnedNoise(findings, estimate, diagnostics);
  AddBounds(findings, estimate, diagnostics);
  AddNonGaussian(estimate, diagnostics);
  AddComponents(findings, estimate, diagnostics);
  AddMinima(findings, diagnostics);
  AddRegularization(findings, diagnostics);
  AddFailures(findings, diagnostics);
  for (std::string& warning : WarnOfSuspiciousData(*findings.problem, findings.record->facts())) {
    diagnostics.push_back({DiagnosticCode::kSuspiciousData, std::move(warning)});
  }
  return diagnostics;
}

}  // namespace polyest::internal
