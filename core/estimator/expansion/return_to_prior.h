#pragma once

// The return of an expansion to the whole prior, with the germs' own polynomials at a higher order.
//
// A region that has moved to the posterior is a box around particles. In directions in which the
// data tell little it reaches as far as the prior's particles and its margin, to over four standard
// deviations of the prior, and in its corners in n dimensions √n times as far. In many dimensions
// most of the box lies there, where there is no posterior, and what the model does there, an
// instability for instance, spoils the fit everywhere. The germs' polynomials with points that are
// draws of the prior follow the model where the prior is dense. Where the posterior is still as
// wide as the prior in some directions, or thin and bent as that of a sum of parameters, they often
// follow the model better by orders of magnitude than polynomials of the same order over the box.
//
// So where a re-expansion in more than kFewDimensions has no other way to an accurate expansion, it
// tries the whole prior at rising orders, with check points drawn from the posterior. These are
// the judges: the first order is taken that they call good, or else the best one if it is at least
// twice as good as the present expansion. An expansion that has returned moves to a region again
// where its error grows or the posterior leans on its edges, and only if that serves.

#include <absl/status/statusor.h>

#include <memory>

#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/expansion/replay_allowance.h"

namespace polyest::internal {

// The shift (model_agreement.h) up to which an expansion is accurate at the end of a window.
inline constexpr double kAccurateShift = 0.08;
// An expansion that has returned to the prior stays there until the record has grown so much.
inline constexpr double kStay = 1.3;

// Whether the design is that of an expansion that has returned to the prior: over all of it, at an
// order above the first.
bool HasReturnedToPrior(const ResolvedProblem& problem, const ExpansionDesign& design);

// Whether the expansion is too inaccurate at its check points and may return to the prior, or, over
// the prior already, may be made again with check points where the posterior is now.
bool MayReturnToPrior(const RegionalExpansion& present, const ReexpansionRequest& request);

struct PriorReturn {
  std::unique_ptr<RegionalExpansion> expansion;  // null if none is clearly better
  int64_t propagated_rows = 0;                   // by all others that were tried
};

// Tries expansions over the whole prior after MayReturnToPrior. `particles` (W × n, germ
// coordinates) are draws of the posterior with the negative log densities `costs`. Each trial uses
// the allowance up by the record. Returns an error on a stop request or when the store cannot be
// read.
absl::StatusOr<PriorReturn> ReturnToPrior(const RegionalExpansion& present,
                                          const ReexpansionRequest& request,
                                          const Matrix& particles, const Vector& costs,
                                          ReplayAllowance& allowance, const Stop& stop);

}  // namespace polyest::internal
