#pragma once

// The Gaussian summary of a distribution of germs: its mean and covariance.

#include "core/common/types.h"

namespace polyest::internal {

// Mean (n) and covariance (n × n) of germs.
struct GermSummary {
  Vector mean;
  Matrix covariance;
};

// Returns those of particles (W × n, W ≥ 1, equally weighted; any coordinates), m = Σ x_i/W and
// Σ (x_i − m)(x_i − m)ᵀ/W.
GermSummary SummaryOf(const Matrix& particles);

// Returns a factor F of a covariance, F Fᵀ = covariance (n × n): its eigenvectors times the square
// roots of its eigenvalues, those below 0 by rounding taken for 0.
Matrix FactorOf(const Matrix& covariance);

}  // namespace polyest::internal
