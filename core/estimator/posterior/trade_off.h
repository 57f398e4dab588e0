#pragma once

// Finds parameters that the data cannot tell apart. For two parameters of which at least one is not
// identified, it finds the combination that is known far better, such as k/m or k1 + k2.
//
// For positive parameters the combinations are θ_i θ_j^q with q = ±½, ±1, ±2, judged by the
// posterior's standard deviation of log θ_i + q log θ_j. For any two of the same unit they are θ_i
// ± θ_j. A combination is reported when it is known ten times better than either parameter alone.

#include <string>
#include <vector>

#include "core/bayes/identifiability.h"
#include "core/common/types.h"

namespace polyest::internal {

// Returns the trade-offs. `thetas` holds draws of the posterior (draws × n), with weights (Σ = 1).
// Each parameter occurs at most once, in the combination that is known best.
std::vector<TradeOff> FindTradeOffs(const Matrix& thetas, const Vector& weights,
                                    const std::vector<std::string>& names,
                                    const std::vector<std::string>& units,
                                    const std::vector<Verdict>& verdicts);

}  // namespace polyest::internal
