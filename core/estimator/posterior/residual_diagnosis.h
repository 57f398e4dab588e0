#pragma once

// Warnings about what the residuals say: of their size, their correlation, and their scatter over
// the windows of the record.

#include <vector>

#include "core/estimator/posterior/diagnosis.h"

namespace polyest::internal {

// Appends the warnings about residuals to `diagnostics`.
void DiagnoseResiduals(const Findings& findings, const Estimate& estimate,
                       std::vector<Diagnostic>& diagnostics);

}  // namespace polyest::internal
