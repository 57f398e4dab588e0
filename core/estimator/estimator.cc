#include "core/estimator/estimator.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/common/status.h"
#include "core/estimator/assessment.h"
#include "core/estimator/memory_store.h"
#include "core/estimator/noise_learning.h"
#include "core/estimator/reexpansion.h"
#include "core/estimator/sample_checks.h"

namespace polyest {
namespace {

constexpr int64_t kBlockRows = 64;
// A sample whose expansion residual passes this part of the noise ends the window before it.
constexpr double kResidualToNoise = 0.1;
// Where a window ends the expansion is compared with the model: it is settled anew when the
// posterior's means may be off by this many of its standard deviations.
constexpr double kMostShift = 0.1;
constexpr double kWindowGrowth = 1.3;
// The integration error must stay so far below the noise that it does not add up over a long
// record to a share of the posterior's standard deviation: relative tolerance ≤ this × noise ÷
// signal, looked at where windows end; never tighter than double precision bears.
constexpr double kTolerancePerNoise = 1e-5;
constexpr double kTightestTolerance = 1e-12;
// After a settlement that did not help, this part of the record so far is taken with its discount
// before the next one is tried.
constexpr int64_t kPatience = 8;
constexpr int kMostSettlementsAtRow = 4;
// Of the noise, where a window ends. A scale that falls from the signal's size to 10⁻⁶ of it takes
// 20 halvings.
constexpr int kMostRevisions = 24;
// By how much a scale not learned yet exceeds the largest sample.
constexpr double kAboveSignal = 2;

}  // namespace

class Estimator::Implementation {
 public:
  Implementation(ResolvedProblem problem, EstimatorOptions options)
      : problem_(std::move(problem)),
        threads_(options.threads),
        store_(options.store ? std::move(options.store) : std::make_shared<MemoryStore>()),
        checks_(problem_),
        learns_noise_(LearnsNoise(problem_.problem())),
        particles_(0, problem_.dimension()) {}

  absl::Status Begin() {
    POLYEST_ASSIGN_OR_RETURN(ExpansionDesign design, DesignForPrior(problem_));
    POLYEST_ASSIGN_OR_RETURN(
        expansion_, RegionalExpansion::Make(problem_, std::move(design),
                                            NoiseToBeginWith(problem_.problem()), threads_));
    return absl::OkStatus();
  }

  const ResolvedProblem& problem() const { return problem_; }
  int64_t rows_appended() const { return store_->rows(); }
  int64_t rows_processed() const { return processed_; }

  absl::Status Append(const Samples& samples);
  absl::Status Process(const Stop& stop);
  absl::StatusOr<Estimate> CurrentEstimate(const Stop& stop) const;
  absl::StatusOr<Posterior> CurrentPosterior(const PosteriorOptions& options,
                                             const Stop& stop) const;
  absl::StatusOr<CostProfiles> CurrentProfiles(const ProfileOptions& options,
                                               const Stop& stop) const;

 private:
  bool adaptive() const { return problem_.problem().expansion.adaptive; }
  bool learns_noise() const { return learns_noise_; }
  bool WindowEnds() const { return (adaptive() || learns_noise()) && processed_ >= window_end_; }
  int64_t SettledRows() const;
  AssessmentRequest RequestAssessment() const;
  absl::Status Recover(const Stop& stop);
  absl::StatusOr<bool> AbsorbBlock(const RowBlock& block, const Stop& stop);
  absl::StatusOr<bool> SettleBefore(bool short_of_trajectories, const Stop& stop);
  absl::StatusOr<bool> SettleAfterWindow(const Stop& stop);
  absl::StatusOr<bool> SettleIfInaccurate(const Stop& stop);
  absl::StatusOr<bool> RaiseUnlearnedScales(const RowBlock& block, int row, const Stop& stop);
  absl::StatusOr<bool> LearnNoise(const Stop& stop);
  absl::Status TakeAnew(LearnedNoise noise, const Stop& stop);
  absl::StatusOr<bool> Settle(const Stop& stop);
  absl::StatusOr<bool> TightenTolerance(const Stop& stop);

