#include "core/propagation/error_floors.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

// Returns the largest magnitude, without values that are not finite; 0 if there is none.
double LargestFinite(const Eigen::Ref<const Eigen::ArrayXd>& values) {
  double largest = 0;
  for (const double value : values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

}  // namespace

ErrorFloors::ErrorFloors(BlockSystem* system, ErrorScale* scale)
    : system_(system),
      scale_(scale),
      first_rates_(system->points(), system->states()),
      moved_states_(system->points(), system->states()),
      moved_rates_(system->points(), system->states()) {}

double ErrorFloors::FirstStep(double time_s, const Eigen::ArrayXXd& states, double span_s) {
  system_->Derivatives(time_s, states, first_rates_);
  double step_s = span_s / 64;
  for (Eigen::Index s = 0; s < first_rates_.cols(); ++s) {
    const double rate = first_rates_.col(s).abs().maxCoeff();
    const double candidate_s = 0.01 * scale_->block_scale(s) / rate;
    if (std::isfinite(candidate_s) && candidate_s > 0) step_s = std::min(step_s, candidate_s);
  }
  return step_s;
}

Vector ErrorFloors::ExpectedSizes(double time_s, const Eigen::ArrayXXd& states, double span_s) {
  Vector expected = Vector::Zero(states.cols());
  // One pass finds what an input moves, the next what that moves in turn, and so on to the end of
  // the longest chain.
  constexpr double kOnTheWay[] = {0, 0.25, 0.5, 0.75, 1};
  for (Eigen::Index pass = 0; pass <= states.cols(); ++pass) {
    moved_states_ = states.rowwise() + expected.transpose().array();
    const Vector before = expected;
    for (const double share : kOnTheWay) {
      system_->Derivatives(time_s + share * span_s, moved_states_, moved_rates_);
      for (Eigen::Index s = 0; s < states.cols(); ++s) {
        if (scale_->block_scale(s) > 0 || before(s) > 0) continue;
        expected(s) = std::max(expected(s), span_s * LargestFinite(moved_rates_.col(s)));
      }
    }
    if (expected == before) break;
  }
  return expected;
}

void ErrorFloors::Update(double time_s, const Eigen::ArrayXXd& states, double step_s,
                         double span_s) {
  constexpr double kLonger = 4;
  if (!scale_->NeedsFloors() && step_s <= kLonger * step_s_) return;
  step_s_ = step_s;
  const Vector expected = ExpectedSizes(time_s, states, span_s);
  const double root_epsilon = std::sqrt(std::numeric_limits<double>::epsilon());
  system_->Derivatives(time_s, states, first_rates_);
  // The shares of the states differ, so that their effects do not cancel.
  for (Eigen::Index s = 0; s < states.cols(); ++s) {
    const double share = 1 - 0.5 * std::abs(std::sin(static_cast<double>(s)));
    moved_states_.col(s) =
        states.col(s) + root_epsilon * share * std::max(scale_->block_scale(s), expected(s));
  }
  system_->Derivatives(time_s, moved_states_, moved_rates_);
  moved_rates_ = first_rates_.abs() + (moved_rates_ - first_rates_).abs() / root_epsilon;
  Vector changes(states.cols());
  for (Eigen::Index s = 0; s < states.cols(); ++s) {
    changes(s) = step_s * LargestFinite(moved_rates_.col(s));
  }
  scale_->SetFloors(changes, expected);
}

}  // namespace polyest::internal
