#include "core/propagation/newton_matrix.h"

#include <cmath>
#include <limits>

namespace polyest::internal {

NewtonMatrix::NewtonMatrix(BlockSystem* system)
    : system_(system),
      jacobian_(system->points(), system->states() * system->states()),
      moved_(system->points(), system->states()),
      rates_(system->points(), system->states()),
      moved_rates_(system->points(), system->states()),
      lu_(system->points(), system->states()) {}

void NewtonMatrix::Differentiate(double time_s, const Eigen::ArrayXXd& states,
                                 const ErrorScale& scale) {
  // A derivative may be infinite where the function is finite, as that of √x at 0.
  const bool exact =
      system_->StateJacobian(time_s, states, jacobian_) && jacobian_.isFinite().all();
  if (!exact) TakeDifferences(time_s, states, scale);
}

void NewtonMatrix::TakeDifferences(double time_s, const Eigen::ArrayXXd& states,
                                   const ErrorScale& scale) {
  const Eigen::Index count = states.cols();
  const double root_epsilon = std::sqrt(std::numeric_limits<double>::epsilon());
  system_->Derivatives(time_s, states, rates_);
  moved_ = states;
  for (Eigen::Index s = 0; s < count; ++s) {
    moved_.col(s) += root_epsilon * states.col(s).abs().max(scale.SizeOf(s));
    system_->Derivatives(time_s, moved_, moved_rates_);
    // ∂f/∂x_s ≈ (f(x + δ e_s) − f(x))/δ, where δ is the difference that remains after rounding of
    // the sum.
    for (Eigen::Index i = 0; i < count; ++i) {
      jacobian_.col(s * count + i) =
          (moved_rates_.col(i) - rates_.col(i)) / (moved_.col(s) - states.col(s));
    }
    moved_.col(s) = states.col(s);
  }
}

void NewtonMatrix::Factor(double gamma) {
  const Eigen::Index count = rates_.cols();
  for (Eigen::Index s = 0; s < count; ++s) {
    for (Eigen::Index i = 0; i < count; ++i) {
      lu_.Set(i, s, (i == s ? 1.0 : 0.0) - gamma * jacobian_.col(s * count + i));
    }
  }
  lu_.Factor();
}

}  // namespace polyest::internal
