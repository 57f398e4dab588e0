#include "core/fmu/worker/instance.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "core/common/types.h"
#include "core/propagation/finite_parameters.h"

namespace polyest::internal {
namespace {

constexpr int kMaxEventIterations = 1'000;

const char* StatusInWords(int status) {
  switch (status) {
    case kFmuDiscard:
      return "discarded it";
    case kFmuError:
      return "reported an error";
    case kFmuFatal:
      return "reported a fatal error";
    default:
      return "answered with a status that is none";
  }
}

}  // namespace

Instance::Instance(InstanceFactory* factory, int point, std::span<const double> parameters,
                   std::span<const double> inputs)
    : factory_(*factory), point_(point), next_event_s_(kInfinity) {
  if (CheckFinite(parameters) && CheckFinite(inputs) && Instantiate()) {
    Initialize(parameters, inputs);
  }
}

// The FMU instance is not freed here: it ends with the process, and nothing in it needs to be kept.
Instance::~Instance() {
  if (factory_.active == this) factory_.active = nullptr;
}

bool Instance::CheckFinite(std::span<const double> values) {
  factory_.said.clear();
  const auto is_finite = [](double value) { return std::isfinite(value); };
  return std::ranges::all_of(values, is_finite) || Fail(kFmuError, kParametersNotFinite);
}

bool Instance::Instantiate() {
  const bool shares = factory_.interface.once_per_process && factory_.interface.can_save_state;
  factory_.monitor->Enter(FmuCall::kInstantiate, 0);
  if (!shares || factory_.shared == nullptr) {
    const std::string name = absl::StrCat(factory_.interface.name, "_", point_);
    factory_.said.clear();
    own_ = factory_.library->Instantiate(name, &factory_.log);
    if (own_ == nullptr) return Fail(kFmuError, "the FMU refused to be instantiated");
  }
  binding_ = own_.get();
  if (shares) {
    if (own_ != nullptr) factory_.shared = std::move(own_);
    binding_ = factory_.shared.get();
    if (factory_.untouched == nullptr && !IsGood(binding_->SaveState(&factory_.untouched))) {
      return Fail(kFmuError, "the FMU could not save its state");
    }
  }
  factory_.monitor->Leave();
  return true;
}

// Loads this Instance's state into the shared FMU instance, after saving that of the Instance
// before.
bool Instance::Activate() {
  if (factory_.shared == nullptr || factory_.active == this) return true;
  factory_.said.clear();
  factory_.monitor->Enter(FmuCall::kState, time_s_);
  Instance* const other = factory_.active;
  factory_.active = nullptr;
  if (other != nullptr && !other->broken_ && !IsGood(binding_->SaveState(&other->state_))) {
    other->Fail(kFmuError, "the FMU could not save its state");
  }
  void* const state = state_ == nullptr ? factory_.untouched : state_;
  if (!IsGood(binding_->RestoreState(state))) {
    return Fail(kFmuError, "the FMU could not restore its state");
  }
  factory_.active = this;
  return true;
}

// Calls `call`, which returns an FMI status.
template <class Call>
bool Instance::Do(FmuCall kind, Call call) {
  if (broken_ || !Activate()) return false;
  factory_.said.clear();
  factory_.monitor->Enter(kind, time_s_);
  const int status = call();
  factory_.monitor->Leave();
  if (IsGood(status)) return true;
  return Fail(status, absl::StrCat("the FMU ", StatusInWords(status), " while ", InWords(kind)));
}

bool Instance::Fail(int status, const std::string& what) {
  failure_ = factory_.said.empty() ? what : absl::StrCat(what, ": ", factory_.said);
  failure_status_ = status;
  broken_ = broken_ || status != kFmuDiscard;
  return false;
}

bool Instance::Initialize(std::span<const double> parameters, std::span<const double> inputs) {
  const bool initialized =
      (parameters.empty() ||
       Do(FmuCall::kSetVariables,
          [&] { return binding_->Set(factory_.parameters, parameters.data()); })) &&
      SetInputs(inputs.data()) &&
      Do(FmuCall::kInitialize,
         [&] { return binding_->EnterInitialization(factory_.relative_tolerance); }) &&
      Do(FmuCall::kInitialize, [&] { return binding_->ExitInitialization(); });
  if (!initialized) {
    // Initialization cannot be tried again at another point, so a discard is an error too.
    broken_ = true;
    return false;
  }
  if (factory_.interface.kind == FmuKind::kCoSimulation) return true;
  return IterateEvents();
}

bool Instance::IterateEvents() {
  EventUpdate update;
  int iterations = 0;
  do {
    update = {};
    if (++iterations > kMaxEventIterations) {
      return Fail(kFmuError, absl::StrCat("an event is not settled after ", kMaxEventIterations,
                                          " iterations"));
    }
    if (!Do(FmuCall::kEvents, [&] { return binding_->UpdateDiscreteStates(update); })) return false;
    if (update.terminate) return Fail(kFmuError, "the FMU asked for the end of the simulation");
  } while (update.again);
  next_event_s_ = update.next_time_defined ? update.next_time_s : kInfinity;
  return Do(FmuCall::kEvents, [&] { return binding_->EnterContinuousTime(); });
}

bool Instance::SetInputs(const double* values) {
  if (factory_.inputs.empty()) return !broken_;
  return Do(FmuCall::kSetVariables, [&] { return Pass(values); });
}

int Instance::Pass(const double* inputs) {
  const size_t count = factory_.inputs.size();
  if (!inputs_.empty() && std::equal(inputs_.begin(), inputs_.end(), inputs)) return 0;
  inputs_.clear();
  const int status = binding_->Set(factory_.inputs, inputs);
  // An FMU that interpolates its inputs moves them away from what was set.
  if (IsGood(status) && !factory_.interface.can_interpolate_inputs) {
    inputs_.assign(inputs, inputs + count);
  }
  return status;
}

bool Instance::GetOutputs(double* values) {
  if (factory_.outputs.empty()) return !broken_;
  return Do(FmuCall::kGetVariables, [&] { return binding_->Get(factory_.outputs, values); });
}

bool Instance::SetPoint(double time_s, std::span<const double> states, const double* inputs) {
  time_s_ = time_s;
  return Do(FmuCall::kSetVariables, [&] {
    int status = binding_->SetTime(time_s);
    if (IsGood(status) && !states.empty()) status = binding_->SetStates(states);
    if (IsGood(status) && !factory_.inputs.empty()) status = Pass(inputs);
    return status;
  });
}

bool Instance::GetStates(std::span<double> states) {
  return states.empty() || Do(FmuCall::kDerivatives, [&] { return binding_->GetStates(states); });
}

bool Instance::GetNominals(std::span<double> nominals) {
  return nominals.empty() ||
         Do(FmuCall::kDerivatives, [&] { return binding_->GetNominals(nominals); });
}

bool Instance::GetDerivatives(std::span<double> derivatives) {
  return derivatives.empty() ||
         Do(FmuCall::kDerivatives, [&] { return binding_->GetDerivatives(derivatives); });
}

bool Instance::GetEventIndicators(std::span<double> indicators) {
  return indicators.empty() ||
         Do(FmuCall::kEvents, [&] { return binding_->GetEventIndicators(indicators); });
}

bool Instance::CompletedStep(bool& event) {
  bool terminate = false;
  if (!Do(FmuCall::kEvents, [&] { return binding_->CompletedStep(event, terminate); })) {
    return false;
  }
  return !terminate || Fail(kFmuError, "the FMU asked for the end of the simulation");
}

bool Instance::HandleEvent() {
  return Do(FmuCall::kEvents, [&] { return binding_->EnterEventMode(); }) && IterateEvents();
}

bool Instance::SetInputRates(const double* rates) {
  return Do(FmuCall::kSetVariables,
            [&] { return binding_->SetInputDerivatives(factory_.inputs, rates); });
}

bool Instance::DoStep(double time_s, double step_s) {
  time_s_ = time_s;
  bool terminate = false;
  if (!Do(FmuCall::kStep, [&] { return binding_->DoStep(time_s, step_s, terminate); })) {
    return false;
  }
  time_s_ = time_s + step_s;
  return !terminate || Fail(kFmuError, "the FMU asked for the end of the simulation");
}

}  // namespace polyest::internal
