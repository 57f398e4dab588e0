#pragma once

// Takes the sums of an expansion over to another region, so that the record need not be propagated
// again.
//
// Problem: an expansion has absorbed N samples, y_k = c_kᵀφ(η) + error, and moves to another region
// η′. Polynomials of total degree are closed under affine maps: φ(η(η′)) = Tᵀφ′(η′) exactly. So the
// sums by φ are sums by φ′ (MismatchSums::Substituted),
//
//   G′ = T G Tᵀ,   b′ = T (b − G δ),   w′ = w − 2 bᵀδ + δᵀG δ,   δ = Tᵀφ′_0 − φ_0,
//
// and so are those of windows of the record, of differences, and of control trajectories. They are
// taken as they were after the state that the expansion keeps (at most about one checkpoint ago);
// the rows since then are propagated. The new trajectories begin there in states that the old ones
// give: polynomials fitted to the states of the collocation points.
//
// What is lost is measured. The sums keep the error of the old expansion, which bounds the shift of
// a posterior mean in its standard deviations by √(Σ ρ_k/R_k) (model_agreement.h); where the new
// region reaches beyond the old one, an error of degree p + 1 grows as reach^(p+1). What the
// states' error does to the outputs is seen in the rows since: the old check points, which no
// polynomial was fitted to, are propagated once more from there, from their own states and from
// those that the polynomials give. The mean square of the difference in units of the noise is the
// rate at which each sample adds to Σ ρ_k/R_k while the run goes on. The shift that all this allows
// at all samples so far, together with what earlier moves have left, is limited to
// kMaxCarriedShift, and remains part of the expansion's own error.
//
// Where the likelihood is that of prediction errors, the sums of the log variances l become T l,
// and the states that are interpolated are the filters' means and the factors of their covariances.
// The innovations and their log variances forget them, so that the rate above is an upper bound.
//
// Not carried over: hyperbolic truncation, and less than the present order, under which the map is
// not exact; records with runs that have been eliminated; trajectories that failed; noise whose
// time constant is being learned, because its likelihood is linearized; states with switches that
// have modes of their own; and, inside a run, states of which too few rows have been propagated
// since to judge them.

#include <absl/status/statusor.h>

#include <memory>

#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// Largest shift, in posterior standard deviations, that sums taken over may cause.
inline constexpr double kMaxCarriedShift = 0.005;

// A record of so many rows is propagated again instead, which leaves no error.
inline int64_t RowsOfShortRecord(const ResolvedProblem& problem) {
  constexpr int64_t kCheckpoints = 4;
  return kCheckpoints * problem.problem().integration.samples_between_checkpoints;
}

// Returns an expansion of the design that has absorbed the first `rows` rows of the store, as
// `present` has. Returns InfeasibleError where the error might shift the posterior by more than
// `max_shift` of its standard deviations or the case is one of the above; the record must then be
// propagated from its beginning.
absl::StatusOr<std::unique_ptr<RegionalExpansion>> CarryOver(const ResolvedProblem& problem,
                                                             const RegionalExpansion& present,
                                                             const ExpansionDesign& design,
                                                             const SampleStore& store, int64_t rows,
                                                             int threads, const Stop& stop,
                                                             double max_shift = kMaxCarriedShift);

// Returns how many rows CarryOver propagates at most, 0 if it cannot.
int64_t RowsToCarryOver(const RegionalExpansion& present, int64_t rows);

// Returns the expansion `present` as it was after the first `rows` rows of the store, at or after
// the state that it keeps; from the record's beginning if it keeps none.
absl::StatusOr<std::unique_ptr<RegionalExpansion>> Restored(const RegionalExpansion& present,
                                                            const ResolvedProblem& problem,
                                                            const SampleStore& store, int64_t rows,
                                                            int threads, const Stop& stop);

}  // namespace polyest::internal
