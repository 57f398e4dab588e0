#pragma once

// Bisection of an element whose expansion does not follow the model (multi-element polynomial
// chaos). The element is cut across the axis of its region along which the expansion's terms of the
// highest degrees weigh most: there the polynomials have run out first, and half the width reduces
// their error by 2^(p+1). Where they have run out so far that the terms say nothing of the model,
// the cut is across the germ that the model is least linear in (least_linear.h).

#include <optional>
#include <vector>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/posterior/posterior_pieces.h"

namespace polyest::internal {

// Whether the terms say on which axis the outputs depend. If the outputs vary too fast for the
// order, least squares spreads them over all terms, and their weights are those of chance.
bool HasTermsOfTheModel(const RegionalExpansion& expansion);

// Returns the two halves of the expansion's element, cut across the germ or, without one, as the
// terms say. `particles` (W × n, germ coordinates; may be empty) are of its posterior. If nothing
// has been absorbed, the cut separates the trajectories that could be integrated from those that
// could not.
std::vector<Piece> Bisect(const RegionalExpansion& expansion, std::optional<Eigen::Index> germ,
                          const Matrix& particles);

}  // namespace polyest::internal
