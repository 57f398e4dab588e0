#pragma once

// Re-expansion: moves the expansion to the posterior. The prior density and Ω stay unchanged; only
// the region in which the polynomial interpolates moves.
//
// A re-expansion samples the posterior on the present expansion and then moves the region as
// needed. If particles lean on an edge of the region that is not an edge of Ω, that axis is made
// wider: 1.5 times as wide where the sums are carried over, and 1.5 to 4 times, as far as the
// expansion's error allows, where the record is propagated again. If the region of the particles
// has less than half the volume of the present one, the expansion moves there and the record is
// propagated again; particles are added first at minima that the model confirms and the sampler
// overlooked (overlooked_minima.h). This repeats until neither is needed. A re-expansion that has
// widened the region does not contract it if the expansion is as good as the model: the posterior
// wanders, and would soon be at an edge again. If moving gains nothing, an expansion of automatic
// order stays in place and tries higher orders; it takes the first one that follows the model
// there, if any. Where nothing of this makes it accurate, it may return to the whole prior
// (return_to_prior.h). What the previous re-expansions tried in vain is not tried again
// (reexpansion_memory.h). Each move lowers the order by one. Where the record is long and the
// present expansion is accurate the sums are carried over instead of propagating the record, with
// the order as it is (carry_over.h), with a larger error if the record may not be propagated again
// (replay_allowance.h). The region is derived from particles and never from a minimum and its
// Hessian: in a direction that the data do not inform yet, the position of the minimum is
// arbitrary.

#include <absl/status/statusor.h>

#include <memory>

#include "core/estimator/expansion/reexpansion_memory.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/expansion/replay_allowance.h"

namespace polyest::internal {

struct ReexpansionRequest {
  const ResolvedProblem* problem = nullptr;
  const SampleStore* store = nullptr;
  int64_t rows = 0;  // rows of the store that the expansion has absorbed
  Matrix guesses;    // particles of the previous re-expansion, germ coordinates (may be empty)
  ReexpansionMemory memory;  // what the previous re-expansions have left
  uint64_t seed = 1;
  int threads = 1;
  bool may_raise_order = true;  // has an effect only if the order is automatic
  bool may_replay = true;       // whether the record may be propagated from its beginning
  ReplayAllowance allowance;    // and how many rows may be propagated again
  // Whether to end where particles have been added at minima that the sampler overlooked and the
  // expansion knows well, before it moves.
  bool ends_at_overlooked = false;
};

// How the expansion has moved, and what that has cost.
struct ExpansionMoves {
  std::unique_ptr<RegionalExpansion> expansion;  // null if the present one stays
  ReplayAllowance allowance;                     // what is left of it
  // Whether the expansion should have moved, or its order risen, and the allowance forbade it.
  bool postponed = false;
  int reexpansions = 0;
  int64_t propagated_rows = 0;  // by all expansions but the last one
};

struct Reexpansion {
  ExpansionMoves moves;
  Matrix particles;  // particles of the posterior, germ coordinates
  ReexpansionMemory memory;
  // Whether particles have been added at overlooked minima, which the expansion knows well.
  bool overlooked = false;
};

// Carries out a re-expansion. Returns an error on a stop request or when the store cannot be read;
// `present` is then unchanged and the call may be repeated.
absl::StatusOr<Reexpansion> Reexpand(const RegionalExpansion& present,
                                     const ReexpansionRequest& request, const Stop& stop);

// Goes on with a re-expansion of `present` that has ended at overlooked minima; `request` says how
// and with which seed. Returns what both have found together, or an error as Reexpand does.
absl::StatusOr<Reexpansion> ContinueReexpansion(const RegionalExpansion& present, Reexpansion begun,
                                                ReexpansionRequest request, const Stop& stop);

}  // namespace polyest::internal
