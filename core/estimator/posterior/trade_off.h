#pragma once

// Parameters that the data cannot tell apart, in words an engineer uses: of two of which at least
// one is not identified, the combination that is known far better, k/m or k1 + k2.
//
// For positive parameters θ_i θ_j^q with q = ±½, ±1, ±2, by the posterior's standard deviation of
// log θ_i + q log θ_j; for any of the same unit θ_i ± θ_j. A combination is told when it is known
// ten times better than either alone.

#include <string>
#include <vector>

#include "core/bayes/identifiability.h"
#include "core/common/types.h"

namespace polyest::internal {

// thetas: draws of the posterior × n, with weights (Σ = 1). Each parameter occurs once at most, in
// the combination that is known best.
std::vector<TradeOff> FindTradeOffs(const Matrix& thetas, const Vector& weights,
                                    const std::vector<std::string>& names,
                                    const std::vector<std::string>& units,
                                    const std::vector<Verdict>& verdicts);

}  // namespace polyest::internal
