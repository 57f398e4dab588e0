#pragma once

// Warnings about what the residuals say: of their size, their correlation, and their scatter over
// the windows of the record.

#include <vector>

#include "core/estimator/posterior/diagnosis.h"
#include "core/estimator/record/suspicious_data.h"

namespace polyest::internal {

// Returns what the estimate says of each output's samples; nothing before the first row.
std::vector<ChannelFit> FitsOf(const Findings& findings, const Estimate& estimate);

// Appends the warnings about residuals to `diagnostics`.
void DiagnoseResiduals(const Findings& findings, const Estimate& estimate,
                       std::vector<Diagnostic>& diagnostics);

}  // namespace polyest::internal
