#include "core/propagation/ensemble_points.h"

#include <algorithm>

#include "core/propagation/block_rows.h"
#include "core/propagation/filter_block.h"
#include "core/propagation/trajectory_block.h"

namespace polyest::internal {

bool AreSmooth(const EnsembleState& ensemble) {
  return std::ranges::all_of(ensemble.blocks, [](const EnsembleState::OfBlock& block) {
    return block.modes.cols() == 0 && std::ranges::count(block.alive, false) == 0;
  });
}

Matrix StatesOf(const EnsembleState& ensemble) {
  Eigen::Index points = 0;
  for (const auto& block : ensemble.blocks) points += std::ssize(block.alive);
  Matrix states(points, ensemble.blocks.empty() ? 0 : ensemble.blocks.front().states.cols());
  Eigen::Index first = 0;
  for (const auto& block : ensemble.blocks) {
    const Eigen::Index count = std::ssize(block.alive);
    states.middleRows(first, count) = block.states.topRows(count).matrix();
    first += count;
  }
  return states;
}

EnsembleState WithStates(const EnsembleState& ensemble, const ConstMatrixRef& states) {
  EnsembleState other{.samples = ensemble.samples, .time_s = ensemble.time_s, .blocks = {}};
  const auto stiff = [](const EnsembleState::OfBlock& block) { return block.stiff; };
  const int points = static_cast<int>(states.rows());
  for (int first = 0; first < points; first += TrajectoryBlock::kPoints) {
    EnsembleState::OfBlock& block = other.blocks.emplace_back();
    const int count = std::min(TrajectoryBlock::kPoints, points - first);
    block.source = PaddedRows(count);
    block.alive.assign(static_cast<size_t>(count), true);
    block.states.resize(std::ssize(block.source), states.cols());
    for (Eigen::Index row = 0; row < block.states.rows(); ++row) {
      block.states.row(row) = states.row(first + block.source[static_cast<size_t>(row)]).array();
    }
    block.modes.resize(block.states.rows(), 0);
    block.stiff = std::ranges::any_of(ensemble.blocks, stiff);
    block.last_break_s = ensemble.blocks.front().last_break_s;
  }
  return other;
}

// The columns of a filter block's states are the states of its points, then the means and the
// factors of its members, in their first rows (FilterBlock::State). Point s · members + i is the
// s-th of member i; a filter draws its points anew before it uses them.
Matrix GaussiansOf(const EnsembleState& filters, Eigen::Index states) {
  const auto members_of = [&](const EnsembleState::OfBlock& block) {
    return std::ssize(block.alive) / (2 * states);
  };
  Eigen::Index members = 0;
  for (const auto& block : filters.blocks) members += members_of(block);
  Matrix gaussians(members, states + states * (states + 1) / 2);
  Eigen::Index first = 0;
  for (const auto& block : filters.blocks) {
    const Eigen::Index count = members_of(block);
    gaussians.middleRows(first, count) =
        block.states.topRows(count).rightCols(gaussians.cols()).matrix();
    first += count;
  }
  return gaussians;
}

EnsembleState WithGaussians(const EnsembleState& filters, Eigen::Index states,
                            const ConstMatrixRef& gaussians) {
  EnsembleState other{.samples = filters.samples, .time_s = filters.time_s, .blocks = {}};
  const auto stiff = [](const EnsembleState::OfBlock& block) { return block.stiff; };
  const Eigen::Index members = gaussians.rows(), most = FilterBlock::Members(states);
  for (Eigen::Index first = 0; first < members; first += most) {
    EnsembleState::OfBlock& block = other.blocks.emplace_back();
    const Eigen::Index count = std::min(most, members - first);
    const auto points = static_cast<int>(2 * states * count);
    block.source = PaddedRows(points);
    block.alive.assign(static_cast<size_t>(points), true);
    block.states.setZero(std::ssize(block.source), states + gaussians.cols());
    for (Eigen::Index row = 0; row < block.states.rows(); ++row) {
      const Eigen::Index member = first + block.source[static_cast<size_t>(row)] % count;
      block.states.row(row).head(states) = gaussians.row(member).head(states).array();
    }
    block.states.topRows(count).rightCols(gaussians.cols()) =
        gaussians.middleRows(first, count).array();
    block.modes.resize(block.states.rows(), 0);
    block.stiff = std::ranges::any_of(filters.blocks, stiff);
    block.last_break_s = filters.blocks.front().last_break_s;
  }
  return other;
}

}  // namespace polyest::internal
