#include "core/propagation/runge_kutta_integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/common/check.h"
#include "core/propagation/dormand_prince_tables.h"
#include "core/propagation/error_floors.h"
#include "core/propagation/error_scale.h"
#include "core/propagation/order_choice.h"
#include "core/propagation/stage_sums.h"

namespace polyest::internal {
namespace {

using Values = Eigen::ArrayXXd;

class RungeKuttaIntegrator final : public BlockIntegrator {
 public:
  RungeKuttaIntegrator(BlockSystem* system, double relative_tolerance, double time_s,
                       const ConstBlock& states);

  double time_s() const override { return time_s_; }
  ConstBlock states() const override { return states_; }
  IntegratorOutcome AdvanceTo(double time_s, double stop_time_s, int max_steps,
                              Block states) override;
  void Restart() override;
  bool RestartFrom(const ConstBlock& states) override;
  bool LooksStiff() override;

 private:
  enum class Result { kSuccess, kTooManySteps, kNoStepAccepted, kStandstill };

  Result StepUntil(double time_s, double stop_time_s, int max_steps);
  template <class Method>
  Result Step(double stop_time_s);
  // Lets stage 0 hold the derivatives at the end of the last step.
  void PrepareFirstStage();
  template <class Method>
  void Accept(double step_s, double next_s, double factor);
  // Each tries a step from `end_` to `next_`. Returns ‖e‖, which is huge where something is not
  // finite.
  template <class Method>
  double Try(double step_s, double next_s);
  double Error5(double step_s);
  double Error8(double step_s);
  // Computes the states and the derivatives of stages kFirst … kLast of a step.
  template <class Method, int kFirst, int kLast>
  void ComputeStages(double begin_s, double step_s, const Values& begin);
  void Interpolate(double time_s);
  void PrepareInterpolant();
  // Writes h Σ_j c_j k_j, for the rows of coefficients `kRows`, into the interpolant from kFirst
  // on.
  template <const auto& kRows, int kFirst>
  void SetInterpolant(double step_s);
  double LargestRate();
  IntegratorOutcome Outcome(Result result, double advance_s, double span_s) const;