  ResolvedProblem problem_;
  int threads_;
  std::shared_ptr<SampleStore> store_;
  SampleChecks checks_;
  bool learns_noise_;
  std::unique_ptr<RegionalExpansion> expansion_;
  bool broken_ = false;  // a stop left the expansion between two rows
  Matrix particles_;     // of the last settlement, germ coordinates
  int64_t processed_ = 0;
  int64_t window_end_ = 2;
  int64_t patient_until_ = 0;  // rows before this one are taken whatever their residual
  int64_t settled_row_ = -1;
  int settlements_at_row_ = 0;
  uint64_t settlements_ = 0;
  int reexpansions_ = 0;
  int64_t abandoned_rows_ = 0;  // propagated by expansions given up since
  RecordSummary summary_;
};

absl::Status Estimator::Implementation::Append(const Samples& samples) {
  POLYEST_ASSIGN_OR_RETURN(const CheckedSamples checked, checks_.Check(samples));
  POLYEST_RETURN_IF_ERROR(store_->Append(checked));
  checks_.Accept(checked);
  return absl::OkStatus();
}

absl::Status Estimator::Implementation::Process(const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(Recover(stop));
  // A window's end that an earlier stop left open.
  if (WindowEnds()) POLYEST_RETURN_IF_ERROR(SettleAfterWindow(stop).status());
  RowBlock block;
  const int64_t settled = SettledRows();
  while (processed_ < settled) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    const int64_t count = std::min(kBlockRows, settled - processed_);
    POLYEST_RETURN_IF_ERROR(
        ReadWithRowsAhead(*store_, processed_, count, problem_.knots_ahead(), block));
    broken_ = true;
    POLYEST_RETURN_IF_ERROR(expansion_->Propagate(block, stop));
    POLYEST_ASSIGN_OR_RETURN(const bool through, AbsorbBlock(block, stop));
    if (through) broken_ = false;
  }
  return absl::OkStatus();
}

// Rows up to which the streamed inputs are settled, whatever rows may follow.
int64_t Estimator::Implementation::SettledRows() const {
  const RecordPosition& last = checks_.position();
  if (last.run_ended) return last.rows;
  return last.rows - std::min<int64_t>(problem_.knots_ahead(), last.rows_in_run);
}

// After a stop in the middle of a block: the same expansion, propagated again up to the last row
// taken.
absl::Status Estimator::Implementation::Recover(const Stop& stop) {
  if (!broken_) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(expansion_, Replay(problem_, expansion_->design(), expansion_->noise(),
                                              *store_, processed_, threads_, stop));
  broken_ = false;
  return absl::OkStatus();
}

// False when the expansion moved and the rest of the block must be propagated again.
absl::StatusOr<bool> Estimator::Implementation::AbsorbBlock(const RowBlock& block,
                                                            const Stop& stop) {
  for (int row = 0; row < block.count(); ++row) {
    POLYEST_ASSIGN_OR_RETURN(const bool raised, RaiseUnlearnedScales(block, row, stop));
    if (raised) return false;
    const bool short_of_trajectories = row == expansion_->fitted_rows();
    const bool coarse = !short_of_trajectories && processed_ >= patient_until_ &&
                        expansion_->ResidualToNoise(row) > kResidualToNoise;
    if (short_of_trajectories || (adaptive() && coarse)) {
      POLYEST_ASSIGN_OR_RETURN(const bool moved, SettleBefore(short_of_trajectories, stop));
      if (moved) return false;
    }
    expansion_->Absorb(row);
    summary_.Add(block, row, problem_.channels());
    ++processed_;
    if (WindowEnds()) {
      POLYEST_ASSIGN_OR_RETURN(const bool moved, SettleAfterWindow(stop));
      if (moved) return false;
    }
  }
  return true;
}

// The next row is too coarse for the present expansion, or too few trajectories reach it.
absl::StatusOr<bool> Estimator::Implementation::SettleBefore(bool short_of_trajectories,
                                                             const Stop& stop) {
  if (settled_row_ != processed_) settlements_at_row_ = 0;
  settled_row_ = processed_;
  if (adaptive() && processed_ > 0 && settlements_at_row_ < kMostSettlementsAtRow) {
    POLYEST_ASSIGN_OR_RETURN(const bool moved, Settle(stop));
    ++settlements_at_row_;
    if (moved) return true;
  }
  if (short_of_trajectories) return expansion_->shortage();
  patient_until_ = processed_ + 1 + processed_ / kPatience;
  return false;
}

