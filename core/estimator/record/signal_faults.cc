#include "core/estimator/record/signal_faults.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

// Returns the largest step that may be seen beside a plateau of so many samples at a peak whose
// samples are rounded to multiples of `rounding`. A parabola c k² that stays within one multiple
// over L samples, c (L/2)² = rounding, has steps of c (L + 1) beside them; twice that is allowed.
double StepBesidePeak(int64_t length, double rounding) {
  const auto samples = static_cast<double>(length);
  return 8 * (samples + 1) / (samples * samples) * rounding;
}

}  // namespace

void SignalFaults::Add(double value) {
  if (samples_ == 0) {
    entry_ = 0;
    length_ = 1;
    value_ = value;
    samples_ = 1;
    return;
  }
  ++samples_;
  const double step = std::abs(value - value_);
  if (step == 0) {
    steps_.Add(step);
    ++length_;
    return;
  }
  smallest_step_ = std::min(smallest_step_, step);
  EndOfEqualSamples(value);
  steps_.Add(step);
  entry_ = value - value_;
  value_ = value;
  length_ = 1;
}

void SignalFaults::EndOfEqualSamples(double next) {
  const double exit = next - value_;
  const double smaller = std::min(std::abs(entry_), std::abs(exit));
  // There and back: what remains is small beside either jump.
  if (length_ <= kLongestDropout && 2 * std::abs(entry_ + exit) < smaller &&
      smaller > SmallestJump()) {
    AddExcursion();
  }
  AddExtreme(length_ >= kShortestPlateau &&
             std::max(std::abs(entry_), std::abs(exit)) > StepBesidePeak(length_, smallest_step_));
}

// The vote of Boyer and Moore (1981): if most excursions end at one value, it is the candidate in
// the end.
void SignalFaults::AddExcursion() {
  ++excursions_;
  if (votes_ == 0) candidate_ = {value_, 0};
  if (value_ == candidate_.value) {
    ++votes_;
    ++candidate_.count;
  } else {
    --votes_;
  }
}

void SignalFaults::AddExtreme(bool is_plateau) {
  if (value_ > upper_.value) upper_ = {value_, 0};
  if (value_ < lower_.value) lower_ = {value_, 0};
  if (!is_plateau) return;
  ++plateaus_;
  if (value_ == upper_.value) ++upper_.count;
  if (value_ == lower_.value) ++lower_.count;
}

RecurringValue SignalFaults::Dropouts() const {
  return candidate_.count > excursions_ - candidate_.count ? candidate_ : RecurringValue();
}

RecurringValue SignalFaults::OfExtremes(const RecurringValue& extreme) const {
  const auto at_extremes = static_cast<double>(upper_.count) + static_cast<double>(lower_.count);
  return 2 * at_extremes >= static_cast<double>(plateaus_) ? extreme : RecurringValue();
}

double SignalFaults::ShareOfChanges() const {
  const int64_t all = steps_.count();
  return all == 0 ? 1 : static_cast<double>(steps_.CountAbove(0)) / static_cast<double>(all);
}

bool SignalFaults::IsConsistent() const {
  return samples_ >= 0 && length_ >= 0 && excursions_ >= 0 && votes_ >= 0 &&
         candidate_.count >= 0 && candidate_.count <= excursions_ && plateaus_ >= 0 &&
         upper_.count >= 0 && upper_.count <= plateaus_ && lower_.count >= 0 &&
         lower_.count <= plateaus_ && smallest_step_ > 0 && steps_.IsConsistent();
}

}  // namespace polyest::internal