  BlockSystem* const system_;
  ErrorScale scale_;
  ErrorFloors floors_;
  OrderChoice order_;
  double time_s_;              // of the last call
  Values states_;              // then
  double begin_s_, end_s_;     // of the last step
  Values begin_, end_, next_;  // the states there and, of the step tried now, at its end
  bool was_high_ = false;      // the order of the last step
  double stop_s_;              // the last stop that was reached
  Stages stages_;              // k_j
  bool has_rates_ = false;     // whether one holds the derivatives at the end of the last step
  size_t rates_stage_ = 0;     // that one
  Values stage_states_, error_;
  std::array<Values, 7> interpolant_;
  bool has_interpolant_ = false;  // of the last step
  double step_s_ = 0;             // the next one, 0 before the first
  int64_t steps_ = 0, steps_looked_at_ = 0;
};

RungeKuttaIntegrator::RungeKuttaIntegrator(BlockSystem* system, double relative_tolerance,
                                           double time_s, const ConstBlock& states)
    : system_(system),
      scale_(system->points(), system->states(), relative_tolerance),
      floors_(system, &scale_),
      time_s_(time_s),
      states_(states),
      begin_s_(time_s),
      end_s_(time_s),
      begin_(states),
      end_(states),
      next_(states),
      stop_s_(time_s),
      stage_states_(states),
      error_(Values::Zero(states.rows(), states.cols())) {
  POLYEST_CHECK(states.size() % kLanes == 0);
  stages_.fill(error_);
  interpolant_.fill(error_);
  scale_.Grow(end_);
}

IntegratorOutcome RungeKuttaIntegrator::AdvanceTo(double time_s, double stop_time_s, int max_steps,
                                                  Block states) {
  POLYEST_CHECK(time_s >= time_s_ && stop_time_s >= time_s);
  const double before_s = end_s_;
  const double span_s = time_s - time_s_;
  Result result = Result::kSuccess;
  if (time_s > end_s_) {
    if (step_s_ == 0) step_s_ = floors_.FirstStep(end_s_, end_, span_s);
    floors_.Update(end_s_, end_, step_s_, span_s);
    result = StepUntil(time_s, stop_time_s, max_steps);
  }
  if (result != Result::kSuccess) {
    time_s_ = end_s_;
    states_ = end_;
    return Outcome(result, end_s_ - before_s, span_s);
  }
  if (time_s == end_s_) {
    states_ = end_;
  } else if (time_s > time_s_) {
    Interpolate(time_s);
  }
  time_s_ = time_s;
  states = states_;
  return {};
}

RungeKuttaIntegrator::Result RungeKuttaIntegrator::StepUntil(double time_s, double stop_time_s,
                                                             int max_steps) {
  for (int steps = 0; end_s_ < time_s; ++steps) {
    if (steps == max_steps) return Result::kTooManySteps;
    const Result result =
        order_.high() ? Step<DormandPrince8>(stop_time_s) : Step<DormandPrince5>(stop_time_s);
    if (result != Result::kSuccess) return result;
  }
  return Result::kSuccess;
}

void RungeKuttaIntegrator::PrepareFirstStage() {
  if (!has_rates_) {
    system_->Derivatives(end_s_, end_, stages_[rates_stage_]);
    order_.CountEvaluations(1);
  }
  std::swap(stages_[0], stages_[rates_stage_]);
  rates_stage_ = 0;
  has_rates_ = true;
}

template <class Method>
RungeKuttaIntegrator::Result RungeKuttaIntegrator::Step(double stop_time_s) {
  constexpr int kMaxRejections = 30;  // the first step is a guess
  constexpr double kSafety = 0.9, kShortest = 0.2;
  constexpr double kHigher = 3;  // steps of order 8 are about so many times as long
  PrepareFirstStage();
  const double remaining_s = stop_time_s - end_s_;
  double step_s = step_s_;
  for (int rejections = 0; rejections <= kMaxRejections; ++rejections) {
    // The last two steps before a stop are equally long rather than one of them tiny.
    const bool stops = step_s >= remaining_s;
    if (stops) {
      step_s = remaining_s;
    } else if (2 * step_s > remaining_s) {
      step_s = remaining_s / 2;
    }
    const double next_s = stops ? stop_time_s : end_s_ + step_s;
    if (!(next_s > end_s_)) {
      // Where no step has been tried, the rates tell the point that forbids any.
      if (rejections == 0) scale_.Norm(stages_[0], scale_.weights());
      return Result::kStandstill;
    }
    const double norm = Try<Method>(step_s, next_s);
    order_.CountEvaluations(Method::kStages);
    const double factor = kSafety * std::pow(norm, -1.0 / Method::kOrder);
    if (norm <= 1) {
      const bool is_whole = stops && end_s_ == stop_s_;
      Accept<Method>(step_s, next_s, rejections > 0 ? std::min(factor, 1.0) : factor);
      if (stops) stop_s_ = next_s;
      if (order_.Accept(step_s, is_whole)) step_s_ *= order_.high() ? kHigher : 1 / kHigher;
      return Result::kSuccess;
    }
    step_s_ = step_s *= std::max(factor, kShortest);
  }
  return Result::kNoStepAccepted;
}

template <class Method>
void RungeKuttaIntegrator::Accept(double step_s, double next_s, double factor) {
  constexpr double kLongest = 6;  // times the step before
  begin_s_ = std::exchange(end_s_, next_s);
  std::swap(begin_, end_);
  std::swap(end_, next_);
  scale_.Grow(end_);
  rates_stage_ = Method::kStages;
  was_high_ = Method::kOrder == DormandPrince8::kOrder;
  has_interpolant_ = false;
  ++steps_;
  // A step that a stop has shortened says nothing against longer ones.
  const double longest_s = step_s * std::min(factor, kLongest);
  step_s_ = step_s < step_s_ ? std::max(step_s_, longest_s) : longest_s;
}

template <class Method>
double RungeKuttaIntegrator::Try(double step_s, double next_s) {
  ComputeStages<Method, 1, Method::kStages - 1>(end_s_, step_s, end_);
  AddStages<StateRow<Method, Method::kStages>>(end_, step_s, stages_, next_);
  scale_.Watch(&next_);
  Values& rates = stages_[Method::kStages];
  if constexpr (Method::kOrder == 5) {
    system_->Derivatives(next_s, next_, rates);
    return Error5(step_s);
  } else {
    const double norm = Error8(step_s);
    if (!(norm <= 1)) return norm;
    system_->Derivatives(next_s, next_, rates);
    // A step to where the derivatives are not finite is no step: the norm tells the point.
    return rates.isFinite().all() ? norm : scale_.Norm(rates, scale_.weights());
  }
}

double RungeKuttaIntegrator::Error5(double step_s) {
  const StageSum<ErrorRow<DormandPrince5::kE>> sum(stages_);
  double* const error = error_.data();
  const Eigen::Index size = error_.size();
  for (Eigen::Index i = 0; i < size; i += kLanes) Lane::Map(error + i) = step_s * sum.At(i);
  return scale_.Norm(error_, scale_.weights());
}

double RungeKuttaIntegrator::Error8(double step_s) {
  constexpr double kShare = 0.1;  // of the estimate of order 3
  const StageSum<ErrorRow<DormandPrince8::kE5>> sum5(stages_);
  const StageSum<ErrorRow<DormandPrince8::kE3>> sum3(stages_);
  double* const error = error_.data();
  const Eigen::Index size = error_.size();
  for (Eigen::Index i = 0; i < size; i += kLanes) {
    const Lane order5 = sum5.At(i).abs();
    const Lane order3 = kShare * sum3.At(i).abs();
    const Lane largest = order5.max(order3).max(std::numeric_limits<double>::min());
    Lane::Map(error + i) = step_s * order5 * (order5 / largest);
  }
  return scale_.Norm(error_, scale_.weights());
}

template <class Method, int kFirst, int kLast>
void RungeKuttaIntegrator::ComputeStages(double begin_s, double step_s, const Values& begin) {
  const auto compute = [&]<int kStage>() {
    AddStages<StateRow<Method, kStage>>(begin, step_s, stages_, stage_states_);
    system_->Derivatives(begin_s + Method::kC[kStage] * step_s, stage_states_, stages_[kStage]);
  };
  [&]<int... kOffset>(std::integer_sequence<int, kOffset...>) {
    (compute.template operator()<kFirst + kOffset>(), ...);
  }
  (std::make_integer_sequence<int, kLast - kFirst + 1>());
}

// With s = (t − begin) ÷ h, the interpolants are
//   order 5: x(t) = begin + s (F_0 + s (F_1 + s (F_2 + s F_3))),
//   order 8: x(t) = begin + s (F_0 + (1 − s) (F_1 + s (F_2 + (1 − s) (F_3 + …)))).
void RungeKuttaIntegrator::Interpolate(double time_s) {
  if (!has_interpolant_) PrepareInterpolant();
  const double s = (time_s - begin_s_) / (end_s_ - begin_s_);
  const size_t coefficients = was_high_ ? 7 : 4;
  for (Eigen::Index i = 0; i < states_.size(); i += kLanes) {
    Lane sum = Lane::Zero();
    for (size_t j = coefficients; j-- > 0;) {
      const double factor = was_high_ && j % 2 == 1 ? 1 - s : s;
      sum = factor * (sum + Lane::Map(interpolant_[j].data() + i));
    }
    Lane::Map(states_.data() + i) = Lane::Map(begin_.data() + i) + sum;
  }
}

void RungeKuttaIntegrator::PrepareInterpolant() {
  const double step_s = end_s_ - begin_s_;
  if (was_high_) {
    using Method = DormandPrince8;
    ComputeStages<Method, Method::kStages + 1, Method::kAllStages - 1>(begin_s_, step_s, begin_);
    order_.CountEvaluations(Method::kAllStages - 1 - Method::kStages);
    interpolant_[0] = end_ - begin_;
    interpolant_[1] = step_s * stages_[0] - interpolant_[0];
    interpolant_[2] = 2 * interpolant_[0] - step_s * (stages_[0] + stages_[Method::kStages]);
    SetInterpolant<Method::kD, 3>(step_s);
  } else {
    SetInterpolant<DormandPrince5::kP, 0>(step_s);
  }
  has_interpolant_ = true;
}

template <const auto& kRows, int kFirst>
void RungeKuttaIntegrator::SetInterpolant(double step_s) {
  const auto set = [&]<int kRow>() {
    const StageSum<InterpolantRow<kRows, kRow>> sum(stages_);
    double* const values = interpolant_[kFirst + kRow].data();
    const Eigen::Index size = states_.size();
    for (Eigen::Index i = 0; i < size; i += kLanes) Lane::Map(values + i) = step_s * sum.At(i);
  };
  [&]<int... kRow>(std::integer_sequence<int, kRow...>) { (set.template operator()<kRow>(), ...); }
  (std::make_integer_sequence<int, std::size(kRows)>());
}

void RungeKuttaIntegrator::Restart() {
  POLYEST_CHECK(time_s_ == end_s_);
  has_rates_ = false;
  scale_.ForgetFloors();
}

// The right-hand side is the same as before, and so are the floors and the length of the steps.
bool RungeKuttaIntegrator::RestartFrom(const ConstBlock& states) {
  POLYEST_CHECK(time_s_ == end_s_);
  states_ = states;
  end_ = states;
  scale_.Grow(end_);
  has_rates_ = false;
  return true;
}

// Estimates the largest |λ| of ∂f/∂x over the points by a few power iterations. They start from the
// last local error, in which a mode at the limit of stability dominates:
//   v ← (f(x + v) − f(x)) ÷ |λ|, |λ| = max_s |(J v)_s| w_s ÷ max_s |v_s| w_s for each point.
double RungeKuttaIntegrator::LargestRate() {
  const Values& weights = scale_.weights();
  Values direction = error_, rates = error_, moved = error_;
  system_->Derivatives(end_s_, end_, rates);
  double largest = 0;
  constexpr int kIterations = 4;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    // The length is that of the tolerance: small enough for linearity, large enough against
    // rounding errors.
    const Eigen::ArrayXd norm =
        (direction * weights).abs().rowwise().maxCoeff().max(std::numeric_limits<double>::min());
    direction.colwise() /= norm;
    system_->Derivatives(end_s_, end_ + direction, moved);
    direction = moved - rates;
    largest = (direction * weights).abs().rowwise().maxCoeff().maxCoeff();
  }
  return largest;
}

bool RungeKuttaIntegrator::LooksStiff() {
  constexpr int64_t kStepsBetweenLooks = 500;
  if (steps_ - steps_looked_at_ < kStepsBetweenLooks) return false;
  steps_looked_at_ = steps_;
  // On the negative real axis order 5 is stable for h |λ| ≤ 3.3 and order 8 for h |λ| ≤ 6. Steps
  // limited by accuracy are a few times shorter at the tolerances in use.
  const double near_the_limit = was_high_ ? 4 : 2;
  return (end_s_ - begin_s_) * LargestRate() > near_the_limit;
}

IntegratorOutcome RungeKuttaIntegrator::Outcome(Result result, double advance_s,
                                                double span_s) const {
  IntegratorOutcome outcome;
  outcome.ok = false;
  outcome.flag = -static_cast<int>(result);
  outcome.worst_point = scale_.worst_point();
  if (result == Result::kNoStepAccepted) {
    outcome.reason = "no step size gives an acceptable error";
  } else if (result == Result::kTooManySteps && !StandsStill(advance_s, time_s_, span_s)) {
    outcome.reason = "too many steps between two samples";
    outcome.too_many_steps = true;
  } else {
    outcome.reason = kStandstillReason;
  }
  return outcome;
}

}  // namespace

std::unique_ptr<BlockIntegrator> MakeRungeKuttaIntegrator(BlockSystem* system,
                                                          double relative_tolerance, double time_s,
                                                          const ConstBlock& states) {
  return std::make_unique<RungeKuttaIntegrator>(system, relative_tolerance, time_s, states);
}

}  // namespace polyest::internal
