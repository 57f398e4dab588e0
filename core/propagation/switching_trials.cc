// Judges the steps that rows have on trial, locates switchings in them and goes on beyond.

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/propagation/switching_integrator.h"

namespace polyest::internal {

double SwitchingIntegrator::Resolution(const RowProgress& row) const {
  return 16 * std::numeric_limits<double>::epsilon() * std::max(std::abs(row.end_s), span_s_);
}

// Returns the error of the step on trial in units of the tolerance.
double SwitchingIntegrator::ErrorOf(Eigen::Index row) {
  const double length_s = row_of(row).trial_s;
  double norm = 0;
  for (Eigen::Index s = 0; s < end_.cols(); ++s) {
    const double scale = std::max(1 / scale_.weights()(row, s),
                                  relative_tolerance_ * std::abs(steps_.ends()(row, s)));
    const double error = std::abs(steps_.Error(row, s, length_s)) / scale;
    norm = std::max(norm, error < ErrorScale::kHuge ? error : ErrorScale::kHuge);
  }
  return norm;
}

// Whether the step on trial leads from a switching to a stop that follows within the resolution of
// the time. What is seen of its errors and of the switch that was just left is rounding error.
bool SwitchingIntegrator::IsRounding(Eigen::Index row) {
  const RowProgress& at = row_of(row);
  return at.hits_stop && at.trial_s <= Resolution(at) && at.switched_s == at.end_s &&
         steps_.ends().row(row).isFinite().all();
}

void SwitchingIntegrator::JudgeFull(Eigen::Index row) {
  RowProgress& at = row_of(row);
  constexpr int kMaxRejectionsByLook = 8;
  const double error = ErrorOf(row);
  double look_error = error > 1 ? 0 : looks_.Error(row);
  if (at.rejections_by_look >= kMaxRejectionsByLook) look_error = std::min(look_error, 1.0);
  const double worst = std::max(error, look_error);
  const double factor = std::clamp(0.9 * std::pow(worst, -0.2), 0.2, 5.0);
  const double length_s = at.trial_s;
  const bool rounding = IsRounding(row);
  if (!(worst <= 1) && !rounding) {
    at.next_s = length_s * std::min(factor, 0.9);
    at.rejections_by_look += error <= 1 ? 1 : 0;
    looks_.Undo(row);
    if (at.next_s <= Resolution(at) / 16 && !LeaveAtEdge(row)) Fail(row, kNoStep);
    return;
  }
  at.rejections_by_look = 0;
  const Crossing crossing = looks_.FirstLeft(row, at.which, at.upwards);
  if (!crossing.found || (rounding && switched_.Departing(row, at.which) != 0)) {
    NoteStiffness(row, length_s);
    at.next_s = at.hits_stop ? std::max(at.next_s, length_s * factor) : length_s * factor;
    return Accept(row, length_s, at.hits_stop);
  }
  looks_.Undo(row);
  at.full_s = length_s;
  at.trial_s = crossing.theta * length_s;
  at.next_s = std::min(length_s, length_s * factor);
  switched_.ArgumentErrors(row, at.end_s, end_, relative_tolerance_, scale_.weights(), tolerance_);
  // A row that leaves at once has rested at the surface. In a step of the time's own resolution the
  // way that it goes could not be told from rounding errors.
  if (at.trial_s <= Resolution(at)) return Switch(row);
  // What comes after the switching may be as short as what came before.
  constexpr double kMaxGrowth = 32;
  at.next_s = std::min(at.next_s, std::max(kMaxGrowth * at.trial_s, Resolution(at)));
  at.locating = true;
  at.secants = 0;
  at.slope = crossing.slope / length_s;
}

// Takes the row off a piece that ends where it is, as the root of a level does at 0, so that no
// step of any length can end beyond. Returns false if no argument is at the edge of its piece.
bool SwitchingIntegrator::LeaveAtEdge(Eigen::Index row) {
  RowProgress& at = row_of(row);
  switched_.ArgumentErrors(row, at.end_s, end_, relative_tolerance_, scale_.weights(), tolerance_);
  for (Eigen::Index i = 0; i < tolerance_.cols(); ++i) {
    if (switched_.modes().sliding(row, i) || switched_.IsHeld(row, i)) continue;
    for (const bool up : {false, true}) {
      if (!(std::abs(looks_.OutsideAtEnd(row, i, up)) <= tolerance_(row, i))) continue;
      at.which = i;
      at.upwards = up;
      at.next_s = span_s_ / 64;
      Switch(row);
      return true;
    }
  }
  return false;
}

// Improves the length of the step to the switching, or accepts it.
void SwitchingIntegrator::JudgeLocating(Eigen::Index row) {
  RowProgress& at = row_of(row);
  constexpr int kMaxSecants = 8;
  const double value = looks_.OutsideAtEnd(row, at.which, at.upwards);
  constexpr double kPartOfTolerance = 1e-4;
  const double tolerance =
      switched_.modes().sliding(row, at.which) ? relative_tolerance_ : tolerance_(row, at.which);
  if (at.secants > 0) at.slope = (value - at.before_value) / (at.trial_s - at.before_s);
  const double improved_s = at.trial_s - value / at.slope;
  const bool better = std::abs(value) > kPartOfTolerance * tolerance && at.secants < kMaxSecants &&
                      improved_s > 0 && improved_s <= at.full_s &&
                      std::abs(improved_s - at.trial_s) > Resolution(at) / 16;
  if (better) {
    at.before_s = at.trial_s;
    at.before_value = value;
    at.trial_s = improved_s;
    ++at.secants;
    looks_.Undo(row);
    return;
  }
  at.locating = false;
  Accept(row, at.trial_s, at.hits_stop && at.trial_s == at.full_s);
  Switch(row);
}

// Makes the step on trial the last step.
void SwitchingIntegrator::Accept(Eigen::Index row, double length_s, bool hits_stop) {
  RowProgress& at = row_of(row);
  at.begin_s = at.end_s;
  at.end_s = hits_stop ? last_stop_s_ : at.begin_s + length_s;
  at.length_s = length_s;
  ++at.steps;
  begin_.row(row) = end_.row(row);
  end_.row(row) = steps_.ends().row(row);
  for (size_t i = 0; i < stages_.size(); ++i) stages_[i].row(row) = steps_.stages()[i].row(row);
  step_modes_.values.row(row) = switched_.modes().values.row(row);
  step_modes_.sliding.row(row) = switched_.modes().sliding.row(row);
  first_rates_.row(row) = stages_.back().row(row);
  switched_.ForgetDeparture(row);
  if (!switched_.IsSliding(row)) return;
  switched_.Project(row, at.end_s, scale_.weights(), end_);
  switched_.RatesOfRow(row, at.end_s, end_, first_rates_);
}

// Lets the row go on beyond the switching at the end of its last step.
void SwitchingIntegrator::Switch(Eigen::Index row) {
  RowProgress& at = row_of(row);
  constexpr int kMaxSwitchings = 10'000;
  const int max_stalled = 20 + 4 * static_cast<int>(switched_.switches());
  at.stalled = at.end_s - at.switched_s <= Resolution(at) ? at.stalled + 1 : 0;
  at.switched_s = at.end_s;
  if (at.stalled > max_stalled) return Fail(row, kEndless);
  if (++at.switchings > kMaxSwitchings) return Fail(row, kTooManySwitchings);
  switched_.ArgumentErrors(row, at.end_s, end_, relative_tolerance_, scale_.weights(), tolerance_);
  if (!switched_.Leave(row, at.end_s, end_, at.which, at.upwards, tolerance_)) {
    return Fail(row, kContradiction);
  }
  switched_.Project(row, at.end_s, scale_.weights(), end_, at.which);
  switched_.RatesOfRow(row, at.end_s, end_, first_rates_);
  looks_.Begin(row, at.end_s, end_);
  RenewFloors();
}

// Counts the steps that stability limits: h |λ| ≈ h |f(x_7) − f(x_6)| ÷ |x_7 − x_6|, where x_6 and
// x_7 are two approximations at the end of the step.
void SwitchingIntegrator::NoteStiffness(Eigen::Index row, double length_s) {
  double rates = 0, states = 0;
  for (Eigen::Index s = 0; s < end_.cols(); ++s) {
    const double w = scale_.weights()(row, s);
    rates = std::max(rates, w * std::abs(steps_.stages()[6](row, s) - steps_.stages()[5](row, s)));
    states = std::max(states, w * std::abs(steps_.ends()(row, s) - steps_.near_ends()(row, s)));
  }
  // On the negative real axis the method is stable for h |λ| ≤ 3.3.
  constexpr double kNearTheLimit = 3;
  if (length_s * rates > kNearTheLimit * states) ++row_of(row).stiff_steps;
}

}  // namespace polyest::internal
