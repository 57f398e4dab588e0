#pragma once

// A block of Kalman filters: one for each of a few members of an ensemble, all with the same model,
// inputs and sample times, each with its own parameters,
//
//   dx = f(t, x, θ, u) dt + √q dβ,   z_k = h(t_k, x, θ) + √r e_k,
//
// with independent white process noises of spectral densities q (one for each state) and e_k ~
// N(0, 1), or Student's t (heavy_tail.h), where r is a sample's variance times the square of a
// member's own factor. The filters are square-root cubature Kalman filters (gaussian_states.h):
// exact for models that are linear in their states, and without Jacobians. Where an output is
// curved over the width of what is known of the states, its likelihood and what it tells are
// integrated (output_quadrature.h). They begin at t = 0 with
// the model's initial states, which are known exactly (P = 0); what is uncertain of them is an
// uncertain parameter.
//
// From one sample to the next process noise is added by Simpson's rule,
//
//   ∫ Φ(s) q Φ(s)ᵀ ds ≈ Δt/6 (Φ(Δt) q Φ(Δt)ᵀ + 4 Φ(Δt/2) q Φ(Δt/2)ᵀ + q):
//
// q Δt/6 before the interval, 4 q Δt/6 at its middle and q Δt/6 after it. Its relative error is
// about (Δt λ)⁴/180 in a mode with the rate λ, so that an interval is divided until Δt λ ≤ 1 for
// the fastest mode of the model at the filters' states (noise_parts.h). Channels are taken one by
// one; one without a sample is left out.
//
// A member fails as a whole when a trajectory of one of its points cannot be integrated.

#include <absl/status/status.h>

#include <memory>
#include <span>
#include <vector>

#include "core/common/types.h"
#include "core/propagation/backward_pass.h"
#include "core/propagation/gaussian_states.h"
#include "core/propagation/heavy_tail.h"
#include "core/propagation/output_quadrature.h"
#include "core/propagation/trajectory_block.h"
#include "core/propagation/trajectory_ensemble.h"
#include "polyest/stop.h"

namespace polyest::internal {

// What was measured at some sample times: column k belongs to the k-th time, row c to the c-th
// output read.
struct FilterSamples {
  std::span<const double> times_s;  // non-decreasing
  ConstMatrixRef values;            // m × times
  ConstMatrixRef noise;             // m × times: σ = √r; ≤ 0 where there is no sample
};

class FilterBlock {
 public:
  // Returns how many members of a model with so many states share a block.
  static int Members(Eigen::Index states);

  // Takes members first_member … first_member + members − 1 of the specification, which must have
  // process noise and a model with states. `inputs` must outlive the block. `exact`: the ensemble
  // StepsExactly (linear_system.h).
  FilterBlock(const EnsembleSpecification& specification, const InputSignals* inputs,
              int first_member, int members, bool exact);

  // Takes the samples (times ≥ the time reached) and writes, for this block's members and the
  // c-th output at the k-th time, the whitened innovation ν/√S into column k·m + c of
  // `innovations` and log(S/r) into that of `log_variances` (all members × (m · times)). Both are 0
  // without a sample and NaN from a member's failure on. Fails on a stop request only.
  absl::Status Advance(const FilterSamples& samples, MatrixRef innovations, MatrixRef log_variances,
                       const Stop& stop);

  // Predicts the outputs at `time_s` ≥ the time reached without a sample: writes for this block's
  // members their means and standard deviations (all members × outputs); NaN from a member's
  // failure on. Fails on a stop request only.
  absl::Status PredictOutputs(double time_s, MatrixRef means, MatrixRef deviations,
                              const Stop& stop);
  // Takes the states of a block of the same members, model and inputs at the same time.
  void TakeStatesOf(const FilterBlock& other);

  // For what all samples tell of an instant (backward_pass.h). StartBackward is called at t = 0;
  // Mark predicts to the instant `time_s` ≥ the time reached and marks it; after FinishBackward the
  // outputs at the i-th mark are read as PredictOutputs writes them. The filters go no further
  // then.
  void StartBackward();
  absl::Status Mark(double time_s, const Stop& stop);
  void FinishBackward() { backward_->Finish(); }
  void ReadMarked(size_t mark, double time_s, MatrixRef means, MatrixRef deviations);
  // Writes the scores of abrupt changes at the i-th mark for the block's members (all members ×
  // states).
  void ReadJumpScores(size_t mark, MatrixRef scores) const;

