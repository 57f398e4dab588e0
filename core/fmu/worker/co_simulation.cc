#include "core/fmu/worker/co_simulation.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/propagation/output_limit.h"

namespace polyest::internal {
namespace {

// Communication points closer than this fraction of a step are treated as one.
constexpr double kCloseness = 1e-6;

}  // namespace

CoSimulationPoint::CoSimulationPoint(const FmuInterface* interface,
                                     std::unique_ptr<Instance> instance, BlockInputs inputs,
                                     int input_count, int output_count)
    : interface_(*interface),
      instance_(std::move(instance)),
      inputs_(std::move(inputs)),
      input_count_(input_count),
      output_count_(output_count) {
  failure_ = instance_->failure();
}

// Returns the next multiple of the communication step after the present time.
double CoSimulationPoint::NextMultiple() const {
  const double step_s = interface_.communication_step_s;
  return (std::floor(time_s_ / step_s + kCloseness) + 1) * step_s;
}

bool CoSimulationPoint::AdvanceTo(double time_s) {
  if (!failure_.empty()) return false;
  const double close_s = kCloseness * interface_.communication_step_s;
  while (time_s > time_s_) {
    const double multiple_s = NextMultiple();
    double to_s = multiple_s < time_s - close_s ? multiple_s : time_s;
    if (!interface_.can_vary_step && std::abs(to_s - multiple_s) > close_s) {
      failure_ = absl::StrFormat(
          "the FMU takes communication steps of %g s only, of which the time %g s is no multiple",
          interface_.communication_step_s, time_s);
      good_s_ = time_s_;
      return false;
    }
    while (inputs_.NextBreak().time_s <= time_s_ + close_s) {
      inputs_.Pass(inputs_.NextBreak().time_s);
    }
    const double break_s = inputs_.NextBreak().time_s;
    if (interface_.can_vary_step && break_s < to_s - close_s) to_s = break_s;
    if (!(to_s > time_s_)) {
      failure_ = absl::StrFormat("communication steps of %g s are too small to tell at t = %g s",
                                 interface_.communication_step_s, time_s_);
      good_s_ = time_s_;
      return false;
    }
    if (!Step(to_s)) return false;
  }
  return true;
}

bool CoSimulationPoint::Step(double to_s) {
  if (SetInputs(time_s_, to_s) && instance_->DoStep(time_s_, to_s - time_s_)) {
    time_s_ = to_s;
    return true;
  }
  failure_ = instance_->failure();
  good_s_ = time_s_;
  return false;
}

// Returns u(t); at a jump the value from the right.
Vector CoSimulationPoint::InputsAt(double time_s) {
  while (inputs_.NextBreak().time_s <= time_s) inputs_.Pass(inputs_.NextBreak().time_s);
  return inputs_.At(time_s).row(0).matrix().transpose();
}

bool CoSimulationPoint::SetInputs(double from_s, double to_s) {
  if (input_count_ == 0) return true;
  const double step_s = to_s - from_s;
  if (!interface_.can_interpolate_inputs) {
    // The inputs are held at u(t_k + h/2).
    return instance_->SetInputs(InputsAt(from_s + step_s / 2).data());
  }
  // The inputs follow u(t) = u(t_k) + (t − t_k) (u(t_{k+1}) − u(t_k))/h. The value at the end is
  // taken from the left, before a jump there.
  const Vector values = InputsAt(from_s);
  const Vector rates = (InputsAt(std::nextafter(to_s, from_s)) - values) / step_s;
  return instance_->SetInputs(values.data()) && instance_->SetInputRates(rates.data());
}

bool CoSimulationPoint::ReadOutputs(double* outputs) {
  if (!failure_.empty()) return false;
  const bool set = input_count_ == 0 || instance_->SetInputs(InputsAt(time_s_).data());
  if (!set || !instance_->GetOutputs(outputs)) {
    failure_ = instance_->failure();
    return false;
  }
  const char* const reason =
      FailureOfOutputs(Eigen::Map<const Eigen::ArrayXd>(outputs, output_count_));
  if (reason != nullptr) {
    failure_ = reason;
    return false;
  }
  good_s_ = time_s_;
  return true;
}

PointFailure CoSimulationPoint::failure() const {
  return {0, good_s_, instance_->failure_status(), failure_};
}

}  // namespace polyest::internal
