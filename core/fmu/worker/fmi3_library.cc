#include <algorithm>
#include <utility>

#include "core/common/shared_library.h"
#include "core/common/status.h"
#include "core/fmu/worker/binding.h"
#include "core/fmu/worker/fmi3_api.h"

namespace polyest::internal {
namespace {

struct Functions {
  fmi3::InstantiateModelExchange* instantiate_model_exchange = nullptr;
  fmi3::InstantiateCoSimulation* instantiate_co_simulation = nullptr;
  fmi3::EnterInitializationMode* enter_initialization = nullptr;
  fmi3::Simple* exit_initialization = nullptr;
  fmi3::Get<double>* get_float64 = nullptr;
  fmi3::Set<double>* set_float64 = nullptr;
  fmi3::Get<float>* get_float32 = nullptr;
  fmi3::Set<float>* set_float32 = nullptr;
  fmi3::GetState* get_state = nullptr;
  fmi3::SetState* set_state = nullptr;

  fmi3::Simple* enter_event_mode = nullptr;
  fmi3::UpdateDiscreteStates* update_discrete_states = nullptr;
  fmi3::Simple* enter_continuous_time = nullptr;
  fmi3::CompletedIntegratorStep* completed_step = nullptr;
  fmi3::SetTime* set_time = nullptr;
  fmi3::SetVector* set_states = nullptr;
  fmi3::GetVector* get_states = nullptr;
  fmi3::GetVector* get_nominals = nullptr;
  fmi3::GetVector* get_derivatives = nullptr;
  fmi3::GetVector* get_event_indicators = nullptr;

  fmi3::DoStep* do_step = nullptr;
};

absl::Status BindCommon(const SharedLibrary& library, bool with_state, Functions& f) {
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3EnterInitializationMode", f.enter_initialization));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3ExitInitializationMode", f.exit_initialization));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3GetFloat64", f.get_float64));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3SetFloat64", f.set_float64));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3GetFloat32", f.get_float32));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3SetFloat32", f.set_float32));
  if (!with_state) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3GetFMUState", f.get_state));
  return library.Bind("fmi3SetFMUState", f.set_state);
}

absl::Status BindModelExchange(const SharedLibrary& library, Functions& f) {
  POLYEST_RETURN_IF_ERROR(
      library.Bind("fmi3InstantiateModelExchange", f.instantiate_model_exchange));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3EnterEventMode", f.enter_event_mode));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3UpdateDiscreteStates", f.update_discrete_states));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3EnterContinuousTimeMode", f.enter_continuous_time));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3CompletedIntegratorStep", f.completed_step));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3SetTime", f.set_time));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3SetContinuousStates", f.set_states));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3GetContinuousStates", f.get_states));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3GetNominalsOfContinuousStates", f.get_nominals));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3GetContinuousStateDerivatives", f.get_derivatives));
  return library.Bind("fmi3GetEventIndicators", f.get_event_indicators);
}

absl::Status BindCoSimulation(const SharedLibrary& library, Functions& f) {
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi3InstantiateCoSimulation", f.instantiate_co_simulation));
  return library.Bind("fmi3DoStep", f.do_step);
}

void LogMessage(void* environment, fmi3::Status, const char*, const char* message) {
  if (environment == nullptr || message == nullptr) return;
  (*static_cast<const FmuLog*>(environment))(message);
}

class Fmi3Binding final : public Binding {
 public:
  Fmi3Binding(const Functions* functions, const FmuLog* log) : f_(*functions), log_(log) {}

  bool Instantiate(const FmuInterface& interface, const std::string& name,
                   const std::string& resources) {
    void* const log = const_cast<FmuLog*>(log_);
    const char* const token = interface.token.c_str();
    // No event mode, no early return, no intermediate values.
    instance_ =
        interface.kind == FmuKind::kModelExchange
            ? f_.instantiate_model_exchange(name.c_str(), token, resources.c_str(), false, false,
                                            log, LogMessage)
            : f_.instantiate_co_simulation(name.c_str(), token, resources.c_str(), false, false,
                                           false, false, nullptr, 0, log, LogMessage, nullptr);
    return instance_ != nullptr;
  }

  int EnterInitialization(double tolerance) override {
    return f_.enter_initialization(instance_, true, tolerance, 0, false, 0);
  }
  int ExitInitialization() override { return f_.exit_initialization(instance_); }
  int Set(std::span<const FmuVariable> variables, const double* values) override;
  int Get(std::span<const FmuVariable> variables, double* values) override;
  int SaveState(void** state) override { return f_.get_state(instance_, state); }
  int RestoreState(void* state) override { return f_.set_state(instance_, state); }