  // Returns the members' failures, in the order in which they failed; points are numbers of
  // members.
  const std::vector<PointFailure>& failures() const { return failures_; }

  // The states that the samples so far tell, of each of the block's members.
  const GaussianStates& states() const { return gaussians_; }

  // Begin the integration anew, return the block's state, tell whether one fits, and take it, as
  // TrajectoryBlock's do. The first rows of the states are the means and factors.
  void Restart() { block_.Restart(); }
  EnsembleState::OfBlock State() const;
  bool Fits(const EnsembleState::OfBlock& state) const;
  void Restore(double time_s, const EnsembleState::OfBlock& state);

 private:
  EnsembleState::OfBlock OfPoints(const EnsembleState::OfBlock& state) const;
  absl::Status Predict(double time_s, const Stop& stop);
  absl::Status MoveTo(double time_s, const Stop& stop);
  void Diffuse(double duration_s);
  double FastestRate(double interval_s);
  void Differentiate(double interval_s);
  std::vector<int> PointsOf(int member) const;
  bool AnyAlive() const;
  void ReadOutputs();
  void WriteOutputs(MatrixRef means, MatrixRef deviations);
  void SelectOutput(int channel);
  void Update(const FilterSamples& samples, Eigen::Index sample, int channel, MatrixRef innovations,
              MatrixRef log_variances);
  void UpdateNormal(double z, double sigma);
  void UpdateTailed(double z, double sigma);
  bool IsCurved(int channel, double z);
  void ReadAlong(const Eigen::ArrayXXd& s, Eigen::Index count, int channel,
                 Eigen::ArrayXXd& values);
  void UpdateCurved(int channel, double z, double sigma);
  void FindLine(int channel);
  void ReadDrawn(int channel, Eigen::Ref<Eigen::ArrayXXd> values);
  void TakeIntegral(Eigen::Index member, double z, double sigma, bool tailed);
  void AddCurvedSample();
  bool IsTailed(int channel) const {
    return !specification_.heavy_tailed.empty() &&
           specification_.heavy_tailed[static_cast<size_t>(channel)];
  }
  void NoteFailures();
  int member_count() const { return static_cast<int>(gaussians_.members()); }

  // Points along a line at which an output is looked at for curvature.
  static constexpr Eigen::Index kScanned = 4;

  const int first_member_;
  EnsembleSpecification specification_;  // of the points, 2n for each member
  Eigen::ArrayXXd spectral_densities_;   // members × n
  Eigen::ArrayXXd noise_factors_;        // members × outputs; empty: 1
  bool noisy_;
  TrajectoryBlock block_;
  GaussianStates gaussians_;
  double time_s_ = 0;
  std::vector<double> part_ends_s_;               // of the interval to the next sample
  Eigen::ArrayXXd points_;                        // rows of the block × n
  Eigen::ArrayXXd moved_, moved_rates_;           // row j < n: moved in state j; below: not moved
  Eigen::ArrayXd steps_;                          // n
  Matrix jacobian_, square_;                      // n × n
  const Eigen::ArrayXXd* all_outputs_ = nullptr;  // of the points, as read last
  Eigen::ArrayXd outputs_, noise_variance_, innovation_, variance_;
  HeavyTail tail_;
  Eigen::ArrayXd gain_variance_, spread_;   // as it gives them, by member
  Eigen::ArrayXd whitened_, log_variance_;  // ν/√S and log(S/σ²) of a sample, by member
  OutputQuadrature quadrature_;
  Eigen::ArrayXXd scan_, scanned_;          // s and the outputs there, members × points on a line
  Eigen::ArrayXd shift_, mean_, squeezed_;  // μ, E and V, by member
  std::unique_ptr<BackwardPass> backward_;  // null unless StartBackward was called
  Eigen::ArrayXXd factor_before_;           // of the stage that is added to it
  std::vector<bool> has_line_;              // by member: whether it is integrated
  std::vector<bool> alive_;                 // by member
  size_t failures_seen_ = 0;
  std::vector<PointFailure> failures_;
};

}  // namespace polyest::internal
