#pragma once

// A bank of filters: one Kalman filter (filter_block.h) for each point of an ensemble, all given
// the same samples. With the parameters of a point, the likelihood of the samples is that of the
// whitened innovations,
//
//   −log p(z) = ½ Σ_k (w_k² + log 2πS_k),   w_k = ν_k/√S_k,
//
// which is exact for models that are linear in their states.
//
// Members are dealt into blocks of fixed size (ensemble_blocks.h), so that results have the same
// bits for any number of threads and for any division of the samples into calls of Advance.

#include <absl/status/status.h>

#include <memory>
#include <optional>
#include <vector>

#include "core/propagation/ensemble_blocks.h"
#include "core/propagation/filter_block.h"

namespace polyest::internal {

class FilterBank {
 public:
  // Starts the filters at t = 0. The specification must have no output delays, and a model with
  // states that is a StateSpaceModel or has equations (trajectory_ensemble.h). `inputs` as for
  // EnsemblePropagator.
  FilterBank(EnsembleSpecification specification, const InputSignals* inputs);

  int states() const { return static_cast<int>(specification_.process_noise.cols()); }
  int members() const { return static_cast<int>(specification_.parameters.rows()); }
  Eigen::Index outputs() const { return std::ssize(specification_.outputs); }

  // As FilterBlock::Advance, for all members: innovations and log variances are members × (m ·
  // times). All that advances fails on a stop request, or if the model's code is lost.
  absl::Status Advance(const FilterSamples& samples, MatrixRef innovations, MatrixRef log_variances,
                       const Stop& stop);

  // As FilterBlock::PredictOutputs and TakeStatesOf, for all members.
  absl::Status Predict(double time_s, MatrixRef means, MatrixRef deviations, const Stop& stop);
  void TakeStatesOf(const FilterBank& other);
  // Go through the samples backward and read what all of them tell of earlier times, as FilterBlock
  // describes it, for all members. ReadMarked fails if the model's code is lost.
  void StartBackward();
  absl::Status Mark(double time_s, const Stop& stop);
  void FinishBackward();
  absl::Status ReadMarked(size_t mark, double time_s, MatrixRef means, MatrixRef deviations);
  void ReadJumpScores(size_t mark, MatrixRef scores) const;

  // Writes the means and the standard deviations of the states at the time reached, as the samples
  // up to there tell them (members × states each).
  void ReadStates(Matrix& means, Matrix& deviations) const;

  // The failures so far, ordered by member.
  const std::vector<PointFailure>& failures() const { return failures_; }

  // Return what Restore needs to go on from here, and go on from there, as TrajectoryEnsemble's do.
  std::optional<EnsembleState> State() const;
  bool Restore(const EnsembleState& state);

 private:
  std::vector<std::unique_ptr<FilterBlock>> MakeBlocks() const;
  void Begin(const Stop& stop);
  absl::Status Settle(const absl::Status& status);
  const std::vector<std::unique_ptr<FilterBlock>>& blocks() const { return blocks_->blocks(); }

  EnsembleSpecification specification_;
  const InputSignals* inputs_;
  std::shared_ptr<PointEquations> equations_;  // of a model whose code runs elsewhere, else null
  // Equations need the first values of streamed inputs, so that their blocks are made at first use.
  std::optional<EnsembleBlocks<FilterBlock>> blocks_;
  bool backward_ = false;
  std::vector<PointFailure> failures_;
};

}  // namespace polyest::internal
