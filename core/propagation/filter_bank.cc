#include "core/propagation/filter_bank.h"

#include <algorithm>
#include <utility>

#include "core/common/check.h"
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
    : specification_(WithProcessNoise(std::move(specification))),
      blocks_(MakeBlocks(inputs), specification_.threads,
              specification_.integration.samples_between_checkpoints) {}

std::vector<std::unique_ptr<FilterBlock>> FilterBank::MakeBlocks(const InputSignals* inputs) const {
  std::vector<std::unique_ptr<FilterBlock>> blocks;
  const bool exact = StepsExactly(specification_, *inputs);
  const int most = FilterBlock::Members(specification_.process_noise.cols());
  for (int first = 0; first < members(); first += most) {
    const int count = std::min(most, members() - first);
    blocks.push_back(std::make_unique<FilterBlock>(specification_, inputs, first, count, exact));
  }
  return blocks;
}

absl::Status FilterBank::Advance(const FilterSamples& samples, MatrixRef innovations,
                                 MatrixRef log_variances, const Stop& stop) {
  const Eigen::Index m = samples.values.rows();
  const Eigen::Index times = std::ssize(samples.times_s);
  POLYEST_CHECK(m == std::ssize(specification_.outputs) && samples.values.cols() == times);
  POLYEST_CHECK(samples.noise.rows() == m && samples.noise.cols() == times);
  POLYEST_CHECK(innovations.rows() == members() && innovations.cols() == m * times);
  POLYEST_CHECK(log_variances.rows() == members() && log_variances.cols() == m * times);
  return blocks_.AdvanceSamples(
      samples.times_s, [&](FilterBlock& block, Eigen::Index first, Eigen::Index count) {
        const FilterSamples stretch{
            samples.times_s.subspan(static_cast<size_t>(first), static_cast<size_t>(count)),
            samples.values.middleCols(first, count), samples.noise.middleCols(first, count)};
        return block.Advance(stretch, innovations.middleCols(first * m, count * m),
                             log_variances.middleCols(first * m, count * m), stop);
      });
}

absl::Status FilterBank::Predict(double time_s, MatrixRef means, MatrixRef deviations,
                                 const Stop& stop) {
  return blocks_.ForEach(
      [&](FilterBlock& block) { return block.PredictOutputs(time_s, means, deviations, stop); });
}

void FilterBank::TakeStatesOf(const FilterBank& other) {
  const auto& theirs = other.blocks_.blocks();
  POLYEST_CHECK(theirs.size() == blocks_.blocks().size());
  for (size_t i = 0; i < theirs.size(); ++i) blocks_.blocks()[i]->TakeStatesOf(*theirs[i]);
  blocks_.CollectFailures();
}

void FilterBank::StartBackward() {
  for (const auto& block : blocks_.blocks()) block->StartBackward();
}

absl::Status FilterBank::Mark(double time_s, const Stop& stop) {
  return blocks_.ForEach([&](FilterBlock& block) { return block.Mark(time_s, stop); });
}

void FilterBank::FinishBackward() {
  for (const auto& block : blocks_.blocks()) block->FinishBackward();
}

void FilterBank::ReadMarked(size_t mark, double time_s, MatrixRef means, MatrixRef deviations) {
  for (const auto& block : blocks_.blocks()) block->ReadMarked(mark, time_s, means, deviations);
  blocks_.CollectFailures();
}

void FilterBank::ReadStates(Matrix& means, Matrix& deviations) const {
  means.resize(members(), specification_.process_noise.cols());
  deviations.resizeLike(means);
  Eigen::Index row = 0;
  for (const auto& block : blocks_.blocks()) {
    const GaussianStates& states = block->states();
    means.middleRows(row, states.members()) = states.mean().matrix();
    deviations.middleRows(row, states.members()) = states.Deviations().matrix();
    row += states.members();
  }
}

}  // namespace polyest::internal
