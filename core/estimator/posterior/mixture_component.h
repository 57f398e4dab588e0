#pragma once

// One component of the posterior's mixture, which advances along the record. It has an expansion
// over its own region, and its own windows, re-expansions, noise and tolerance. Its results are a
// function of the rows taken, regardless of the batches in which they arrived.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <vector>

#include "core/estimator/expansion/germ_summary.h"
#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/expansion/reexpansion_memory.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/expansion/replay_allowance.h"
#include "core/estimator/posterior/assessment.h"
#include "core/estimator/posterior/posterior_pieces.h"
#include "core/estimator/posterior/reexpansion_schedule.h"
#include "core/estimator/record/record_summary.h"

namespace polyest::internal {

// Returns the maximum number of components of the problem's posterior. The budget is the number of
// trajectories that they propagate together, so that it does not depend on their order or
// dimension.
int MaxComponents(const ResolvedProblem& problem);

struct ComponentState;

// A beginning at the prior with the likelihood tempered.
struct TemperedBeginning {
  double misfit = 1;      // ≥ 1, by which the cost is divided at least
  int64_t rows = 0;       // until so many rows have been taken; it then falls to 1 step by step
  bool in_tails = false;  // whether the expansion is over the prior's tails, too
};

class MixtureComponent {
 public:
  // Makes a component over the whole prior. Returns InfeasibleError when its expansion cannot be
  // factored, or the status of a stop request. `store` must outlive the component.
  static absl::StatusOr<std::unique_ptr<MixtureComponent>> OfPrior(
      const ResolvedProblem& problem, const SampleStore* store, int threads,
      const TemperedBeginning& beginning, const Stop& stop);

  // Restores a component from a state that State returned. The store must hold at least its rows.
  // Returns DataLoss when the state cannot belong to such a problem, FailedPrecondition when the
  // rows differ from those of the state, the status of a stop request.
  static absl::StatusOr<std::unique_ptr<MixtureComponent>> FromState(const ResolvedProblem& problem,
                                                                     ComponentState state,
                                                                     const SampleStore* store,
                                                                     int threads, const Stop& stop);
  // Returns the state. May be called after TakeUpTo a checkpoint or the row before a new run,
  // unless must_divide().
  ComponentState State() const;

  // Takes rows of the store up to the first `rows`. On a stop request returns its status. The rows
  // taken until then are kept, and the next call continues from there.
  absl::Status TakeUpTo(int64_t rows, const Stop& stop);
  int64_t rows_taken() const { return taken_; }

  // Whether a single expansion cannot represent the posterior, because this consists of separated
  // pieces or the model changes too much over the element. No more rows are taken until Divide has
  // been called.
  bool must_divide() const { return halves_ || !pieces_.empty(); }
  // Returns a component for each piece, at the same row. Returns none if one of them could not be
  // expanded; this component then continues undivided.
  absl::StatusOr<std::vector<std::unique_ptr<MixtureComponent>>> Divide(const Stop& stop);
  // Returns a component for all of Ω at the same row that begins in the piece, with this one's
  // noise and windows. Returns null if its expansion does not follow the model there, or if the
  // record may not be propagated again.
  absl::StatusOr<std::unique_ptr<MixtureComponent>> Unite(const Piece& whole, const Stop& stop);
  // Whether the division is a bisection. Its halves need no weighing before they have taken more.
  bool bisects() const { return halves_; }
  // Whether the next row begins a run before which the ended ones lose their own parameters. No
  // more rows are taken until BeginAwaitedRun has been called.
  bool awaits_run() const { return awaited_run_.has_value(); }
  // Lets that run begin with the posterior of several components, of which these are particles (W ×
  // n, germ coordinates).
  void GoOnFor(Matrix particles) { particles_for_run_ = std::move(particles); }
  // Begins that run. Returns InfeasibleError when a run that has ended cannot be expanded. After a
  // stop the call may be repeated.
  absl::Status BeginAwaitedRun(const Stop& stop);
  // The number of components that this one may become by divisions.
  int room() const { return room_; }
  void set_room(int room) { room_ = room; }

  // Prepares for weighing: settles again, at most once at a row, if the posterior has become so
  // narrow that the check points no longer determine the height of its cost (mixture_share.h).
  absl::Status MakeComparable(const Stop& stop);
  // The element that the component stands for; a new one must contain the present one.
  const Element& element() const { return expansion_->design().element; }
  void set_element(Element element);
  const ResolvedProblem& problem() const { return problem_; }
  // Returns the posterior probability of the component at the last weighing.
  double weight() const { return weight_; }
  void set_weight(double weight) { weight_ = weight; }
  const RegionalExpansion& expansion() const { return *expansion_; }
  int reexpansions() const { return reexpansions_; }
  int64_t propagated_rows() const { return abandoned_rows_ + expansion_->propagated_rows(); }
  // Returns a request that refers to this component.
  AssessmentRequest RequestAssessment() const;

 private:
  // At the end of a window an element is bisected when the posterior's means may be wrong by so
  // many standard deviations and moving has not helped.
  static constexpr double kMinShiftToBisect = 0.25;
  // With so many dimensions, in which a posterior touches many halves, only when it has not moved.
  static constexpr int kDimensionToMoveFirst = 4;

  MixtureComponent(const ResolvedProblem& problem, const SampleStore* store, int threads);

  bool adaptive() const { return problem_.problem().expansion.adaptive; }
  bool automatic_order() const { return !problem_.problem().expansion.order; }
  // Whether the limit forbids to propagate the record so far again.
  bool IsReplayWithheld() const { return !allowance_.AllowsRecord(taken_); }

