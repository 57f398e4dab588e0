#pragma once

// The tail of importance weights. The weights above a high threshold follow a generalized Pareto
// distribution, whose shape k tells how far they can be trusted: their variance is finite for
// k < ½, and for k > 0.7 a mean over them needs more draws than anybody has.
//
// Sources: Vehtari, Simpson, Gelman, Yao and Gabry, Pareto smoothed importance sampling, Journal of
// Machine Learning Research 25 (2024) 72; Zhang and Stephens, A new and efficient estimation method
// for the generalized Pareto distribution, Technometrics 51 (2009) 316–325.

#include <optional>

#include "core/common/types.h"

namespace polyest::internal {

// The largest shape with which importance weights can be trusted.
inline constexpr double kMaxTrustedShape = 0.7;

// Returns the shape k of the excesses x_i > 0 (at least 5, in any order) over their threshold,
// drawn towards ½ by ten excesses' weight; none if they do not vary.
std::optional<double> ParetoShape(Vector excesses);

// Returns the shape k of the largest weights' tail: of a fifth of them, or 3√D of many. Takes the
// logarithms of D weights, up to a common constant. Returns none for fewer than 25 draws, or if the
// tail does not vary.
std::optional<double> TailShape(Vector log_weights);

}  // namespace polyest::internal
