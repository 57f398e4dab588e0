#include "core/propagation/ensemble_propagator.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/common/check.h"
#include "core/common/parallel.h"
#include "core/propagation/trajectory_block.h"

namespace polyest {

absl::Status IntegrationOptions::Validate() const {
  if (!(relative_tolerance >= 1e-13 && relative_tolerance <= 1e-2)) {
    return absl::InvalidArgumentError(absl::StrCat("relative_tolerance: ", relative_tolerance,
                                                   " must lie between 1e-13 and 0.01"));
  }
  if (most_steps < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("most_steps: ", most_steps, " must be at least 1"));
  }
  return absl::OkStatus();
}

class EnsemblePropagator::Implementation {
 public:
  Implementation(EnsembleSpecification specification, const InputSignals* inputs);
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs, const Stop& stop);
  int points() const { return static_cast<int>(specification_.parameters.rows()); }
  const std::vector<PointFailure>& failures() const { return failures_; }

 private:
  void CollectFailures();

  EnsembleSpecification specification_;
  std::vector<std::unique_ptr<TrajectoryBlock>> blocks_;
  std::vector<absl::Status> statuses_;  // one a block
  std::vector<PointFailure> failures_;
};

EnsemblePropagator::Implementation::Implementation(EnsembleSpecification specification,
                                                   const InputSignals* inputs)
    : specification_(std::move(specification)) {
  const ModelDescription& description = specification_.model->description();
  POLYEST_CHECK(specification_.parameters.cols() == std::ssize(description.parameters));
  POLYEST_CHECK(specification_.amplitudes.cols() == std::ssize(description.inputs));
  POLYEST_CHECK(specification_.amplitudes.rows() == specification_.parameters.rows());
  POLYEST_CHECK(inputs->size() == description.inputs.size());
  POLYEST_CHECK(specification_.integration.Validate().ok());
  for (const int output : specification_.outputs) {
    POLYEST_CHECK(output >= 0 && output < std::ssize(description.outputs));
  }
  for (int first = 0; first < points(); first += TrajectoryBlock::kPoints) {
    const int count = std::min(TrajectoryBlock::kPoints, points() - first);
    blocks_.push_back(std::make_unique<TrajectoryBlock>(&specification_, inputs, first, count));
  }
  statuses_.resize(blocks_.size());
  CollectFailures();
}

absl::Status EnsemblePropagator::Implementation::Advance(std::span<const double> times_s,
                                                         MatrixRef outputs, const Stop& stop) {
  POLYEST_CHECK(outputs.rows() == points());
  POLYEST_CHECK(outputs.cols() == std::ssize(times_s) * std::ssize(specification_.outputs));
  ParallelFor(static_cast<int>(blocks_.size()), specification_.threads, [&](int block) {
    statuses_[block] = blocks_[block]->Advance(times_s, outputs, stop);
  });
  CollectFailures();
  for (const absl::Status& status : statuses_) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

void EnsemblePropagator::Implementation::CollectFailures() {
  size_t count = 0;
  for (const auto& block : blocks_) count += block->failures().size();
  if (count == failures_.size()) return;
  failures_.clear();
  for (const auto& block : blocks_) {
    failures_.insert(failures_.end(), block->failures().begin(), block->failures().end());
  }
  std::sort(failures_.begin(), failures_.end(),
            [](const PointFailure& a, const PointFailure& b) { return a.point < b.point; });
}

EnsemblePropagator::EnsemblePropagator(EnsembleSpecification specification,
                                       const InputSignals* inputs)
    : implementation_(std::make_unique<Implementation>(std::move(specification), inputs)) {}
EnsemblePropagator::~EnsemblePropagator() = default;
EnsemblePropagator::EnsemblePropagator(EnsemblePropagator&&) noexcept = default;
EnsemblePropagator& EnsemblePropagator::operator=(EnsemblePropagator&&) noexcept = default;

int EnsemblePropagator::points() const { return implementation_->points(); }

absl::Status EnsemblePropagator::Advance(std::span<const double> times_s, MatrixRef outputs,
                                         const Stop& stop) {
  return implementation_->Advance(times_s, outputs, stop);
}

const std::vector<PointFailure>& EnsemblePropagator::failures() const {
  return implementation_->failures();
}

}  // namespace polyest
