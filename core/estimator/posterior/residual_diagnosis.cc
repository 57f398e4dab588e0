#include "core/estimator/posterior/residual_diagnosis.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/posterior/remedies.h"
#include "core/estimator/posterior/residual_tests.h"

namespace polyest::internal {
namespace {

// For a correct model, χ² has the mean ν, the degrees of freedom, and the standard deviation
// √(2ν). Residuals that are too small are reported when χ² is below ν both by many standard
// deviations and by TooSmallRatio.
constexpr double kMisfitDeviations = 6;
// Relative noise whose bias, if it is taken of the samples, is mentioned.
constexpr double kLargeRelativeNoise = 0.05;
// A record of fewer time constants than five hardly knows them: that of a random walk, which has
// none, is mostly found to be a fifth of the record or more.
constexpr double kMaxTimeConstant = 0.2;
constexpr double kNoticeable = 1.05;  // factor of a standard deviation that is worth a word

// Returns what has become of the uncertainty because residuals or windows contradict the estimate.
std::string WideningText(const Findings& findings) {
  const Vector& widening = findings.windows.widening;
  Eigen::Index widest = 0;
  const double factor = widening.size() > 0 ? widening.maxCoeff(&widest) : 1;
  if (factor < kNoticeable) return "windows of the record ask for no wider uncertainty";
  return absl::StrFormat(
      "standard deviations and intervals have been widened, that of %s %.2g times",
      findings.NameOf(static_cast<int>(widest)), factor);
}

// Whether the channel's samples are rounded to steps beside which their noise is small, also where
// noise stated of up to a step makes up for that.
bool IsCoarse(const Findings& findings, const std::vector<ChannelFit>& fits, size_t c) {
  if (c >= fits.size()) return false;
  const double smaller = std::min(fits[c].noise, fits[c].residual);
  const auto coarse =
      FindCoarseSteps(findings.record->facts().columns()[c], {smaller, true, fits[c].residual});
  return coarse && fits[c].noise < coarse->step;
}

// A learned scale is skipped: it was learned from χ², which is therefore no test of it.
void AddMisfit(const Findings& findings, const Estimate& estimate,
               std::vector<Diagnostic>& diagnostics) {
  const std::vector<ChannelFit> fits = FitsOf(findings, estimate);
  for (size_t c = 0; c < estimate.channels.size(); ++c) {
    const ChannelEstimate& channel = estimate.channels[c];
    const NoiseModel& noise = findings.problem->problem().measured[c].noise;
    if (noise.unknown) continue;
    const double degrees = findings.degrees[c];
    const bool filtered = findings.problem->uses_filters();
    if (ExceedsNoise(channel, degrees, noise.outliers, filtered)) {
      diagnostics.push_back(
          {DiagnosticCode::kModelMisfit,
           absl::StrFormat("output %s: residuals are %.3g times the noise assumed; model, noise or "
                           "prior is wrong; %s%s",
                           channel.output, ResidualToNoise(channel, degrees),
                           WideningText(findings), AdviseProcessNoise(*findings.problem))});
    }
    // Residuals of a signal that stays within one step are small, but tell nothing of the noise.
    if (IsCoarse(findings, fits, c)) continue;
    // The expansion's own error reduces χ² by as much as it reduces the samples' weights.
    const double expected = degrees - findings.expansion->Discount(static_cast<int>(c));
    if (channel.chi_squared < expected / TooSmallRatio(noise.outliers, filtered) &&
        channel.chi_squared < expected - kMisfitDeviations * std::sqrt(2 * degrees)) {
      diagnostics.push_back(
          {DiagnosticCode::kModelMisfit,
           absl::StrFormat(
               "output %s: residuals are only %.3g times the noise assumed, which makes "
               "the uncertainty reported too large; give the noise its own size%s",
               channel.output, ResidualToNoise(channel, degrees),
               filtered ? "" : " or let it be unknown")});
    }
  }
}

// Reports errors that last for many samples, where successive residuals hardly show them.
void AddSlowCorrelation(const Findings& findings, size_t c, const ChannelEstimate& channel,
                        std::vector<Diagnostic>& diagnostics) {
  const bool white =
      findings.problem->problem().measured[c].noise.correlation == NoiseCorrelation::kWhite;
  diagnostics.push_back(
      {white ? DiagnosticCode::kCorrelatedResiduals : DiagnosticCode::kModelMisfit,
       absl::StrFormat(
           "output %s: sums of %d successive residuals vary %.2g times as much as those "
           "of independent ones%s, so that errors last for many samples; %s; %s",
           channel.output, ResidualBlocks::kLength, channel.variance_ratio,
           white ? "" : " even after the noise's own correlation is taken out",
           WideningText(findings),
           white ? "let the noise have a correlation ({\"auto\": true}), or improve the "
                   "model"
                 : "model or noise is wrong")});
}

// Reports residuals that are correlated in time, if the noise is assumed white or differently
// correlated.
void AddCorrelation(const Findings& findings, const Estimate& estimate,
                    std::vector<Diagnostic>& diagnostics) {
  if (findings.record->channels().empty()) return;  // no row yet
  for (size_t c = 0; c < estimate.channels.size(); ++c) {
    const ChannelEstimate& channel = estimate.channels[c];
    const double correlation = channel.lag1_correlation;
    if (!AreCorrelated(channel, findings.record->channels()[c].Runs())) {
      if (AreSlowlyCorrelated(channel)) AddSlowCorrelation(findings, c, channel, diagnostics);
      continue;
    }
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
                           "samples tell no more than %.0f independent ones; %s; %s, or improve "
                           "the model",
                           channel.output, correlation, channel.samples, channel.effective_samples,
                           WideningText(findings),
                           findings.problem->uses_filters()
                               ? "give other states process noise, too"
                               : "let the noise have a correlation ({\"auto\": true})")});
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
  const bool kept = findings.expansion->absorbed().KeptRelative(static_cast<int>(c)) != nullptr;
  if (relative > kLargeRelativeNoise && !noise.of_prediction && !kept) {
    return absl::StrFormat(
        "its relative noise of %.3g %% is taken of the samples and not of the predictions, which "
        "makes predictions too small by about %.2g %%",
        100 * relative, 200 * relative * relative);
  }
  if (!model.unknown && !correlation) return "";
  if (!noise.learned) {
    const int64_t least = MinSamplesForNoise(*findings.problem);
    const std::string why =
        model.unknown && channel.largest <= 0
            ? "all samples are 0, from which its noise cannot be learned"
        : channel.samples < least
            ? absl::StrFormat("too few samples (%d), fewer than %d, to learn its noise from",
                              channel.samples, least)
            : absl::StrFormat(
                  "its noise has not been learned from its %d samples yet, but will be with more "
                  "rows",
                  channel.samples);
    return absl::StrCat(why, "; it is taken to be ",
                        model.unknown ? "as large as the signal"
                                      : "white, and if it is not, the uncertainty is too small");
  }
  if (!correlation || noise.grid.empty()) return "";
  if (noise.time_constant_s < kMaxTimeConstant * channel.longest_run_s) return "";
  const std::string part =
      noise.white_share > 0
          ? absl::StrFormat("a share of %.3g of its variance", 1 - noise.white_share)
          : "its noise";
  return absl::StrFormat(
      "%s is correlated over %.3g s or longer, a large part of the record of "
      "%.3g s, so that its time constant and its size are hardly known",
      part, noise.time_constant_s, channel.longest_run_s);
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
           "model or an input lacks what changes%s",
           findings.NameOf(found.parameter),
           DescribeChange(findings, found.parameter, found.first, name_runs),
           DescribeChange(findings, found.parameter, found.second, name_runs), found.separation,
           AdviseDrift(*findings.problem, found.parameter))});
}

