#include "core/estimator/studies/sample_choice.h"

#include <algorithm>

#include "core/bayes/weighted_samples.h"

namespace polyest::internal {
namespace {

using Rows = std::vector<Eigen::Index>;

std::vector<Rows> DrawsByGroup(const Eigen::VectorXi& groups) {
  if (groups.size() == 0) return {};
  std::vector<Rows> draws(static_cast<size_t>(groups.maxCoeff() + 1));
  for (Eigen::Index draw = 0; draw < groups.size(); ++draw) {
    draws[static_cast<size_t>(groups[draw])].push_back(draw);
  }
  return draws;
}

}  // namespace

SampleChoice ChooseSamples(const ConstVectorRef& weights, const Eigen::VectorXi& groups,
                           int count) {
  const std::vector<Rows> draws = DrawsByGroup(groups);
  const int group_count = static_cast<int>(draws.size());
  const double half_share = weights.sum() / group_count / 2;
  const auto is_light = [&](const Rows& rows) { return weights(rows).sum() < half_share; };
  if (draws.empty() || std::ranges::any_of(draws, is_light)) {
    return {.draws = StratifiedDraws(weights, count), .groups = {}};
  }
  SampleChoice choice;
  for (int group = 0; group < group_count; ++group) {
    const Rows& rows = draws[static_cast<size_t>(group)];
    const int own = count / group_count + (group < count % group_count ? 1 : 0);
    for (const Eigen::Index row : StratifiedDraws(weights(rows), own)) {
      choice.draws.push_back(rows[static_cast<size_t>(row)]);
      choice.groups.push_back(group);
    }
  }
  return choice;
}

}  // namespace polyest::internal
