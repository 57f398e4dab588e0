// What a mixture component does about its noise: it learns what is unknown, notices residuals that
// contradict what is stated, and lets the integrators' tolerance follow.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/carry_over.h"
#include "core/estimator/expansion/control_trajectories.h"
#include "core/estimator/expansion/replay.h"
#include "core/estimator/expansion/rescaled.h"
#include "core/estimator/posterior/misfit.h"
#include "core/estimator/posterior/mixture_component.h"
#include "core/estimator/posterior/noise_learning.h"

namespace polyest::internal {
namespace {

// A sample whose expansion residual exceeds this fraction of the noise ends the window before it.
constexpr double kResidualToNoise = 0.1;
// The integration error must stay so far below the noise that over a long record it does not
// accumulate to a noticeable share of the posterior's standard deviation. The error is the same at
// every sample's parameters while the noise averages out, so N samples together see errors smaller
// than one sample does by √N: relative tolerance ≤ kTolerancePerNoise × noise ÷ signal ÷ √N,
// counting no fewer than kMinSamplesCounted. The tolerance is checked where windows end, and never
// goes below what double precision supports.
constexpr double kTolerancePerNoise = 1e-4;
constexpr double kMinSamplesCounted = 100;
constexpr double kMinTolerance = 1e-12;
// Where control trajectories show that the estimate may be off by more standard deviations than the
// first, the tolerance is set so that it is off by the second: errors of integration are
// proportional to the tolerance. An error of the phase moves the estimate by N^2.5, which a window
// doubles, so that up to its end the estimate is off by a tenth.
constexpr double kMaxIntegrationShift = 0.05;
constexpr double kAimedIntegrationShift = 0.005;
// Maximum number of revisions of the noise at the end of a window. A scale that falls from the
// signal's size to 10⁻⁶ of it takes 20 halvings.
constexpr int kMaxRevisions = 24;

// Maximum number of revisions of the misfit at the end of a window after the first. While the
// cost's minimum lies beyond the region, each lets the region move on.
constexpr int kMaxMisfitRevisions = 12;
// Factor by which the misfit falls while the cost's minimum lies beyond the region.
constexpr double kMisfitStep = 4;

// Returns the shift that the control trajectories show; 0 without any. They are compared with the
// noise as stated, since errors of integration may be what the misfit consists of.
double ShiftOfControls(const RegionalExpansion& expansion, double regularization) {
  if (expansion.controls() == 0) return 0;
  Cost cost = expansion.MakeCost(regularization);
  cost.set_power(1);
  return IntegrationShift(expansion, cost);
}

// Returns the tolerance that the noise asks for, the present one if that is enough.
double ToleranceForNoise(double present, double noise_to_signal, int64_t count) {
  const double samples = std::max(kMinSamplesCounted, static_cast<double>(count));
  const double needed = kTolerancePerNoise * noise_to_signal / std::sqrt(samples);
  // Half of the needed tolerance is taken, so that a slowly falling ratio does not cause frequent
  // replays: four times as many samples come before the next.
  return needed < present ? 0.5 * needed : present;
}

// Returns the tolerance that a shift of the controls asks for, the present one if it is small.
double ToleranceForControls(double present, double shift) {
  return shift > kMaxIntegrationShift ? present * kAimedIntegrationShift / shift : present;
}

}  // namespace

// The residual of the expansion from which on it is too coarse, in units of the stated noise.
double MixtureComponent::CoarseResidual() const {
  return kResidualToNoise * std::sqrt(expansion_->noise().misfit);
}

// Returns whether the region must first move on to the minimum of the cost with the noise as
// stated. The misfit then falls step by step, which lets the posterior go there.
bool MixtureComponent::ReviseMisfit(const Stop& stop) {
  // A stop may come before the minimum is found; the same step is then taken again.
  if (!row_end_.revised_from) row_end_.revised_from = expansion_->noise().misfit;
  const double before = *row_end_.revised_from;
  const MisfitFound found = FindMisfit(problem_, *expansion_, stop);
  const double revised =
      found.at_edge ? std::clamp(before / kMisfitStep, 1.0, found.ratio) : found.ratio;
  expansion_->set_misfit(std::max(revised, tempered_.misfit));
  return found.at_edge && expansion_->noise().misfit < before;
}

// Returns true when the expansion has moved. After a stop it goes on where it was left.
absl::StatusOr<bool> MixtureComponent::MoveWithMisfit(const Stop& stop) {
  for (; row_end_.revisions <= kMaxMisfitRevisions && !must_divide(); ++row_end_.revisions) {
    if (!row_end_.goes_on) {
      const bool goes_on = ReviseMisfit(stop);
      POLYEST_RETURN_IF_ERROR(stop.Check());
      row_end_.goes_on = goes_on;
    }
    if (row_end_.revisions > 0 && !*row_end_.goes_on) break;
    POLYEST_ASSIGN_OR_RETURN(const bool tightened, TightenTolerance(stop));
    row_end_.moved = row_end_.moved || tightened;
    POLYEST_ASSIGN_OR_RETURN(const bool settled, RestoreAccuracy(stop));
    row_end_.moved = row_end_.moved || settled;
    row_end_.goes_on.reset();
    row_end_.revised_from.reset();
    if (!settled) break;
  }
  return std::exchange(row_end_, {}).moved;
}

// After the rows of a tempered beginning lets its misfit fall to 1.
absl::Status MixtureComponent::WithdrawTempering(const Stop& stop) {
  while (tempered_.misfit > 1 && taken_ >= tempered_.rows && !must_divide()) {
    const TemperedBeginning before = tempered_;
    tempered_.misfit = std::max(1.0, before.misfit / kMisfitStep);
    const absl::Status settled = MoveWithMisfit(stop).status();
    if (settled.ok()) continue;
    tempered_ = before;
    return settled;
  }
  return absl::OkStatus();
}

// Raises scales that are not learned yet with the signal, so the first samples have little weight
// however large they are. Returns true when the record was replayed.
absl::StatusOr<bool> MixtureComponent::RaiseUnlearnedScales(const RowBlock& block, int row,
                                                            const Stop& stop) {
  if (!learns_noise_) return false;
  std::optional<LearnedNoise> raised;  // set only when needed: this runs for every sample
  const std::vector<ChannelNoise>& present = expansion_->noise().channels;
  const size_t width = block.width();
  for (size_t c = 0; c < present.size(); ++c) {
    const double shape = block.noise[static_cast<size_t>(row) * present.size() + c];
    if (!problem_.problem().measured[c].noise.unknown || present[c].learned || shape <= 0) continue;
    const double value = std::abs(block.values[static_cast<size_t>(row) * width + c]);
    const double predicted = expansion_->Magnitude(row, static_cast<int>(c));
    const std::optional<double> scale =
        UnlearnedScale(summary_, c, value / shape, predicted / shape, present[c].scale);
    if (!scale) continue;
    if (!raised) raised = expansion_->noise();
    raised->channels[c].scale = *scale;
  }
  if (!raised) return false;
  // The sample must not be taken with a noise that is far too small.
  allowance_.ExemptAt(taken_);
  return Reweigh(*std::move(raised), stop);
}

// Returns whether the record was reweighed with another noise. Smaller noise requires a more
// accurate expansion.
absl::StatusOr<bool> MixtureComponent::LearnNoise(const Stop& stop) {
  for (; row_end_.reweighed < kMaxRevisions; ++row_end_.reweighed) {
    if (!row_end_.settles) {
      POLYEST_RETURN_IF_ERROR(stop.Check());
      std::optional<LearnedNoise> revised =
          ReviseNoise(problem_, *expansion_, summary_, particles_, stop);
      POLYEST_RETURN_IF_ERROR(stop.Check());
      if (!revised) {
        postponed_.noise = 0;
        break;
      }
      POLYEST_ASSIGN_OR_RETURN(const bool reweighed, Reweigh(*std::move(revised), stop));
      if (!reweighed) break;
      row_end_.settles = true;
    }
    POLYEST_RETURN_IF_ERROR(RenewEndedRuns(stop));
    if (adaptive()) {
      POLYEST_RETURN_IF_ERROR(TightenTolerance(stop).status());
      POLYEST_RETURN_IF_ERROR(RestoreAccuracy(stop).status());
    }
    row_end_.settles = false;
  }
  return row_end_.reweighed > 0;
}

// Goes on from the state that the expansion keeps, if the allowance lets the rows since then be
// propagated again and the sums tell what they would be.
absl::StatusOr<std::unique_ptr<RegionalExpansion>> MixtureComponent::RescaledTo(LearnedNoise noise,
                                                                                const Stop& stop) {
  const int64_t cost = RowsToCarryOver(*expansion_, taken_) / 2;
  if (!allowance_.Allows(taken_, cost)) {
    return InfeasibleError("too many rows would be propagated again");
  }
  const double max_shift = IsReplayWithheld() ? kMaxShiftUnderLimit : kMaxCarriedShift;
  auto rescaled =
      Rescaled(problem_, *expansion_, std::move(noise), *store_, taken_, threads_, stop, max_shift);
  if (rescaled.ok()) allowance_.Use(taken_, cost);
  return rescaled;
}

// Propagates the record so far again, if the allowance lets it.
absl::StatusOr<std::unique_ptr<RegionalExpansion>> MixtureComponent::ReplayedWith(
    const LearnedNoise& noise, const Stop& stop) {
  if (IsReplayWithheld()) {
    return InfeasibleError("too many rows would be propagated again");
  }
  auto replayed = Replay(problem_, expansion_->design(), noise.ForNewExpansion(), *store_, taken_,
                         threads_, stop);
  if (replayed.ok()) allowance_.Use(taken_, taken_);
  return replayed;
}

// Weighs the samples of the record so far by `noise`; propagates it again unless its sums tell what
// they would be. Returns false, and the present noise stays, if that is put off.
absl::StatusOr<bool> MixtureComponent::Reweigh(LearnedNoise noise, const Stop& stop) {
  auto reweighed = RescaledTo(noise, stop);
  if (IsInfeasible(reweighed.status())) {
    if (IsReplayWithheld()) {
      if (postponed_.noise == 0) postponed_.noise = taken_;
      return false;
    }
    reweighed = ReplayedWith(noise, stop);
  }
  POLYEST_RETURN_IF_ERROR(reweighed.status());
  Adopt(*std::move(reweighed));
  postponed_.noise = 0;
  return true;
}

// Returns the present expansion with the problem's new tolerance. If the trajectories so far are
// accurate enough, only those to come are integrated with it.
absl::StatusOr<std::unique_ptr<RegionalExpansion>> MixtureComponent::WithNewTolerance(
    double shift, const Stop& stop) {
  const LearnedNoise& noise = expansion_->noise();
  if (shift <= kMaxCarriedShift) {
    auto going_on = RescaledTo(noise, stop);
    if (!IsInfeasible(going_on.status())) return going_on;
  }
  return ReplayedWith(noise, stop);
}

// Returns true when the noise or the control trajectories required a tighter tolerance, with which
// the expansion has been made again.
absl::StatusOr<bool> MixtureComponent::TightenTolerance(const Stop& stop) {
  if (!problem_.problem().tolerance_follows_noise) return false;
  const double present = problem_.problem().integration.relative_tolerance;
  const double for_noise =
      ToleranceForNoise(present, summary_.NoiseToSignal(expansion_->noise()), summary_.samples());
  const double shift = ShiftOfControls(*expansion_, problem_.problem().regularization);
  const double tolerance =
      std::max(kMinTolerance, std::min(for_noise, ToleranceForControls(present, shift)));
  if (tolerance >= present || expansion_->StepsExactly()) {
    postponed_.tolerance = 0;
    return false;
  }
  const bool withheld = IsReplayWithheld();
  problem_.set_relative_tolerance(tolerance);
  auto replayed = WithNewTolerance(shift, stop);
  if (!replayed.ok()) {
    problem_.set_relative_tolerance(present);
    if (!IsInfeasible(replayed.status())) return replayed.status();
    // The present expansion stays.
    if (withheld && postponed_.tolerance == 0) postponed_.tolerance = taken_;
    return false;
  }
  postponed_.tolerance = 0;
  Adopt(*std::move(replayed));
  return true;
}

}  // namespace polyest::internal