// Reports scores of windows that scatter more than the noise explains.
void AddDisagreement(const Findings& findings, std::vector<Diagnostic>& diagnostics) {
  if (!findings.windows.Disagree()) return;
  diagnostics.push_back(
      {DiagnosticCode::kWindowsDisagree,
       absl::StrFormat("windows of the record disagree %.2g times as much as the noise explains "
                       "(1.1 to 1.7 is usual); model or noise is wrong; %s%s",
                       findings.windows.robust.disagreement, WideningText(findings),
                       AdviseProcessNoise(*findings.problem))});
}

// Returns whether the residuals are too large for the noise, or too much alike.
bool ContradictNoise(const Findings& findings, const ChannelEstimate& channel, size_t c) {
  const NoiseModel& noise = findings.problem->problem().measured[c].noise;
  const bool large = !noise.unknown && ExceedsNoise(channel, findings.degrees[c], noise.outliers,
                                                    findings.problem->uses_filters());
  const bool alike =
      channel.lag1_correlation > 0 && AreCorrelated(channel, findings.record->channels()[c].Runs());
  return large || alike || AreSlowlyCorrelated(channel);
}

}  // namespace

std::vector<ChannelFit> FitsOf(const Findings& findings, const Estimate& estimate) {
  std::vector<ChannelFit> fits;
  if (findings.record->channels().empty()) return fits;
  for (size_t c = 0; c < estimate.channels.size(); ++c) {
    const ChannelEstimate& channel = estimate.channels[c];
    const double mean_square =
        channel.chi_squared / static_cast<double>(std::max<int64_t>(1, channel.samples));
    fits.push_back({.noise = channel.noise_std_dev,
                    .residual = channel.noise_std_dev * std::sqrt(mean_square),
                    .degrees = findings.degrees[c],
                    .white = channel.noise_time_constant_s == 0,
                    .contradicts = ContradictNoise(findings, channel, c)});
  }
  return fits;
}

void DiagnoseResiduals(const Findings& findings, const Estimate& estimate,
                       std::vector<Diagnostic>& diagnostics) {
  AddMisfit(findings, estimate, diagnostics);
  AddCorrelation(findings, estimate, diagnostics);
  AddInconsistency(findings, diagnostics);
  AddDisagreement(findings, diagnostics);
  AddUnlearnedNoise(findings, estimate, diagnostics);
}

}  // namespace polyest::internal
