#pragma once

// The outputs of an ensemble as sensors with delays see them: y_qc(t − d_qc) for the point q and
// the output c.
//
// Every point has its own delays, so the outputs are interpolated in time. The ensemble is advanced
// to nodes τ_0 = 0 < τ_1 < …, and between them an output is the polynomial p of degree 5 through
// the six nodes nearby. Let p̃ be the one of degree 3 through four of them. For a smooth output with
// |y⁗| ≤ ω⁴ Y and nodes h apart, the errors in the middle of the stencil are
//
//   |y − p̃| ≤ (9/16) (ωh)⁴ Y/4!,   |y − p| ≤ (225/64) (ωh)⁶ Y/6!,
//
// so that with D = |p − p̃| ≈ |y − p̃| the error of p is about 1.4 D √(D/Y); at the end of a record,
// where the stencil is one-sided, 2.8 D √(D/Y). The spacing h follows D so that it stays below
// kMaxDifference relative tolerances of the integrator, for which the error of p is below the
// tolerance itself. Wherever it is larger, such as at a jump of an output, the error is reported.
//
// Nodes and spacing are a function of the record's times and of the outputs at the nodes, so
// results do not depend on how the times are divided into calls. Before the start of the run an
// output is that at t = 0.

#include <array>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "core/common/types.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

class DelayedOutputs final : public TrajectoryEnsemble {
 public:
  // D relative to the output, in relative tolerances.
  static constexpr double kMaxDifference = 30;

  // `delays_s`: Q × m, in s; the outputs of a point whose delay is not finite are NaN.
  // `ahead_s`: how far beyond a time the ensemble can be advanced when Advance is called for it, +∞
  // unless its inputs are streamed. No delay may be below −ahead_s.
  DelayedOutputs(std::unique_ptr<TrajectoryEnsemble> ensemble, Matrix delays_s,
                 double relative_tolerance, double ahead_s);

  int points() const override { return ensemble_->points(); }
  // A trajectory that fails within the nodes around a time is NaN there.
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs,
                       const Stop& stop) override;
  const std::vector<PointFailure>& failures() const override { return ensemble_->failures(); }

  // Returns the largest error of interpolation of any point, by output and time of the last
  // Advance, in the order of its columns.
  const Vector& errors() const { return errors_; }

 private:
  struct Node {
    double time_s = 0;
    Matrix outputs;  // Q × m
  };
  // The weights of up to six successive nodes.
  struct Weights {
    size_t first = 0;
    size_t count = 0;
    std::array<double, 6> value = {};
  };

  void NoteInterval(double time_s);
  absl::Status AddNodes(double latest_s, double limit_s, const Stop& stop);
  absl::Status AddNode(double time_s, const Stop& stop);
  absl::Status AddEnd(double time_s, const Stop& stop);
  void AdaptSpacing();
  void DropNodesBefore(double time_s);
  Weights LagrangeWeights(size_t first, size_t count, double time_s) const;
  double Interpolate(const Weights& weights, Eigen::Index point, Eigen::Index output) const;
  void Read(double time_s, Eigen::Index column, MatrixRef outputs);
  void ReadPoint(Eigen::Index point, Eigen::Index output, double at_s, double& value,
                 double& error) const;

  const std::unique_ptr<TrajectoryEnsemble> ensemble_;
  const Matrix delays_s_;
  const double max_difference_;
  const double ahead_s_;
  double least_delay_s_ = 0, largest_delay_s_ = 0;

  std::deque<Node> nodes_;
  std::vector<Node> unused_;  // memory for nodes to come
  bool has_end_ = false;      // whether the last node is where nothing is known after it yet
  Node replaced_;             // the node that the end took the place of, if any
  bool has_replaced_ = false;
  double spacing_s_ = 0;
  double reached_s_ = 0;                    // time of the last node added
  std::array<double, 8> intervals_s_ = {};  // the last ones between times
  size_t next_interval_ = 0;
  double time_s_ = 0;
  Vector errors_;
  Matrix difference_;
};

}  // namespace polyest::internal
