#include "core/propagation/ensemble_propagator.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/propagation/ensemble_blocks.h"
#include "core/propagation/linear_system.h"
#include "core/propagation/output_limit.h"
#include "core/propagation/trajectory_block.h"

namespace polyest {

using namespace internal;

absl::Status IntegrationOptions::Validate() const {
  if (!(relative_tolerance >= 1e-13 && relative_tolerance <= 1e-2)) {
    return InvalidField("relative_tolerance",
                        absl::StrCat(relative_tolerance, " must lie between 1e-13 and 0.01"));
  }
  POLYEST_RETURN_IF_ERROR(CheckAtLeast("max_steps", max_steps, 1));
  return CheckAtLeast("samples_between_checkpoints", samples_between_checkpoints, 1);
}

}  // namespace polyest

namespace polyest::internal {

namespace {

// An ensemble of a state-space model, integrated in blocks of trajectories.
class IntegratedEnsemble final : public TrajectoryEnsemble {
 public:
  IntegratedEnsemble(EnsembleSpecification specification, const InputSignals* inputs)
      : specification_(std::move(specification)),
        blocks_(MakeBlocks(inputs), specification_.threads,
                specification_.integration.samples_between_checkpoints) {}
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs,
                       const Stop& stop) override;
  int points() const override { return static_cast<int>(specification_.parameters.rows()); }
  const std::vector<PointFailure>& failures() const override { return blocks_.failures(); }
  std::optional<EnsembleState> State() const override { return blocks_.State(); }
  bool Restore(const EnsembleState& state) override { return blocks_.Restore(state); }

 private:
  std::vector<std::unique_ptr<TrajectoryBlock>> MakeBlocks(const InputSignals* inputs) const;

  EnsembleSpecification specification_;
  EnsembleBlocks<TrajectoryBlock> blocks_;
};

std::vector<std::unique_ptr<TrajectoryBlock>> IntegratedEnsemble::MakeBlocks(
    const InputSignals* inputs) const {
  std::vector<std::unique_ptr<TrajectoryBlock>> blocks;
  const bool exact = StepsExactly(specification_, *inputs);
  for (int first = 0; first < points(); first += TrajectoryBlock::kPoints) {
    const int count = std::min(TrajectoryBlock::kPoints, points() - first);
    blocks.push_back(
        std::make_unique<TrajectoryBlock>(&specification_, inputs, first, count, exact));
  }
  return blocks;
}

absl::Status IntegratedEnsemble::Advance(std::span<const double> times_s, MatrixRef outputs,
                                         const Stop& stop) {
  POLYEST_CHECK(outputs.rows() == points());
  const Eigen::Index m = std::ssize(specification_.outputs);
  POLYEST_CHECK(outputs.cols() == std::ssize(times_s) * m);
  return blocks_.AdvanceSamples(times_s, [&](TrajectoryBlock& block, Eigen::Index first,
                                             Eigen::Index count) {
    return block.Advance(times_s.subspan(static_cast<size_t>(first), static_cast<size_t>(count)),
                         outputs.middleCols(first * m, count * m), stop);
  });
}

void CheckSpecification(const EnsembleSpecification& specification, const InputSignals& inputs) {
  const ModelDescription& description = specification.model->description();
  const Eigen::Index points = specification.parameters.rows();
  const auto fits = [points](const Matrix& matrix, size_t columns) {
    return matrix.rows() == points && matrix.cols() == static_cast<Eigen::Index>(columns);
  };
  const auto fits_or_empty = [&fits](const Matrix& matrix, size_t columns) {
    return matrix.size() == 0 || fits(matrix, columns);
  };
  POLYEST_CHECK(fits(specification.parameters, description.parameters.size()));
  POLYEST_CHECK(fits(specification.amplitudes, description.inputs.size()));
  POLYEST_CHECK(fits_or_empty(specification.input_delays_s, description.inputs.size()));
  POLYEST_CHECK(fits_or_empty(specification.input_offsets, description.inputs.size()));
  POLYEST_CHECK(fits_or_empty(specification.output_gains, specification.outputs.size()));
  POLYEST_CHECK(fits_or_empty(specification.output_offsets, specification.outputs.size()));
  POLYEST_CHECK(fits_or_empty(specification.output_delays_s, specification.outputs.size()));
  POLYEST_CHECK(fits_or_empty(specification.process_noise, description.states.size()));
  POLYEST_CHECK(fits_or_empty(specification.noise_factors, specification.outputs.size()));
  POLYEST_CHECK(inputs.size() == description.inputs.size());
  POLYEST_CHECK(specification.integration.Validate().ok());
  for (const int output : specification.outputs) {
    POLYEST_CHECK(output >= 0 && output < std::ssize(description.outputs));
  }
}

std::unique_ptr<TrajectoryEnsemble> StartEnsemble(EnsembleSpecification specification,
                                                  const InputSignals* inputs) {
  CheckSpecification(specification, *inputs);
  if (const auto* model = dynamic_cast<const SelfPropagatingModel*>(specification.model.get())) {
    return model->StartEnsemble(std::move(specification), inputs);
  }
  return std::make_unique<IntegratedEnsemble>(std::move(specification), inputs);
}

}  // namespace

