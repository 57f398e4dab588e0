#pragma once

// Re-expansion: moving the expansion to where the posterior is. The prior density and Ω stay the
// original ones; only the region in which the polynomial interpolates moves.
//
// One settlement: sample the posterior on the present expansion; where the particles lean on an
// edge of the region that is not Ω's, widen that axis and propagate the record again; where the
// region of the particles is less than half of the present one, move there and propagate again;
// repeat until neither is needed. Where nothing is gained by moving, an expansion of automatic
// order stays and gets as many orders more as follow the model there, if any do; with every move it
// gives one back. The region comes from particles and never from a minimum and its Hessian: in a
// direction not yet informed the minimum sits anywhere.

#include <absl/status/statusor.h>

#include <memory>
#include <optional>

#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

struct SettleRequest {
  const ResolvedProblem* problem = nullptr;
  const SampleStore* store = nullptr;
  int64_t rows = 0;  // of the store that the expansion has absorbed
  Matrix guesses;    // particles of the settlement before, germ coordinates (may be none)
  uint64_t seed = 1;
  int threads = 1;
  bool may_raise_order = true;  // where the order is automatic
};

struct Settlement {
  std::unique_ptr<RegionalExpansion> expansion;  // null: the present one stays
  Matrix particles;                              // of the posterior, germ coordinates
  int reexpansions = 0;
  int64_t propagated_rows = 0;  // by all but the expansion returned
};

// Not OK on a stop request or when the store cannot be read; `present` is then untouched and the
// same call may be made again.
absl::StatusOr<Settlement> Settle(const RegionalExpansion& present, const SettleRequest& request,
                                  const Stop& stop);

// An expansion of the design that has absorbed the first `rows` rows of the store.
// FAILED_PRECONDITION when it cannot be factored or too few trajectories are left.
absl::StatusOr<std::unique_ptr<RegionalExpansion>> Replay(const ResolvedProblem& problem,
                                                          ExpansionDesign design,
                                                          LearnedNoise noise,
                                                          const SampleStore& store, int64_t rows,
                                                          int threads, const Stop& stop);

// How far the posterior on the expansion may be trusted, from the check points. To first order a
// posterior mean is off, in units of its standard deviation, by no more than either of
//   the standard deviation over the posterior of ΔJ = J_mismatch of the model − of the expansion
//   (at the expansion's lag-1 correlation, where that enters),
//   ‖(model − expansion)/σ‖ over the samples,
// both by the Cauchy–Schwarz inequality, over particles and over samples. The first is the sharper
// but needs check points where the posterior is; the second holds wherever they are.
struct Agreement {
  double shift = 0;  // the smaller bound that may be used; ≥ 0
  // Mean of ΔJ over the posterior, where the check points tell it to 0.25: what the expansion's own
  // error, the discount included, has made of the cost's height.
  std::optional<double> mean_difference;
  double residual_to_noise = 0;  // worst root mean square over the check points that still matter
};

Agreement AgreementWithModel(const RegionalExpansion& expansion, const Cost& cost);

}  // namespace polyest::internal
