#include "core/propagation/filter_bank.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/propagation/linear_system.h"

namespace polyest::internal {
namespace {

// Returns the specification with process noise for each member and state, 0 if it has none.
EnsembleSpecification WithProcessNoise(EnsembleSpecification specification) {
  const Eigen::Index members = specification.parameters.rows();
  const Eigen::Index states = std::ssize(specification.model->description().states);
  POLYEST_CHECK(states > 0);
  Matrix& process_noise = specification.process_noise;
  if (process_noise.size() == 0) process_noise.setZero(members, states);
  POLYEST_CHECK(process_noise.rows() == members && process_noise.cols() == states);
  POLYEST_CHECK(specification.output_delays_s.size() == 0);
  POLYEST_CHECK(specification.heavy_tailed.empty() ||
                specification.heavy_tailed.size() == specification.outputs.size());
  return specification;
}

}  // namespace

FilterBank::FilterBank(EnsembleSpecification specification, const InputSignals* inputs)
    : specification_(WithProcessNoise(std::move(specification))), inputs_(inputs) {
  if (const auto* model = dynamic_cast<const SelfPropagatingModel*>(specification_.model.get())) {
    equations_ = model->StartEquations(specification_, inputs, FilterBlock::Members(states()));
    POLYEST_CHECK(equations_ != nullptr);
    specification_.model = equations_;
    specification_.parameters = Vector::LinSpaced(members(), 0, members() - 1);
    std::iota(specification_.outputs.begin(), specification_.outputs.end(), 0);
    return;
  }
  Begin(Stop());
}

std::vector<std::unique_ptr<FilterBlock>> FilterBank::MakeBlocks() const {
  std::vector<std::unique_ptr<FilterBlock>> blocks;
  const bool exact = StepsExactly(specification_, *inputs_);
  const int most = FilterBlock::Members(states());
  for (int first = 0; first < members(); first += most) {
    const int count = std::min(most, members() - first);
    blocks.push_back(std::make_unique<FilterBlock>(specification_, inputs_, first, count, exact));
    if (backward_) blocks.back()->StartBackward();
  }
  return blocks;
}

// Makes the blocks unless they are there.
void FilterBank::Begin(const Stop& stop) {
  if (equations_ != nullptr) equations_->Heed(stop);
  if (blocks_) return;
  blocks_.emplace(MakeBlocks(), specification_.threads,
                  specification_.integration.samples_between_checkpoints);
  failures_ = blocks_->failures();
}

// Takes over the blocks' failures and returns `status`, or what has ended all evaluations.
absl::Status FilterBank::Settle(const absl::Status& status) {
  if (failures_.size() != blocks_->failures().size()) failures_ = blocks_->failures();
  if (equations_ == nullptr) return status;
  for (PointFailure& failure : failures_) {
    std::string reason = equations_->FailureOf(failure.point);
    if (!reason.empty()) failure.reason = std::move(reason);
  }
  POLYEST_RETURN_IF_ERROR(equations_->status());
  return status;
}

absl::Status FilterBank::Advance(const FilterSamples& samples, MatrixRef innovations,
                                 MatrixRef log_variances, const Stop& stop) {
  const Eigen::Index m = samples.values.rows();
  const Eigen::Index times = std::ssize(samples.times_s);
  POLYEST_CHECK(m == std::ssize(specification_.outputs) && samples.values.cols() == times);
  POLYEST_CHECK(samples.noise.rows() == m && samples.noise.cols() == times);
  POLYEST_CHECK(innovations.rows() == members() && innovations.cols() == m * times);
  POLYEST_CHECK(log_variances.rows() == members() && log_variances.cols() == m * times);
  Begin(stop);
  return Settle(blocks_->AdvanceSamples(
      samples.times_s, [&](FilterBlock& block, Eigen::Index first, Eigen::Index count) {
        const FilterSamples stretch{
            samples.times_s.subspan(static_cast<size_t>(first), static_cast<size_t>(count)),
            samples.values.middleCols(first, count), samples.noise.middleCols(first, count)};
        return block.Advance(stretch, innovations.middleCols(first * m, count * m),
                             log_variances.middleCols(first * m, count * m), stop);
      }));
}

absl::Status FilterBank::Predict(double time_s, MatrixRef means, MatrixRef deviations,
                                 const Stop& stop) {
  Begin(stop);
  return Settle(blocks_->ForEach(
      [&](FilterBlock& block) { return block.PredictOutputs(time_s, means, deviations, stop); }));
}

void FilterBank::TakeStatesOf(const FilterBank& other) {
  POLYEST_CHECK(blocks_ && other.blocks_ && other.blocks().size() == blocks().size());
  for (size_t i = 0; i < blocks().size(); ++i) blocks()[i]->TakeStatesOf(*other.blocks()[i]);
  blocks_->CollectFailures();
  failures_ = blocks_->failures();
}

void FilterBank::StartBackward() {
  backward_ = true;
  if (!blocks_) return;
  for (const auto& block : blocks()) block->StartBackward();
}

absl::Status FilterBank::Mark(double time_s, const Stop& stop) {
  Begin(stop);
  return Settle(blocks_->ForEach([&](FilterBlock& block) { return block.Mark(time_s, stop); }));
}

void FilterBank::FinishBackward() {
  for (const auto& block : blocks()) block->FinishBackward();
}

absl::Status FilterBank::ReadMarked(size_t mark, double time_s, MatrixRef means,
                                    MatrixRef deviations) {
  for (const auto& block : blocks()) block->ReadMarked(mark, time_s, means, deviations);
  blocks_->CollectFailures();
  return Settle(absl::OkStatus());
}

void FilterBank::ReadJumpScores(size_t mark, MatrixRef scores) const {
  for (const auto& block : blocks()) block->ReadJumpScores(mark, scores);
}

// A snapshot does not hold what an FMU was initialized with.
std::optional<EnsembleState> FilterBank::State() const {
  return equations_ == nullptr ? blocks_->State() : std::nullopt;
}

bool FilterBank::Restore(const EnsembleState& state) {
  if (equations_ != nullptr || !blocks_->Restore(state)) return false;
  failures_ = blocks_->failures();
  return true;
}

void FilterBank::ReadStates(Matrix& means, Matrix& deviations) const {
  means.resize(members(), specification_.process_noise.cols());
  deviations.resizeLike(means);
  Eigen::Index row = 0;
  for (const auto& block : blocks()) {
    const GaussianStates& states = block->states();
    means.middleRows(row, states.members()) = states.mean().matrix();
    deviations.middleRows(row, states.members()) = states.Deviations().matrix();
    row += states.members();
  }
}

}  // namespace polyest::internal
