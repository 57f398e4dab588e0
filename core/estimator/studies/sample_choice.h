#pragma once

// Chooses, from weighted draws of a posterior, samples that all have the same weight.

#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

struct SampleChoice {
  std::vector<Eigen::Index> draws;  // the draw that each sample is; a heavy one may come twice
  // The group of Markov chains of each sample, in increasing order; empty where none is told.
  std::vector<int> groups;
};

// Chooses `count` samples. `weights` ≥ 0 and `groups` ≥ 0 are the draws'; `groups` is empty without
// Markov chains. Of groups of chains, as many samples are chosen from each as from the others, to
// within one. Where a group has less than half of its share of the weight, such samples would be
// none of the posterior: they are then chosen regardless of groups.
SampleChoice ChooseSamples(const ConstVectorRef& weights, const Eigen::VectorXi& groups, int count);

}  // namespace polyest::internal
