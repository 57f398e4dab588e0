#include "core/propagation/block_inputs.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "core/model/input_generator.h"

namespace polyest::internal {
namespace {

Eigen::ArrayXXd RowsOf(const Matrix& matrix, const std::vector<int>& points) {
  if (matrix.size() == 0) return {};
  return matrix(points, Eigen::all).array();
}

// Returns the last knot up to `time_s`, −∞ if there is none.
double KnotUpTo(const InputSignal& signal, double time_s) {
  const std::span<const double> knots = signal.knot_times_s();
  const auto next = std::upper_bound(knots.begin(), knots.end(), time_s);
  if (next != knots.begin()) return *(next - 1);
  double last_s = -kInfinity;
  if (!knots.empty()) return last_s;
  // Signals without a table have at most two.
  for (double knot_s = signal.NextKnot(last_s); knot_s <= time_s && knot_s < kInfinity;
       knot_s = signal.NextKnot(knot_s)) {
    last_s = knot_s;
  }
  return last_s;
}

}  // namespace

BlockInputs::BlockInputs(const EnsembleSpecification& specification, const InputSignals* signals,
                         const std::vector<int>& points)
    : signals_(signals),
      amplitudes_(specification.amplitudes(points, Eigen::all).array()),
      offsets_(RowsOf(specification.input_offsets, points)) {
  const Eigen::ArrayXXd delays_s = RowsOf(specification.input_delays_s, points);
  values_.setZero(amplitudes_.rows(), amplitudes_.cols());
  for (Eigen::Index i = 0; i < amplitudes_.cols(); ++i) {
    std::vector<Cursor> cursors;
    const bool differ = delays_s.size() > 0 && (delays_s.col(i) != delays_s(0, i)).any();
    const bool stops = !differ || (*signals)[static_cast<size_t>(i)].Jumps();
    for (Eigen::Index row = 0; row < (differ ? amplitudes_.rows() : 1); ++row) {
      const double delay_s = delays_s.size() > 0 ? delays_s(row, i) : 0;
      cursors.push_back({.delay_s = delay_s, .stops = stops, .last_s = -delay_s});
    }
    cursors_.push_back(std::move(cursors));
  }
}

double BlockInputs::BreakAfter(size_t input, double time_s) const {
  const InputSignal& signal = (*signals_)[input];
  return every_knot_ ? signal.NextKnot(time_s) : signal.NextBreak(time_s);
}

void BlockInputs::FindNext(size_t input, Cursor& cursor) const {
  cursor.next_s = BreakAfter(input, cursor.last_s);
  cursor.before_next_s = std::nextafter(cursor.next_s, -kInfinity);
}

BlockInputs::Break BlockInputs::NextBreak() {
  Break next;
  for (size_t i = 0; i < cursors_.size(); ++i) {
    const InputSignal& signal = (*signals_)[i];
    for (Cursor& cursor : cursors_[i]) {
      if (!cursor.stops) break;
      // The break is computed again each time, because knots may have been appended.
      FindNext(i, cursor);
      const double break_s = cursor.next_s + cursor.delay_s;
      if (break_s > next.time_s || break_s == kInfinity) continue;
      next = {break_s, signal.Jumps() || (break_s == next.time_s && next.jumps)};
    }
  }
  return next;
}

void BlockInputs::Pass(double time_s) {
  for (size_t i = 0; i < cursors_.size(); ++i) {
    for (Cursor& cursor : cursors_[i]) {
      while (cursor.stops && cursor.next_s + cursor.delay_s <= time_s) {
        cursor.last_s = cursor.next_s;
        FindNext(i, cursor);
      }
    }
  }
  time_s_ = std::numeric_limits<double>::quiet_NaN();
}

double BlockInputs::BoundedTime(const Cursor& cursor, double time_s) {
  const double at_s = time_s - cursor.delay_s;
  return cursor.stops ? std::max(cursor.last_s, std::min(at_s, cursor.before_next_s)) : at_s;
}

double BlockInputs::Shape(size_t input, const Cursor& cursor, double time_s) const {
  return (*signals_)[input].Shape(BoundedTime(cursor, time_s), cursor.knots);
}

double BlockInputs::StepEnd(double time_s) const {
  double end_s = kInfinity;
  for (size_t i = 0; i < cursors_.size(); ++i) {
    const InputSignal& signal = (*signals_)[i];
    if (signal.streamed() || every_knot_) continue;
    for (const Cursor& cursor : cursors_[i]) {
      const double at_s = time_s - cursor.delay_s;
      double first_s = signal.NextKnot(at_s);
      // The rounding of t − delay may leave a knot that has been reached.
      while (first_s + cursor.delay_s <= time_s) first_s = signal.NextKnot(first_s);
      if (first_s == kInfinity || (cursor.stops && first_s == signal.NextBreak(at_s))) continue;
      // A step is at most half as long as the interval that it starts in. It ends no later than the
      // knot before the next interval, or after half the length of that one: some evaluation falls
      // inside each interval, even if there is one a step.
      const double next_s = 0.5 * (signal.NextKnot(first_s) - first_s);
      const double present_s = 0.5 * (first_s - KnotUpTo(signal, at_s));
      const double latest_s = std::min(std::max(first_s, at_s + next_s), at_s + present_s);
      if (latest_s + cursor.delay_s > time_s) end_s = std::min(end_s, latest_s + cursor.delay_s);
    }
  }
  return end_s;
}

std::vector<size_t> BlockInputs::Varying() const {
  std::vector<size_t> varying;
  for (size_t i = 0; i < signals_->size(); ++i) {
    if (!std::holds_alternative<ConstantInput>((*signals_)[i].specification())) {
      varying.push_back(i);
    }
  }
  return varying;
}

void BlockInputs::GeneratorStateOf(size_t input, double time_s, std::span<double> state) const {
  const Cursor& cursor = cursors_[input].front();
  GeneratorState((*signals_)[input], BoundedTime(cursor, time_s), state);
}

const Eigen::ArrayXXd& BlockInputs::At(double time_s) {
  if (time_s == time_s_) return values_;
  for (size_t i = 0; i < cursors_.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    auto u = values_.col(column);
    if (cursors_[i].size() == 1) {
      u = amplitudes_.col(column) * Shape(i, cursors_[i].front(), time_s);
    } else {
      for (Eigen::Index row = 0; row < u.rows(); ++row) {
        u(row) = amplitudes_(row, column) * Shape(i, cursors_[i][static_cast<size_t>(row)], time_s);
      }
    }
    if (offsets_.size() > 0) u += offsets_.col(column);
  }
  time_s_ = time_s;
  return values_;
}

double BlockInputs::At(Eigen::Index row, Eigen::Index input, double time_s) const {
  const auto i = static_cast<size_t>(input);
  const Cursor& cursor =
      cursors_[i].size() == 1 ? cursors_[i].front() : cursors_[i][static_cast<size_t>(row)];
  const double u = amplitudes_(row, input) * Shape(i, cursor, time_s);
  return offsets_.size() > 0 ? u + offsets_(row, input) : u;
}

void BlockInputs::CopyRow(Eigen::Index from, Eigen::Index to) {
  amplitudes_.row(to) = amplitudes_.row(from);
  if (offsets_.size() > 0) offsets_.row(to) = offsets_.row(from);
  for (std::vector<Cursor>& cursors : cursors_) {
    if (cursors.size() > 1) cursors[static_cast<size_t>(to)] = cursors[static_cast<size_t>(from)];
  }
  time_s_ = std::numeric_limits<double>::quiet_NaN();
}

}  // namespace polyest::internal
