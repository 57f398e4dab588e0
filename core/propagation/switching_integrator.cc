#include "core/propagation/switching_integrator.h"

#include <algorithm>
#include <cmath>

#include "core/common/check.h"

namespace polyest::internal {

SwitchingIntegrator::SwitchingIntegrator(const SwitchingModel* model,
                                         const Eigen::ArrayXXd* parameters,
                                         const BlockInputs* inputs, double relative_tolerance,
                                         double time_s, const ConstBlock& states,
                                         Eigen::ArrayXXd* modes)
    : model_(model),
      relative_tolerance_(relative_tolerance),
      switched_(model, parameters, inputs, states.cols()),
      steps_(states.rows(), states.cols()),
      looks_(&switched_, states.rows(), states.cols()),
      scale_(states.rows(), states.cols(), relative_tolerance),
      encoded_modes_(modes),
      time_s_(time_s),
      reached_(states),
      progress_(static_cast<size_t>(states.rows())),
      begin_(states),
      end_(states),
      first_rates_(Eigen::ArrayXXd::Zero(states.rows(), states.cols())),
      below_(first_rates_),
      times_s_(states.rows()),
      lengths_s_(states.rows()),
      modes_of_row_(modes->cols()),
      smooth_from_s_(time_s) {
  const Eigen::Index switches = switched_.switches();
  POLYEST_CHECK(modes->rows() == rows() && modes->cols() == switches);
  stages_.fill(first_rates_);
  tolerance_.setZero(rows(), switches);
  for (Eigen::Index row = 0; row < rows(); ++row) {
    for (Eigen::Index i = 0; i < switches; ++i) switched_.Decode(row, i, (*modes)(row, i));
    row_of(row).begin_s = row_of(row).end_s = time_s;
  }
  scale_.Grow(end_);
}

// Settles the modes of all rows where the integration begins and after a jump of an input, at which
// all rows have stopped. With a span of 0 that is only for the outputs there.
void SwitchingIntegrator::Begin(double span_s, double stop_s) {
  constexpr double kDifference = 1e-6;
  span_s_ = span_s;
  const bool at_break = restart_ || row_of(0).end_s == last_stop_s_;
  if (at_break) smooth_from_s_ = row_of(0).end_s;
  last_stop_s_ = stop_s;
  const double smooth_s = span_s > 0 || stop_s == kInfinity ? span_s : stop_s - row_of(0).end_s;
  switched_.SetSmoothSpan(smooth_from_s_, stop_s, kDifference * smooth_s);
  longest_s_ = model_->changes_at_rest() ? span_s : kInfinity;
  if (begun_ && !restart_) {
    if (at_break) RenewFloors();
    return;
  }
  for (Eigen::Index row = 0; row < rows(); ++row) {
    const double end_s = row_of(row).end_s;
    switched_.ArgumentErrors(row, end_s, end_, relative_tolerance_, scale_.weights(), tolerance_);
    if (!switched_.Settle(row, end_s, end_, tolerance_)) return Fail(row, kContradiction);
    switched_.RatesOfRow(row, end_s, end_, first_rates_);
    looks_.Begin(row, end_s, end_);
    if (row_of(row).next_s == 0) FirstStep(row, span_s);
  }
  step_modes_ = switched_.modes();
  if (span_s == 0) return;
  SetFloors();
  begun_ = true;
  restart_ = false;
}

// Tells the error scale to what size a state at rest may grow within the span. Where forces cancel
// along a surface, those on its lower side tell it. At the beginning of the span a force may just
// begin to rise, as at that of a bump; at its end it is there.
void SwitchingIntegrator::SetFloors() {
  Vector expected = Vector::Zero(end_.cols());
  for (Eigen::Index pass = 0; pass <= end_.cols(); ++pass) {
    const Vector before = expected;
    const Eigen::ArrayXXd moved = end_.rowwise() + before.transpose().array();
    for (Eigen::Index row = 0; row < rows(); ++row) {
      const double begin_s = row_of(row).end_s;
      for (const double time_s : {begin_s, std::min(begin_s + span_s_, last_stop_s_)}) {
        RatesBelow(row, time_s, moved);
        for (Eigen::Index s = 0; s < end_.cols(); ++s) {
          const double size = span_s_ * std::abs(below_(row, s));
          if (before(s) == 0 && std::isfinite(size)) expected(s) = std::max(expected(s), size);
        }
      }
    }
    if (expected == before) break;
  }
  scale_.SetFloors(expected, expected);
}

// Sets the floors again where a state that rested when they were set may begin to move.
void SwitchingIntegrator::RenewFloors() {
  if (span_s_ > 0 && scale_.NeedsFloors()) SetFloors();
}

// Writes the row's rates at these states with the lower mode of every switch that slides.
void SwitchingIntegrator::RatesBelow(Eigen::Index row, double time_s,
                                     const Eigen::ArrayXXd& states) {
  for (Eigen::Index i = 0; i < switched_.switches(); ++i) {
    modes_of_row_(i) = switched_.Encoded(switched_.modes(), row, i);
    switched_.Decode(row, i, switched_.modes().values(row, 1 + i));
  }
  switched_.RatesOfRow(row, time_s, states, below_);
  for (Eigen::Index i = 0; i < switched_.switches(); ++i) {
    switched_.Decode(row, i, modes_of_row_(i));
  }
}

// h = (1/100) min_s S_s ÷ |ẋ_s|, at most a small part of the span. It is a guess.
void SwitchingIntegrator::FirstStep(Eigen::Index row, double span_s) {
  double step_s = span_s / 64;
  for (Eigen::Index s = 0; s < end_.cols(); ++s) {
    const double candidate_s = 0.01 * scale_.block_scale(s) / std::abs(first_rates_(row, s));
    if (std::isfinite(candidate_s) && candidate_s > 0) step_s = std::min(step_s, candidate_s);
  }
  row_of(row).next_s = step_s;
}

IntegratorOutcome SwitchingIntegrator::AdvanceTo(double time_s, double stop_time_s, int max_steps,
                                                 Block states) {
  POLYEST_CHECK(time_s >= time_s_ && stop_time_s >= time_s);
  outcome_ = {};
  if (time_s > time_s_) {
    if (time_s > target_s_) {
      for (RowProgress& row : progress_) row.switchings = 0;
    }
    target_s_ = time_s;
    Begin(time_s - time_s_, stop_time_s);
    int steps = 0;
    while (outcome_.ok && ChooseTrials(time_s, stop_time_s)) {
      if (++steps > max_steps) {
        const auto slowest = std::min_element(
            progress_.begin(), progress_.end(),
            [](const RowProgress& a, const RowProgress& b) { return a.end_s < b.end_s; });
        Fail(slowest - progress_.begin(), kTooManySteps);
        outcome_.too_many_steps = true;
        break;
      }
      TakeTrials();
    }
  } else if (!begun_ || restart_) {
    Begin(0, stop_time_s);
  }
  if (!outcome_.ok) return outcome_;
  WriteStates(time_s, states);
  return outcome_;
}

// Returns false if no row has to go on.
bool SwitchingIntegrator::ChooseTrials(double time_s, double stop_s) {
  bool any = false;
  for (RowProgress& row : progress_) {
    if (row.end_s >= time_s) {
      row.trial_s = 0;
      continue;
    }
    any = true;
    if (row.locating) continue;
    const double left_s = stop_s - row.end_s;
    row.trial_s = std::min(row.next_s, longest_s_);
    row.hits_stop = row.trial_s >= left_s * (1 - 1e-10);
    if (row.hits_stop) {
      row.trial_s = left_s;
    } else if (row.trial_s > left_s / 2) {
      row.trial_s = left_s / 2;
    }
  }
  return any;
}

void SwitchingIntegrator::TakeTrials() {
  for (Eigen::Index row = 0; row < rows(); ++row) {
    times_s_(row) = row_of(row).end_s;
    lengths_s_(row) = row_of(row).trial_s;
    switched_.SetResting(row, row_of(row).trial_s == 0);
  }
  steps_.first_stage() = first_rates_;
  steps_.Take(switched_, times_s_, lengths_s_, end_);
  looks_.Take(steps_, times_s_, lengths_s_, end_);
  for (Eigen::Index row = 0; row < rows() && outcome_.ok; ++row) {
    if (row_of(row).trial_s == 0) {
      looks_.Undo(row);
    } else if (row_of(row).locating) {
      JudgeLocating(row);
    } else {
      JudgeFull(row);
    }
  }
  scale_.Grow(end_);
}

bool SwitchingIntegrator::LooksStiff() {
  constexpr int kStepsBetweenLooks = 500;
  bool stiff = false;
  for (RowProgress& row : progress_) {
    if (row.steps < kStepsBetweenLooks) continue;
    stiff = stiff || 10 * row.stiff_steps > 9 * row.steps;
    row.steps = row.stiff_steps = 0;
  }
  return stiff;
}

void SwitchingIntegrator::WriteStates(double time_s, Block states) {
  for (Eigen::Index row = 0; row < rows(); ++row) {
    const RowProgress& at = row_of(row);
    states.row(row) = end_.row(row);
    if (time_s == at.end_s || at.length_s == 0) continue;
    const auto weights = RowSteps::Weights((time_s - at.begin_s) / at.length_s);
    states.row(row) = begin_.row(row);
    for (size_t i = 0; i < weights.size(); ++i) {
      states.row(row) += at.length_s * weights[i] * stages_[i].row(row);
    }
  }
  reached_ = states;
  time_s_ = time_s;
  for (Eigen::Index row = 0; row < rows(); ++row) {
    for (Eigen::Index i = 0; i < encoded_modes_->cols(); ++i) {
      (*encoded_modes_)(row, i) = switched_.Encoded(step_modes_, row, i);
    }
  }
}

bool SwitchingIntegrator::Outputs(double time_s, const ConstBlock& states, Block outputs) {
  switched_.Outputs(time_s, states, step_modes_, outputs);
  return true;
}

void SwitchingIntegrator::Fail(Eigen::Index row, const char* reason) {
  outcome_.ok = false;
  outcome_.flag = 0;
  outcome_.reason = reason;
  outcome_.worst_point = row;
}

}  // namespace polyest::internal
