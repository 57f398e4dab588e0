#pragma once

// Synthetic test campaigns: a truth drawn from the prior, a record simulated with it, noise added.

#include <cstdint>
#include <string>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/samples.h"

namespace polyest::internal::calibration {

enum class Noise { kWhite, kUnknown, kCorrelated };
inline constexpr Noise kNoises[] = {Noise::kWhite, Noise::kUnknown, Noise::kCorrelated};
const char* NameOf(Noise noise);

// A rig: the parameters to estimate and the rows to estimate them from. The problem's noise is
// white and known.
struct Rig {
  std::string name;
  Problem problem;
  double interval_s = 0;  // from row to row
  int short_rows = 0, long_rows = 0;
};
std::vector<Rig> Rigs();

struct Campaign {
  Problem problem;
  Vector truth;  // of the uncertain parameters
  Samples record;
  Matrix signal;  // the outputs without noise, rows × channels
};

// Returns a campaign that depends on the arguments alone. Correlated noise has an unknown size and
// an unknown time constant, which is three intervals.
Campaign MakeCampaign(const Rig& rig, int rows, Noise noise, uint64_t seed);

}  // namespace polyest::internal::calibration