absl::StatusOr<bool> Estimator::Implementation::SettleAfterWindow(const Stop& stop) {
  bool moved = false;
  if (learns_noise()) {
    POLYEST_ASSIGN_OR_RETURN(moved, LearnNoise(stop));
  }
  if (adaptive()) {
    POLYEST_ASSIGN_OR_RETURN(const bool tightened, TightenTolerance(stop));
    POLYEST_ASSIGN_OR_RETURN(const bool settled, SettleIfInaccurate(stop));
    moved = moved || tightened || settled;
  }
  window_end_ =
      std::max(processed_ + 2,
               static_cast<int64_t>(std::ceil(kWindowGrowth * static_cast<double>(processed_))));
  return moved;
}

absl::StatusOr<bool> Estimator::Implementation::SettleIfInaccurate(const Stop& stop) {
  const Agreement agreement =
      AgreementWithModel(*expansion_, expansion_->MakeCost(problem_.problem().regularization));
  if (agreement.shift <= kMostShift) return false;
  return Settle(stop);
}

// Scales that are not learned yet follow the signal, so that the first samples weigh little however
// large they are. True when the record was taken anew.
absl::StatusOr<bool> Estimator::Implementation::RaiseUnlearnedScales(const RowBlock& block, int row,
                                                                     const Stop& stop) {
  if (!learns_noise()) return false;
  std::optional<LearnedNoise> raised;  // made only when needed: this is done for every sample
  const std::vector<ChannelNoise>& present = expansion_->noise().channels;
  const size_t width = block.values.size() / block.rows.size();
  for (size_t c = 0; c < present.size(); ++c) {
    const double shape = block.noise[static_cast<size_t>(row) * present.size() + c];
    if (!problem_.problem().measured[c].noise.unknown || present[c].learned || shape <= 0) continue;
    const double size = std::abs(block.values[static_cast<size_t>(row) * width + c]) / shape;
    if (size <= present[c].scale) continue;
    if (!raised) raised = expansion_->noise();
    raised->channels[c].scale = kAboveSignal * size;
  }
  if (!raised) return false;
  POLYEST_RETURN_IF_ERROR(TakeAnew(*std::move(raised), stop));
  return true;
}

// True when the record was taken anew with another noise. Less noise asks more of the expansion.
absl::StatusOr<bool> Estimator::Implementation::LearnNoise(const Stop& stop) {
  bool moved = false;
  for (int i = 0; i < kMostRevisions; ++i) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    std::optional<LearnedNoise> revised = ReviseNoise(problem_, *expansion_, summary_, stop);
    if (!revised) break;
    POLYEST_RETURN_IF_ERROR(TakeAnew(*std::move(revised), stop));
    moved = true;
    if (!adaptive()) continue;
    POLYEST_RETURN_IF_ERROR(TightenTolerance(stop).status());
    POLYEST_RETURN_IF_ERROR(SettleIfInaccurate(stop).status());
  }
  return moved;
}

// The same expansion with the record so far weighed by another noise.
absl::Status Estimator::Implementation::TakeAnew(LearnedNoise noise, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(auto replayed, Replay(problem_, expansion_->design(), std::move(noise),
                                                 *store_, processed_, threads_, stop));
  abandoned_rows_ += expansion_->propagated_rows();
  expansion_ = std::move(replayed);
  broken_ = false;
  return absl::OkStatus();
}

// True when the noise asked for a tighter tolerance and the record was propagated again with it.
absl::StatusOr<bool> Estimator::Implementation::TightenTolerance(const Stop& stop) {
  if (!problem_.problem().tolerance_follows_noise) return false;
  const double needed = std::max(kTightestTolerance,
                                 kTolerancePerNoise * summary_.NoiseToSignal(expansion_->noise()));
  const double present = problem_.problem().integration.relative_tolerance;
  if (needed >= present) return false;
  // Half of what is needed now, so that a slowly falling ratio does not ask again and again.
  problem_.set_relative_tolerance(std::max(kTightestTolerance, 0.5 * needed));
  auto replayed = Replay(problem_, expansion_->design(), expansion_->noise(), *store_, processed_,
                         threads_, stop);
  if (!replayed.ok()) {
    problem_.set_relative_tolerance(present);
    if (absl::IsFailedPrecondition(replayed.status())) return false;  // the present one stays
    return replayed.status();
  }
  abandoned_rows_ += expansion_->propagated_rows();
  expansion_ = *std::move(replayed);
  broken_ = false;
  return true;
}