  // The progress of what is due after the last row taken. It outlives a stop, so that the work goes
  // on where it was left: a re-expansion made once more would change the estimate.
  struct RowEnd {
    int reweighed = 0;                   // times that the noise was revised
    bool settles = false;                // whether the expansion must still follow the last time
    std::optional<bool> learned;         // what LearnNoise has returned
    int revisions = 0;                   // of the misfit
    std::optional<double> revised_from;  // misfit before the present one
    std::optional<bool> goes_on;         // what ReviseMisfit has returned
    int moves = 0;                       // of the expansion, by RestoreAccuracy
    bool moved = false;                  // whether MoveWithMisfit has moved the expansion
  };

  // Rows: reading and absorbing them, and what is due before and after one.
  absl::Status Recover(const Stop& stop);
  absl::Status ReadBlock(int64_t rows, RowBlock& block, const Stop& stop);
  absl::StatusOr<bool> AbsorbBlock(const RowBlock& block, const Stop& stop);
  absl::StatusOr<bool> RefineBefore(int row, const Stop& stop);
  absl::StatusOr<bool> FinishRow(const Stop& stop);
  absl::StatusOr<bool> EndWindow(const Stop& stop);
  int64_t LatestWindowEnd() const;

  // Moves of the expansion, each for a reason of its own.
  bool LooksAhead() const;
  bool Leans() const;
  absl::StatusOr<bool> MoveIfLeaning(const Stop& stop);
  absl::StatusOr<bool> MoveAheadOfNeed(const Stop& stop);
  absl::StatusOr<bool> RestoreAccuracy(const Stop& stop);
  absl::StatusOr<bool> MoveWhileInaccurate(const Stop& stop);
  absl::StatusOr<bool> MoveToPosterior(const Stop& stop, bool may_raise_order,
                                       bool may_replay = true);
  ReexpansionRequest RequestReexpansion() const;
  bool Take(Reexpansion found);
  void Adopt(std::unique_ptr<RegionalExpansion> expansion);

  // Noise, misfit and the integrators' tolerance (component_noise.cc).
  double CoarseResidual() const;
  bool ReviseMisfit(const Stop& stop);
  absl::StatusOr<bool> MoveWithMisfit(const Stop& stop);
  absl::Status WithdrawTempering(const Stop& stop);
  absl::StatusOr<bool> RaiseUnlearnedScales(const RowBlock& block, int row, const Stop& stop);
  absl::StatusOr<bool> LearnNoise(const Stop& stop);
  absl::StatusOr<bool> Reweigh(LearnedNoise noise, const Stop& stop);
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> RescaledTo(LearnedNoise noise,
                                                                const Stop& stop);
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> ReplayedWith(const LearnedNoise& noise,
                                                                  const Stop& stop);
  absl::StatusOr<bool> TightenTolerance(const Stop& stop);
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> WithNewTolerance(double shift,
                                                                      const Stop& stop);

  // Runs with parameters of their own, and the elimination of those that have ended
  // (component_runs.cc).
  absl::Status BeginRun(int run, const Stop& stop);
  absl::Status BeginRunAlone(int run, const Stop& stop);
  absl::Status ReplayAs(ResolvedProblem problem, ExpansionDesign design, LearnedNoise noise,
                        Matrix particles, const Stop& stop);
  absl::Status GoOnWith(ResolvedProblem next, const GermSummary& shared, const Stop& stop);
  absl::StatusOr<Matrix> ParticlesNow(const Stop& stop) const;
  absl::Status RenewEndedRuns(const Stop& stop);

  // Division into pieces of the posterior or halves of the element (component_division.cc).
  bool MayLookForPieces() const;
  bool DivideIntoPieces(const RegionalExpansion& expansion, const Matrix& particles);
  bool LookForPieces();
  bool MayBisect() const;
  bool BisectElement();
  absl::Status Halve(const Stop& stop);
  absl::StatusOr<bool> ContractOrBisect(const Stop& stop);
  absl::Status ExpandOn(const MixtureComponent& parent, const Piece& piece, const Stop& stop);
  absl::Status BeginOn(const MixtureComponent& parent, const Piece& piece, const Stop& stop);
  ExpansionDesign DesignOn(const MixtureComponent& parent, const Piece& piece) const;

  ResolvedProblem problem_;  // own copy, because the tolerance follows the noise
  const SampleStore* store_;
  int threads_;
  bool learns_noise_;
  std::unique_ptr<RegionalExpansion> expansion_;
  bool broken_ = false;               // whether a stop left the expansion between two rows
  Matrix particles_;                  // of the last re-expansion, germ coordinates
  ReexpansionMemory memory_;          // and what they and earlier ones have found
  std::vector<Piece> pieces_;         // those to divide into; halves are found by Divide
  bool last_row_too_coarse_ = false;  // whether the last row was too coarse and not dealt with yet
  bool halves_ = false;               // whether to divide into the halves of a bisection
  bool bisected_ = false;             // whether it came from a bisection; its order stays low
  std::optional<int> awaited_run_;    // the run that begins with the next row
  std::optional<Matrix> particles_for_run_;  // those that GoOnFor was given
  int room_ = 1;
  double weight_ = 1;
  int64_t taken_ = 0;
  ReexpansionSchedule schedule_;
  TemperedBeginning tempered_;  // what is left of it
  RowEnd row_end_;
  uint64_t reexpansions_tried_ = 0;
  int reexpansions_ = 0;
  int64_t abandoned_rows_ = 0;  // propagated by expansions that were replaced
  ReplayAllowance allowance_;   // of rows that are propagated again
  Postponed postponed_;         // what it has put off
  RecordSummary summary_;
};

}  // namespace polyest::internal
