#include "core/propagation/switching_integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/common/check.h"
#include "core/propagation/error_scale.h"
#include "core/propagation/row_progress.h"
#include "core/propagation/row_steps.h"
#include "core/propagation/switch_looks.h"
#include "core/propagation/switched_rows.h"

namespace polyest::internal {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr const char* kEndless = "switchings follow one another without end";
constexpr const char* kContradiction = "the conditions that switch contradict one another";
constexpr const char* kTooManySwitchings = "too many switchings between two samples";
constexpr const char* kNoStep = "no step size gives an acceptable error";
constexpr const char* kTooManySteps = "too many steps between two samples";

class SwitchingIntegrator final : public BlockIntegrator {
 public:
  SwitchingIntegrator(const SwitchingModel* model, const Eigen::ArrayXXd* parameters,
                      const BlockInputs* inputs, double relative_tolerance, double time_s,
                      const ConstBlock& states, Eigen::ArrayXXd* modes);

  double time_s() const override { return time_s_; }
  ConstBlock states() const override { return reached_; }
  IntegratorOutcome AdvanceTo(double time_s, double stop_time_s, int max_steps,
                              Block states) override;
  void Restart() override { restart_ = true; }
  bool LooksStiff() override;
  bool Outputs(double time_s, const ConstBlock& states, Block outputs) override;

 private:
  Eigen::Index rows() const { return reached_.rows(); }
  RowProgress& row_of(Eigen::Index row) { return progress_[static_cast<size_t>(row)]; }
  void Begin(double span_s, double stop_s);
  bool ChooseTrials(double time_s, double stop_s);
  void TakeTrials();
  void JudgeFull(Eigen::Index row);
  void JudgeLocating(Eigen::Index row);
  double ErrorOf(Eigen::Index row);
  void Accept(Eigen::Index row, double length_s, bool hits_stop);
  void Switch(Eigen::Index row);
  bool LeaveAtEdge(Eigen::Index row);
  void SetFloors(double span_s);
  void RatesBelow(Eigen::Index row, const Eigen::ArrayXXd& states);
  void FirstStep(Eigen::Index row, double span_s);
  void NoteStiffness(Eigen::Index row, double length_s);
  void WriteStates(double time_s, Block states);
  void Fail(Eigen::Index row, const char* reason);
  double Resolution(const RowProgress& row) const {
    return 16 * kEpsilon * std::max(std::abs(row.end_s), span_s_);
  }

  const SwitchingModel* model_;
  double relative_tolerance_;
  SwitchedRows switched_;
  RowSteps steps_;
  SwitchLooks looks_;
  ErrorScale scale_;
  Eigen::ArrayXXd* encoded_modes_;

  double time_s_;                 // of reached_
  double target_s_ = -kInfinity;  // of the last call
  Eigen::ArrayXXd reached_;
  std::vector<RowProgress> progress_;
  Eigen::ArrayXXd begin_;           // states at the beginning of the last steps
  Eigen::ArrayXXd end_;             // states at their ends
  RowSteps::Stages stages_;         // of the last steps
  SwitchedRows::Modes step_modes_;  // in the last steps
  Eigen::ArrayXXd first_rates_;     // of the next steps
  Eigen::ArrayXXd below_;           // rates on the lower side of surfaces
  Eigen::ArrayXXd tolerance_;       // rows × switches: an error of the arguments

  // Work space.
  Eigen::ArrayXd times_s_, lengths_s_;

  bool begun_ = false;
  bool restart_ = false;
  double span_s_ = 0;
  double smooth_from_s_;
  double last_stop_s_ = kInfinity;
  double longest_s_ = kInfinity;
  IntegratorOutcome outcome_;
};

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
  if (restart_ || row_of(0).end_s == last_stop_s_) smooth_from_s_ = row_of(0).end_s;
  last_stop_s_ = stop_s;
  const double smooth_s = span_s > 0 || stop_s == kInfinity ? span_s : stop_s - row_of(0).end_s;
  switched_.SetSmoothSpan(smooth_from_s_, stop_s, kDifference * smooth_s);
  longest_s_ = model_->changes_at_rest() ? span_s : kInfinity;
  if (begun_ && !restart_) return;
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
  SetFloors(span_s);
  begun_ = true;
  restart_ = false;
}

// Tells the error scale to what size a state at rest may grow within the span. Where forces cancel
// along a surface, those on its lower side tell it.
void SwitchingIntegrator::SetFloors(double span_s) {
  Vector expected = Vector::Zero(end_.cols());
  for (Eigen::Index pass = 0; pass <= end_.cols(); ++pass) {
    const Vector before = expected;
    const Eigen::ArrayXXd moved = end_.rowwise() + before.transpose().array();
    for (Eigen::Index row = 0; row < rows(); ++row) {
      RatesBelow(row, moved);
      for (Eigen::Index s = 0; s < end_.cols(); ++s) {
        const double size = span_s * std::abs(below_(row, s));
        if (before(s) == 0 && std::isfinite(size)) expected(s) = std::max(expected(s), size);
      }
    }
    if (expected == before) break;
  }
  scale_.SetFloors(expected, expected);
}

