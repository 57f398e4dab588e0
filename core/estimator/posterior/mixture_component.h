#pragma once

// One component of the posterior's mixture on its way along the record: an expansion over a region
// of its own, and the windows, settlements, noise and tolerance that go with it. What it does is a
// function of the rows taken, never of how they came.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/posterior/assessment.h"
#include "core/estimator/record/record_summary.h"

namespace polyest::internal {

// Where a window that begins after so many rows ends, windows being counted from a row on.
int64_t NextWindow(int64_t rows, int64_t from = 0);

struct ComponentState;

class MixtureComponent {
 public:
  // The whole prior. FAILED_PRECONDITION when its expansion cannot be factored. `store` must
  // outlive the component.
  static absl::StatusOr<std::unique_ptr<MixtureComponent>> OfPrior(const ResolvedProblem& problem,
                                                                   const SampleStore* store,
                                                                   int threads);

  // One in that state (State), on a store that has its rows at least. DATA_LOSS when the state
  // cannot be of such a problem, FAILED_PRECONDITION when it is not of those rows.
  static absl::StatusOr<std::unique_ptr<MixtureComponent>> FromState(const ResolvedProblem& problem,
                                                                     ComponentState state,
                                                                     const SampleStore* store,
                                                                     int threads);
  // After TakeUpTo a checkpoint or the row before a new run, while not is_multimodal().
  ComponentState State() const;

  // Takes rows of the store up to the first `rows`. On a stop request returns its status; what was
  // taken stays, the next call goes on from there.
  absl::Status TakeUpTo(int64_t rows, const Stop& stop);
  int64_t rows_taken() const { return taken_; }

  // Whether the posterior lies in separated pieces that one expansion does not serve. No more rows
  // are taken before it has been divided.
  bool is_multimodal() const { return !pieces_.empty(); }
  // A component for each piece, at the same row. None, and this one goes on whole, where one of
  // them could not be expanded.
  absl::StatusOr<std::vector<std::unique_ptr<MixtureComponent>>> Divide(const Stop& stop);

  // Before it is weighed: settled anew, once at a row, where the posterior has become so narrow
  // that the check points no longer tell its cost's height (mixture_share.h).
  absl::Status MakeComparable(const Stop& stop);
  // The posterior's probability of it when that was last looked at.
  double weight() const { return weight_; }
  void set_weight(double weight) { weight_ = weight; }
  const RegionalExpansion& expansion() const { return *expansion_; }
  int reexpansions() const { return reexpansions_; }
  int64_t propagated_rows() const { return abandoned_rows_ + expansion_->propagated_rows(); }
  // Refers to the component.
  AssessmentRequest RequestAssessment() const;

 private:
  MixtureComponent(const ResolvedProblem& problem, const SampleStore* store, int threads);

  bool adaptive() const { return problem_.problem().expansion.adaptive; }
  bool automatic_order() const { return !problem_.problem().expansion.order; }
  bool WindowEnds() const { return (adaptive() || learns_noise_) && taken_ >= window_end_; }
  absl::Status Recover(const Stop& stop);
  absl::Status ReadBlock(int64_t rows, RowBlock& block, const Stop& stop);
  absl::Status BeginRun(int run, const Stop& stop);
  absl::StatusOr<bool> AbsorbBlock(const RowBlock& block, const Stop& stop);
  absl::StatusOr<bool> SettleBefore(bool short_of_trajectories, const Stop& stop);
  absl::StatusOr<bool> SettleAfterWindow(const Stop& stop);
  absl::StatusOr<bool> SettleIfInaccurate(const Stop& stop);
  absl::StatusOr<bool> RaiseUnlearnedScales(const RowBlock& block, int row, const Stop& stop);
  absl::StatusOr<bool> LearnNoise(const Stop& stop);
  absl::StatusOr<bool> TightenTolerance(const Stop& stop);
  absl::StatusOr<bool> Settle(const Stop& stop, bool may_raise_order);
  bool LookForPieces();
  absl::Status BeginOn(const MixtureComponent& parent, const Matrix& piece, const Stop& stop);
  absl::Status Reweigh(LearnedNoise noise, const Stop& stop);
  void Adopt(std::unique_ptr<RegionalExpansion> expansion);

  ResolvedProblem problem_;  // of its own: the tolerance follows the noise
  const SampleStore* store_;
  int threads_;
  bool learns_noise_;
  std::unique_ptr<RegionalExpansion> expansion_;
  bool broken_ = false;         // a stop left the expansion between two rows
  Matrix particles_;            // of the last settlement, germ coordinates
  std::vector<Matrix> pieces_;  // of them, where there are several
  double weight_ = 1;
  int64_t taken_ = 0;
  int64_t windows_from_ = 0;  // the row that the present windows count from
  int64_t window_end_ = 2;
  int64_t patient_until_ = 0;  // rows before this one are taken whatever their residual
  int64_t whole_until_ = 0;    // no pieces are looked for before this one
  int64_t settled_row_ = -1;
  int settlements_at_row_ = 0;
  int64_t comparable_row_ = -1;
  uint64_t settlements_ = 0;
  int reexpansions_ = 0;
  int64_t abandoned_rows_ = 0;  // propagated by expansions given up since
  RecordSummary summary_;
};

}  // namespace polyest::internal