// True when the expansion moved.
absl::StatusOr<bool> Estimator::Implementation::Settle(const Stop& stop) {
  SettleRequest request;
  request.problem = &problem_;
  request.store = store_.get();
  request.rows = processed_;
  request.guesses = particles_;
  request.seed = 1000 * (settlements_ + 1);
  request.threads = threads_;
  POLYEST_ASSIGN_OR_RETURN(Settlement settlement, polyest::Settle(*expansion_, request, stop));
  ++settlements_;
  particles_ = std::move(settlement.particles);
  if (!settlement.expansion) return false;
  abandoned_rows_ += expansion_->propagated_rows() + settlement.propagated_rows;
  reexpansions_ += settlement.reexpansions;
  expansion_ = std::move(settlement.expansion);
  broken_ = false;
  return true;
}

AssessmentRequest Estimator::Implementation::RequestAssessment() const {
  AssessmentRequest request;
  request.problem = &problem_;
  request.expansion = expansion_.get();
  request.record = &summary_;
  request.guesses = &particles_;
  request.reexpansions = reexpansions_;
  request.propagated_rows = abandoned_rows_ + expansion_->propagated_rows();
  return request;
}

absl::StatusOr<Estimate> Estimator::Implementation::CurrentEstimate(const Stop& stop) const {
  POLYEST_ASSIGN_OR_RETURN(Assessed assessed, Assess(RequestAssessment(), stop));
  return std::move(assessed.estimate);
}

absl::StatusOr<Posterior> Estimator::Implementation::CurrentPosterior(
    const PosteriorOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(options.Validate(problem_.prior()));
  AssessmentRequest request = RequestAssessment();
  request.effort = options.Effort();
  POLYEST_ASSIGN_OR_RETURN(const Assessed assessed, Assess(request, stop));
  return DescribePosterior(assessed, problem_.prior(), options);
}

absl::StatusOr<CostProfiles> Estimator::Implementation::CurrentProfiles(
    const ProfileOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(options.Validate(problem_.prior()));
  POLYEST_ASSIGN_OR_RETURN(const Assessed assessed, Assess(RequestAssessment(), stop));
  const Cost cost = expansion_->MakeCost(assessed.estimate.regularization);
  return ProfileCost(assessed, cost, expansion_->design(), options, stop);
}

Estimator::Estimator(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
Estimator::~Estimator() = default;

absl::StatusOr<std::unique_ptr<Estimator>> Estimator::Make(ResolvedProblem problem,
                                                           EstimatorOptions options) {
  if (problem.channels() == 0) {
    return absl::InvalidArgumentError("measured: at least one output must be measured");
  }
  if (options.threads < 1) {
    return absl::InvalidArgumentError(
        absl::StrFormat("threads: %d must be at least 1", options.threads));
  }
  if (options.store && options.store->rows() > 0) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "the sample store holds %d rows already; an estimator begins with an empty one",
        options.store->rows()));
  }
  auto implementation = std::make_unique<Implementation>(std::move(problem), std::move(options));
  POLYEST_RETURN_IF_ERROR(implementation->Begin());
  return std::unique_ptr<Estimator>(new Estimator(std::move(implementation)));
}

const ResolvedProblem& Estimator::problem() const { return implementation_->problem(); }
absl::Status Estimator::Append(const Samples& samples) { return implementation_->Append(samples); }
absl::Status Estimator::Process(const Stop& stop) { return implementation_->Process(stop); }
absl::StatusOr<Estimate> Estimator::CurrentEstimate(const Stop& stop) const {
  return implementation_->CurrentEstimate(stop);
}
absl::StatusOr<Posterior> Estimator::CurrentPosterior(const PosteriorOptions& options,
                                                      const Stop& stop) const {
  return implementation_->CurrentPosterior(options, stop);
}
absl::StatusOr<CostProfiles> Estimator::CurrentProfiles(const ProfileOptions& options,
                                                        const Stop& stop) const {
  return implementation_->CurrentProfiles(options, stop);
}
int64_t Estimator::rows_appended() const { return implementation_->rows_appended(); }
int64_t Estimator::rows_processed() const { return implementation_->rows_processed(); }

}  // namespace polyest
