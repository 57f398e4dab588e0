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
  // Starts the filters at t = 0. The specification must have no output delays, and a
  // StateSpaceModel with states. `inputs` as for EnsemblePropagator.
  FilterBank(EnsembleSpecification specification, const InputSignals* inputs);

  int members() const { return static_cast<int>(specification_.parameters.rows()); }
  Eigen::Index outputs() const { return std::ssize(specification_.outputs); }

  // As FilterBlock::Advance, for all members: innovations and log variances are members × (m ·
  // times).
  absl::Status Advance(const FilterSamples& samples, MatrixRef innovations, MatrixRef log_variances,
                       const Stop& stop);

  // As FilterBlock::PredictOutputs and TakeStatesOf, for all members.
  absl::Status Predict(double time_s, MatrixRef means, MatrixRef deviations, const Stop& stop);
  void TakeStatesOf(const FilterBank& other);
  // As those of FilterBlock, for all members.
  void StartBackward();
  absl::Status Mark(double time_s, const Stop& stop);
  void FinishBackward();
  void ReadMarked(size_t mark, double time_s, MatrixRef means, MatrixRef deviations);

  // Writes the means and the standard deviations of the states at the time reached, as the samples
  // up to there tell them (members × states each).
  void ReadStates(Matrix& means, Matrix& deviations) const;

  // The failures so far, ordered by member.
  const std::vector<PointFailure>& failures() const { return blocks_.failures(); }

  // As those of TrajectoryEnsemble.
  std::optional<EnsembleState> State() const { return blocks_.State(); }
  bool Restore(const EnsembleState& state) { return blocks_.Restore(state); }

 private:
  std::vector<std::unique_ptr<FilterBlock>> MakeBlocks(const InputSignals* inputs) const;

  EnsembleSpecification specification_;
  EnsembleBlocks<FilterBlock> blocks_;
};

}  // namespace polyest::internal