bool HasCheckpointsInRuns(const Model& model) {
  return dynamic_cast<const StateSpaceModel*>(&model) != nullptr;
}

EnsemblePropagator::EnsemblePropagator(EnsembleSpecification specification,
                                       const InputSignals* inputs)
    : output_gains_(specification.output_gains), output_offsets_(specification.output_offsets) {
  Matrix delays_s = specification.output_delays_s;
  const double tolerance = specification.integration.relative_tolerance;
  const bool streamed = std::ranges::any_of(*inputs, &InputSignal::streamed);
  const double ahead_s = streamed ? specification.inputs_ahead_s : kInfinity;
  ensemble_ = StartEnsemble(std::move(specification), inputs);
  UpdateFailures();
  if (delays_s.size() == 0) return;
  auto delayed = std::make_unique<DelayedOutputs>(std::move(ensemble_), std::move(delays_s),
                                                  tolerance, ahead_s);
  delayed_ = delayed.get();
  ensemble_ = std::move(delayed);
}

absl::Status EnsemblePropagator::Advance(std::span<const double> times_s, MatrixRef outputs,
                                         const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(ensemble_->Advance(times_s, outputs, stop));
  // y = gain · h + offset
  const Eigen::Index m = times_s.empty() ? 0 : outputs.cols() / std::ssize(times_s);
  for (Eigen::Index column = 0; column < outputs.cols(); ++column) {
    auto y = outputs.col(column).array();
    if (output_gains_.size() > 0) y *= output_gains_.col(column % m).array();
    if (output_offsets_.size() > 0) y += output_offsets_.col(column % m).array();
  }
  if (output_gains_.size() > 0 || output_offsets_.size() > 0) FailBeyondLimit(times_s, outputs);
  UpdateFailures();
  if (delayed_ == nullptr) return absl::OkStatus();
  delay_errors_ = delayed_->errors();
  for (Eigen::Index column = 0; output_gains_.size() > 0 && column < outputs.cols(); ++column) {
    delay_errors_[column] *= output_gains_.col(column % m).cwiseAbs().maxCoeff();
  }
  return absl::OkStatus();
}

// The ensemble has seen to the limit before the gains and offsets; they may exceed it, too.
void EnsemblePropagator::FailBeyondLimit(std::span<const double> times_s, MatrixRef outputs) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const PointFailure& failure : beyond_) outputs.row(failure.point).setConstant(kNaN);
  const Eigen::Index m = times_s.empty() ? 1 : outputs.cols() / std::ssize(times_s);
  for (Eigen::Index column = 0; column < outputs.cols(); ++column) {
    for (Eigen::Index point = 0; point < outputs.rows(); ++point) {
      const double y = outputs(point, column);
      if (std::isnan(y) || std::abs(y) <= kMaxOutput) continue;
      PointFailure& failure = beyond_.emplace_back();
      failure.point = static_cast<int>(point);
      failure.time_s = times_s[static_cast<size_t>(column / m)];
      failure.reason = "an output, with its gain and offset, exceeds 1e100 in magnitude";
      outputs.row(point).tail(outputs.cols() - column / m * m).setConstant(kNaN);
    }
  }
}

void EnsemblePropagator::UpdateFailures() {
  const std::vector<PointFailure>& others = ensemble_->failures();
  if (failures_.size() == others.size() + beyond_.size()) return;
  failures_ = others;
  failures_.insert(failures_.end(), beyond_.begin(), beyond_.end());
}

bool EnsemblePropagator::Restore(const EnsembleState& state) {
  const bool restored = ensemble_->Restore(state);
  beyond_.clear();
  failures_ = ensemble_->failures();
  return restored;
}

}  // namespace polyest::internal