// Writes the row's rates at these states with the lower mode of every switch that slides.
void SwitchingIntegrator::RatesBelow(Eigen::Index row, const Eigen::ArrayXXd& states) {
  const SwitchedRows::Modes modes = switched_.modes();
  for (Eigen::Index i = 0; i < switched_.switches(); ++i) {
    switched_.Decode(row, i, modes.values(row, 1 + i));
  }
  switched_.RatesOfRow(row, row_of(row).end_s, states, below_);
  for (Eigen::Index i = 0; i < switched_.switches(); ++i) {
    switched_.Decode(row, i, switched_.Encoded(modes, row, i));
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

void SwitchingIntegrator::JudgeFull(Eigen::Index row) {
  RowProgress& at = row_of(row);
  constexpr int kMostRejectionsByLook = 8;
  const double error = ErrorOf(row);
  double look_error = error > 1 ? 0 : looks_.Error(row);
  if (at.rejections_by_look >= kMostRejectionsByLook) look_error = std::min(look_error, 1.0);
  const double worst = std::max(error, look_error);
  const double factor = std::clamp(0.9 * std::pow(worst, -0.2), 0.2, 5.0);
  const double length_s = at.trial_s;
  if (!(worst <= 1)) {
    at.next_s = length_s * std::min(factor, 0.9);
    at.rejections_by_look += error <= 1 ? 1 : 0;
    looks_.Undo(row);
    if (at.next_s <= Resolution(at) / 16 && !LeaveAtEdge(row)) Fail(row, kNoStep);
    return;
  }
  at.rejections_by_look = 0;
  const Crossing crossing = looks_.FirstLeft(row, at.which, at.upwards);
  if (!crossing.found) {
    NoteStiffness(row, length_s);
    at.next_s = at.hits_stop ? std::max(at.next_s, length_s * factor) : length_s * factor;
    return Accept(row, length_s, at.hits_stop);
  }
  looks_.Undo(row);
  at.full_s = length_s;
  at.trial_s = crossing.theta * length_s;
  // What comes after the switching may be as short as what came before.
  constexpr double kMostGrowth = 32;
  at.next_s =
      std::min({length_s, length_s * factor, std::max(kMostGrowth * at.trial_s, Resolution(at))});
  switched_.ArgumentErrors(row, at.end_s, end_, relative_tolerance_, scale_.weights(), tolerance_);
  if (at.trial_s <= Resolution(at) / 16) return Switch(row);
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
  constexpr int kMostSecants = 8;
  const double value = looks_.OutsideAtEnd(row, at.which, at.upwards);
  constexpr double kPartOfTolerance = 1e-4;
  const double tolerance =
      switched_.modes().sliding(row, at.which) ? relative_tolerance_ : tolerance_(row, at.which);
  if (at.secants > 0) at.slope = (value - at.before_value) / (at.trial_s - at.before_s);
  const double improved_s = at.trial_s - value / at.slope;
  const bool better = std::abs(value) > kPartOfTolerance * tolerance && at.secants < kMostSecants &&
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
  constexpr int kMostSwitchings = 10'000;
  const int most_stalled = 20 + 4 * static_cast<int>(switched_.switches());
  at.stalled = at.end_s - at.switched_s <= Resolution(at) ? at.stalled + 1 : 0;
  at.switched_s = at.end_s;
  if (at.stalled > most_stalled) return Fail(row, kEndless);
  if (++at.switchings > kMostSwitchings) return Fail(row, kTooManySwitchings);
  switched_.ArgumentErrors(row, at.end_s, end_, relative_tolerance_, scale_.weights(), tolerance_);
  if (!switched_.Leave(row, at.end_s, end_, at.which, at.upwards, tolerance_)) {
    return Fail(row, kContradiction);
  }
  switched_.Project(row, at.end_s, scale_.weights(), end_, at.which);
  switched_.RatesOfRow(row, at.end_s, end_, first_rates_);
  looks_.Begin(row, at.end_s, end_);
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

}  // namespace

std::unique_ptr<BlockIntegrator> MakeSwitchingIntegrator(
    const SwitchingModel* model, const Eigen::ArrayXXd* parameters, const BlockInputs* inputs,
    double relative_tolerance, double time_s, const ConstBlock& states, Eigen::ArrayXXd* modes) {
  return std::make_unique<SwitchingIntegrator>(model, parameters, inputs, relative_tolerance,
                                               time_s, states, modes);
}

}  // namespace polyest::internal
