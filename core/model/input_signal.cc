#include "core/model/input_signal.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>
#include <utility>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/common/types.h"
#include "core/model/interpolation.h"

namespace polyest::internal {
namespace {

constexpr double kPi = std::numbers::pi;

absl::Status Violation(const FieldPath& kind, const FieldPath& field, double value,
                       absl::string_view rule) {
  return InvalidField(kind.Then(field), absl::StrCat(value, " must be ", rule));
}

absl::Status RequireFinite(const FieldPath& kind, const FieldPath& field, double value) {
  return std::isfinite(value) ? absl::OkStatus() : Violation(kind, field, value, "finite");
}

absl::Status RequirePositive(const FieldPath& kind, const FieldPath& field, double value) {
  return std::isfinite(value) && value > 0 ? absl::OkStatus()
                                           : Violation(kind, field, value, "finite and above 0");
}

absl::Status RequireNonnegative(const FieldPath& kind, const FieldPath& field, double value) {
  return std::isfinite(value) && value >= 0
             ? absl::OkStatus()
             : Violation(kind, field, value, "finite and at least 0");
}

absl::Status Validate(const ConstantInput& input) {
  return RequireFinite("constant", "amplitude", input.amplitude);
}

absl::Status Validate(const StepInput& input) {
  POLYEST_RETURN_IF_ERROR(RequireFinite("step", "amplitude", input.amplitude));
  return RequireFinite("step", "time_s", input.time_s);
}

absl::Status Validate(const SinusoidInput& input) {
  POLYEST_RETURN_IF_ERROR(RequireFinite("sinusoid", "amplitude", input.amplitude));
  POLYEST_RETURN_IF_ERROR(RequirePositive("sinusoid", "frequency_hz", input.frequency_hz));
  return RequireFinite("sinusoid", "phase_rad", input.phase_rad);
}

absl::Status Validate(const ChirpInput& input) {
  POLYEST_RETURN_IF_ERROR(RequireFinite("chirp", "amplitude", input.amplitude));
  POLYEST_RETURN_IF_ERROR(
      RequireNonnegative("chirp", "start_frequency_hz", input.start_frequency_hz));
  POLYEST_RETURN_IF_ERROR(RequireNonnegative("chirp", "end_frequency_hz", input.end_frequency_hz));
  POLYEST_RETURN_IF_ERROR(RequireFinite("chirp", "start_s", input.start_s));
  POLYEST_RETURN_IF_ERROR(RequirePositive("chirp", "duration_s", input.duration_s));
  return RequireFinite("chirp", "phase_rad", input.phase_rad);
}

absl::Status Validate(const HalfSineBumpInput& input) {
  POLYEST_RETURN_IF_ERROR(RequireFinite("half_sine_bump", "amplitude", input.amplitude));
  POLYEST_RETURN_IF_ERROR(RequireFinite("half_sine_bump", "start_s", input.start_s));
  return RequirePositive("half_sine_bump", "duration_s", input.duration_s);
}

absl::Status Validate(const TableInput& input) {
  POLYEST_RETURN_IF_ERROR(RequireFinite("table", "amplitude", input.amplitude));
  if (input.time_s.size() != input.value.size()) {
    return InvalidField("table.time_s",
                        absl::StrCat(input.time_s.size(), " times for ", input.value.size(),
                                     " values; they must be equally many"));
  }
  if (input.time_s.empty()) {
    return InvalidField("table.time_s", "there must be at least one");
  }
  for (size_t i = 0; i < input.time_s.size(); ++i) {
    POLYEST_RETURN_IF_ERROR(RequireFinite("table", FieldPath{"time_s", i}, input.time_s[i]));
    POLYEST_RETURN_IF_ERROR(RequireFinite("table", FieldPath{"value", i}, input.value[i]));
    if (i > 0 && !(input.time_s[i] > input.time_s[i - 1])) {
      return Violation("table", FieldPath{"time_s", i}, input.time_s[i],
                       absl::StrCat("above the time before, ", input.time_s[i - 1]));
    }
  }
  return absl::OkStatus();
}

absl::Status Validate(const StreamedInput& input) {
  return RequireFinite("streamed", "amplitude", input.amplitude);
}

// The closed-form shapes. Each is 0 from its end on, since Shape returns the value from the right.

double ClosedForm(const ConstantInput&, double) { return 1; }

double ClosedForm(const StepInput& input, double time_s) { return time_s < input.time_s ? 0 : 1; }

double ClosedForm(const SinusoidInput& input, double time_s) {
  // sin(2π f t + phase)
  return std::sin(2 * kPi * input.frequency_hz * time_s + input.phase_rad);
}

double ClosedForm(const ChirpInput& input, double time_s) {
  if (time_s < input.start_s || time_s >= input.start_s + input.duration_s) return 0;
  const double tau = time_s - input.start_s;
  const double sweep_hz = input.end_frequency_hz - input.start_frequency_hz;
  // sin(2π (f0 τ + (f1 − f0) τ²/(2 T)) + phase)
  const double cycles = (input.start_frequency_hz + sweep_hz * tau / (2 * input.duration_s)) * tau;
  return std::sin(2 * kPi * cycles + input.phase_rad);
}

double ClosedForm(const HalfSineBumpInput& input, double time_s) {
  if (time_s < input.start_s || time_s >= input.start_s + input.duration_s) return 0;
  // sin(π (t − start)/T)
  return std::sin(kPi * (time_s - input.start_s) / input.duration_s);
}

double FirstAfter(double time_s, double first, double second) {
  if (time_s < first) return first;
  return time_s < second ? second : kInfinity;
}

double ClosedFormBreak(const ConstantInput&, double) { return kInfinity; }

double ClosedFormBreak(const StepInput& input, double time_s) {
  return FirstAfter(time_s, input.time_s, kInfinity);
}

double ClosedFormBreak(const SinusoidInput&, double) { return kInfinity; }

double ClosedFormBreak(const ChirpInput& input, double time_s) {
  return FirstAfter(time_s, input.start_s, input.start_s + input.duration_s);
}

double ClosedFormBreak(const HalfSineBumpInput& input, double time_s) {
  return FirstAfter(time_s, input.start_s, input.start_s + input.duration_s);
}

// So few knots are not worth moving the others.
constexpr std::ptrdiff_t kMinForgotten = 1024;

template <class Input>
constexpr bool kHasKnots =
    std::is_same_v<Input, TableInput> || std::is_same_v<Input, StreamedInput>;

}  // namespace

absl::StatusOr<InputSignal> InputSignal::Make(InputSpecification specification) {
  POLYEST_RETURN_IF_ERROR(
      std::visit([](const auto& input) { return Validate(input); }, specification));
  return InputSignal(std::move(specification));
}

InputSignal::InputSignal(InputSpecification specification)
    : specification_(std::move(specification)) {
  if (auto* table = std::get_if<TableInput>(&specification_)) {
    knot_time_s_ = std::move(table->time_s);
    knot_value_ = std::move(table->value);
    finished_ = true;
    SettleSlopes();
  }
}

double InputSignal::default_amplitude() const {
  return std::visit([](const auto& input) { return input.amplitude; }, specification_);
}

std::optional<Interpolation> InputSignal::interpolation() const {
  return std::visit(
      []<class Input>(const Input& input) -> std::optional<Interpolation> {
        if constexpr (kHasKnots<Input>) {
          return input.interpolation;
        } else {
          return std::nullopt;
        }
      },
      specification_);
}

int InputSignal::knots_ahead() const { return streamed() ? KnotsAhead(*interpolation()) : 0; }

int InputSignal::knots_needed() const {
  if (!streamed() || *interpolation() == Interpolation::kHold) return 0;
  return 1 + knots_ahead();
}

bool InputSignal::SettledUpTo(double time_s) const {
  if (!streamed() || finished_) return true;
  const auto needed = static_cast<size_t>(knots_needed());
  // Before the first knot the shape is its value.
  if (needed == 0) return !knot_time_s_.empty();
  return knot_time_s_.size() >= needed && knot_time_s_[knot_time_s_.size() - needed] >= time_s;
}

bool InputSignal::streamed() const { return std::holds_alternative<StreamedInput>(specification_); }

void InputSignal::Append(double time_s, double value) {
  POLYEST_CHECK(streamed() && !finished_);
  POLYEST_CHECK(std::isfinite(time_s) && std::isfinite(value));
  POLYEST_CHECK(knot_time_s_.empty() || time_s > knot_time_s_.back());
  knot_time_s_.push_back(time_s);
  knot_value_.push_back(value);
  SettleSlopes();
}

void InputSignal::Finish() {
  POLYEST_CHECK(streamed());
  finished_ = true;
  SettleSlopes();
}

void InputSignal::SettleSlopes() {
  const Interpolation curve = *interpolation();
  const auto ahead = static_cast<size_t>(KnotsAhead(curve));
  if (ahead == 0) return;
  const size_t settled =
      finished_ ? knot_time_s_.size() : knot_time_s_.size() - std::min(ahead, knot_time_s_.size());
  for (size_t k = knot_slope_.size(); k < settled; ++k) {
    knot_slope_.push_back(curve == Interpolation::kCubic
                              ? SplineSlope(knot_time_s_, knot_value_, k)
                              : MonotoneSlope(knot_time_s_, knot_value_, k));
  }
}

void InputSignal::Forget(double time_s) {
  POLYEST_CHECK(streamed());
  const auto next = std::upper_bound(knot_time_s_.begin(), knot_time_s_.end(), time_s);
  const std::ptrdiff_t kept = next - knot_time_s_.begin() - kKnotsBehind;
  // The first knot, where a smooth curve begins, stays.
  if (kept < kMinForgotten || kept < std::ssize(knot_time_s_) / 2) return;
  const auto forget = [kept](std::vector<double>& of_knots) {
    if (!of_knots.empty()) of_knots.erase(of_knots.begin() + 1, of_knots.begin() + kept);
  };
  forget(knot_time_s_);
  forget(knot_value_);
  forget(knot_slope_);
}

void InputSignal::Clear() {
  POLYEST_CHECK(streamed());
  knot_time_s_.clear();
  knot_value_.clear();
  knot_slope_.clear();
  finished_ = false;
}

double InputSignal::Shape(double time_s) const {
  size_t knots = 0;
  return Shape(time_s, knots);
}

double InputSignal::Shape(double time_s, size_t& knots) const {
  return std::visit(
      [&]<class Input>(const Input& input) {
        if constexpr (kHasKnots<Input>) {
          knots = KnotsUpTo(time_s, knots);
          return BetweenKnots(time_s, input.interpolation, knots);
        } else {
          return ClosedForm(input, time_s);
        }
      },
      specification_);
}

double InputSignal::NextBreak(double time_s) const {
  return std::visit(
      [&]<class Input>(const Input& input) {
        if constexpr (kHasKnots<Input>) {
          return KnotsAhead(input.interpolation) > 0 ? EndAfter(time_s) : NextKnot(time_s);
        } else {
          return ClosedFormBreak(input, time_s);
        }
      },
      specification_);
}

double InputSignal::NextKnot(double time_s) const {
  if (!interpolation()) return NextBreak(time_s);
  const auto next = std::upper_bound(knot_time_s_.begin(), knot_time_s_.end(), time_s);
  return next == knot_time_s_.end() ? kInfinity : *next;
}

// Returns the next end of a smooth curve, where its derivative jumps.
double InputSignal::EndAfter(double time_s) const {
  if (knot_time_s_.empty()) return kInfinity;
  if (time_s < knot_time_s_.front()) return knot_time_s_.front();
  return finished_ && time_s < knot_time_s_.back() ? knot_time_s_.back() : kInfinity;
}

bool InputSignal::Jumps() const {
  return std::visit(
      []<class Input>(const Input& input) {
        if constexpr (kHasKnots<Input>) {
          return input.interpolation == Interpolation::kHold;
        } else {
          // A chirp ends, and with a phase also begins, at a value other than 0.
          return std::is_same_v<Input, StepInput> || std::is_same_v<Input, ChirpInput>;
        }
      },
      specification_);
}

// Returns the number of knots up to a time: `guess` or its neighbours, if it is one of them.
size_t InputSignal::KnotsUpTo(double time_s, size_t guess) const {
  const size_t count = knot_time_s_.size();
  const auto reaches = [&](size_t knots) {
    return knots == 0 || knot_time_s_[knots - 1] <= time_s;
  };
  const auto ends = [&](size_t knots) { return knots == count || time_s < knot_time_s_[knots]; };
  if (guess <= count && reaches(guess)) {
    if (ends(guess)) return guess;
    if (ends(guess + 1)) return guess + 1;
  } else if (guess <= count && reaches(guess - 1)) {
    return guess - 1;
  }
  const auto next = std::upper_bound(knot_time_s_.begin(), knot_time_s_.end(), time_s);
  return static_cast<size_t>(next - knot_time_s_.begin());
}

// `right` is the number of knots up to the time.
double InputSignal::BetweenKnots(double time_s, Interpolation interpolation, size_t right) const {
  if (knot_time_s_.empty()) return 0;
  if (right == 0) return knot_value_.front();
  const size_t left = right - 1;
  if (time_s == knot_time_s_[left] || right == knot_time_s_.size()) return knot_value_[left];
  if (interpolation == Interpolation::kHold) return knot_value_[left];
  if (interpolation == Interpolation::kLinear) {
    // u_l + (u_r − u_l) (t − t_l)/(t_r − t_l)
    const double fraction =
        (time_s - knot_time_s_[left]) / (knot_time_s_[right] - knot_time_s_[left]);
    return std::lerp(knot_value_[left], knot_value_[right], fraction);
  }
  POLYEST_CHECK(right < knot_slope_.size());
  return Hermite(knot_time_s_, knot_value_, left, knot_slope_[left], knot_slope_[right], time_s);
}

}  // namespace polyest::internal