  int EnterEventMode() override { return f_.enter_event_mode(instance_); }
  int UpdateDiscreteStates(EventUpdate& update) override {
    bool nominals_changed = false, states_changed = false;
    return f_.update_discrete_states(instance_, &update.again, &update.terminate, &nominals_changed,
                                     &states_changed, &update.next_time_defined,
                                     &update.next_time_s);
  }
  int EnterContinuousTime() override { return f_.enter_continuous_time(instance_); }
  int CompletedStep(bool& enter_event_mode, bool& terminate) override {
    return f_.completed_step(instance_, true, &enter_event_mode, &terminate);
  }
  int SetTime(double time_s) override { return f_.set_time(instance_, time_s); }
  int SetStates(std::span<const double> states) override {
    return f_.set_states(instance_, states.data(), states.size());
  }
  int GetStates(std::span<double> states) override {
    return f_.get_states(instance_, states.data(), states.size());
  }
  int GetNominals(std::span<double> nominals) override {
    return f_.get_nominals(instance_, nominals.data(), nominals.size());
  }
  int GetDerivatives(std::span<double> derivatives) override {
    return f_.get_derivatives(instance_, derivatives.data(), derivatives.size());
  }
  int GetEventIndicators(std::span<double> indicators) override {
    return f_.get_event_indicators(instance_, indicators.data(), indicators.size());
  }

  // FMI 3.0 has no input derivatives.
  int SetInputDerivatives(std::span<const FmuVariable>, const double*) override { return 0; }
  int DoStep(double time_s, double step_s, bool& terminate) override {
    bool event_needed = false, early_return = false;
    double last_time_s = time_s;
    const int status = f_.do_step(instance_, time_s, step_s, true, &event_needed, &terminate,
                                  &early_return, &last_time_s);
    // A step that ended early without permission counts as not done.
    return early_return && IsGood(status) ? kFmuDiscard : status;
  }

 private:
  const fmi3::Reference* References(std::span<const FmuVariable> variables) {
    references_.clear();
    for (const FmuVariable& variable : variables) references_.push_back(variable.reference);
    return references_.data();
  }
  // Calls `access` for one variable after the other. Returns the first status that is not good, or
  // the worst one.
  template <class Access>
  static int ForEachVariable(std::span<const FmuVariable> variables, const Access& access) {
    int worst = kFmuOk;
    for (size_t i = 0; i < variables.size(); ++i) {
      const fmi3::Reference reference = variables[i].reference;
      const int status = access(i, &reference);
      if (!IsGood(status)) return status;
      worst = std::max(worst, status);
    }
    return worst;
  }
  static bool AllFloat64(std::span<const FmuVariable> variables) {
    return std::none_of(variables.begin(), variables.end(),
                        [](const FmuVariable& variable) { return variable.is_float32; });
  }

  const Functions& f_;
  const FmuLog* log_;
  fmi3::Instance instance_ = nullptr;
  std::vector<fmi3::Reference> references_;
};

int Fmi3Binding::Set(std::span<const FmuVariable> variables, const double* values) {
  const size_t count = variables.size();
  if (AllFloat64(variables)) {
    return f_.set_float64(instance_, References(variables), count, values, count);
  }
  return ForEachVariable(variables, [&](size_t i, const fmi3::Reference* reference) {
    const auto single = static_cast<float>(values[i]);
    return variables[i].is_float32 ? f_.set_float32(instance_, reference, 1, &single, 1)
                                   : f_.set_float64(instance_, reference, 1, &values[i], 1);
  });
}

int Fmi3Binding::Get(std::span<const FmuVariable> variables, double* values) {
  const size_t count = variables.size();
  if (AllFloat64(variables)) {
    return f_.get_float64(instance_, References(variables), count, values, count);
  }
  return ForEachVariable(variables, [&](size_t i, const fmi3::Reference* reference) {
    if (!variables[i].is_float32) {
      return f_.get_float64(instance_, reference, 1, &values[i], 1);
    }
    float single = 0;
    const int status = f_.get_float32(instance_, reference, 1, &single, 1);
    values[i] = single;
    return status;
  });
}

class Fmi3Library final : public FmuLibrary {
 public:
  // The standard requires the path of the resources to end with a separator.
  Fmi3Library(SharedLibrary library, const FmuInterface& interface, const std::string& resources)
      : library_(std::move(library)), interface_(interface), resources_(resources + "/") {}

  absl::Status Bind() {
    POLYEST_RETURN_IF_ERROR(BindCommon(library_, interface_.can_save_state, functions_));
    return interface_.kind == FmuKind::kModelExchange ? BindModelExchange(library_, functions_)
                                                      : BindCoSimulation(library_, functions_);
  }

  std::unique_ptr<Binding> Instantiate(const std::string& name, const FmuLog* log) override {
    auto binding = std::make_unique<Fmi3Binding>(&functions_, log);
    if (!binding->Instantiate(interface_, name, resources_)) return nullptr;
    return binding;
  }

 private:
  SharedLibrary library_;
  FmuInterface interface_;
  std::string resources_;
  Functions functions_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FmuLibrary>> LoadFmi3(const FmuInterface& interface,
                                                     const std::string& library,
                                                     const std::string& resources) {
  POLYEST_ASSIGN_OR_RETURN(SharedLibrary loaded, SharedLibrary::Load(library, "its library"));
  auto fmu = std::make_unique<Fmi3Library>(std::move(loaded), interface, resources);
  POLYEST_RETURN_IF_ERROR(fmu->Bind());
  return fmu;
}

}  // namespace polyest::internal
