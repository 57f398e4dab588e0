#include <absl/strings/str_format.h>

#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "core/common/shared_library.h"
#include "core/common/status.h"
#include "core/fmu/worker/binding.h"
#include "core/fmu/worker/fmi2_api.h"

namespace polyest::internal {
namespace {

struct Functions {
  fmi2::Instantiate* instantiate = nullptr;
  fmi2::SetupExperiment* setup_experiment = nullptr;
  fmi2::Simple* enter_initialization = nullptr;
  fmi2::Simple* exit_initialization = nullptr;
  fmi2::GetReal* get_real = nullptr;
  fmi2::SetReal* set_real = nullptr;
  fmi2::GetState* get_state = nullptr;
  fmi2::SetState* set_state = nullptr;

  fmi2::Simple* enter_event_mode = nullptr;
  fmi2::NewDiscreteStates* new_discrete_states = nullptr;
  fmi2::Simple* enter_continuous_time = nullptr;
  fmi2::CompletedIntegratorStep* completed_step = nullptr;
  fmi2::SetTime* set_time = nullptr;
  fmi2::SetVector* set_states = nullptr;
  fmi2::GetVector* get_states = nullptr;
  fmi2::GetVector* get_nominals = nullptr;
  fmi2::GetVector* get_derivatives = nullptr;
  fmi2::GetVector* get_event_indicators = nullptr;

  fmi2::SetInputDerivatives* set_input_derivatives = nullptr;
  fmi2::DoStep* do_step = nullptr;
};

absl::Status BindCommon(const SharedLibrary& library, bool with_state, Functions& f) {
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2Instantiate", f.instantiate));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2SetupExperiment", f.setup_experiment));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2EnterInitializationMode", f.enter_initialization));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2ExitInitializationMode", f.exit_initialization));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2GetReal", f.get_real));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2SetReal", f.set_real));
  if (!with_state) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2GetFMUstate", f.get_state));
  return library.Bind("fmi2SetFMUstate", f.set_state);
}

absl::Status BindModelExchange(const SharedLibrary& library, Functions& f) {
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2EnterEventMode", f.enter_event_mode));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2NewDiscreteStates", f.new_discrete_states));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2EnterContinuousTimeMode", f.enter_continuous_time));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2CompletedIntegratorStep", f.completed_step));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2SetTime", f.set_time));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2SetContinuousStates", f.set_states));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2GetContinuousStates", f.get_states));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2GetNominalsOfContinuousStates", f.get_nominals));
  POLYEST_RETURN_IF_ERROR(library.Bind("fmi2GetDerivatives", f.get_derivatives));
  return library.Bind("fmi2GetEventIndicators", f.get_event_indicators);
}

absl::Status BindCoSimulation(const SharedLibrary& library, bool interpolates, Functions& f) {
  if (interpolates) {
    POLYEST_RETURN_IF_ERROR(library.Bind("fmi2SetRealInputDerivatives", f.set_input_derivatives));
  }
  return library.Bind("fmi2DoStep", f.do_step);
}

// Returns the path as a file URI; characters that are not allowed in a URI become %XX.
std::string FileUri(const std::string& path) {
  std::string uri = "file://";
  for (const char c : path) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::string_view("/-_.~").find(c) != std::string_view::npos;
    if (plain) {
      uri += c;
    } else {
      absl::StrAppendFormat(&uri, "%%%02X", static_cast<unsigned char>(c));
    }
  }
  return uri;
}

// FMI 2.0 formats messages by printf's conventions.
[[gnu::format(printf, 5, 6)]] void LogMessage(void* environment, const char*, fmi2::Status,
                                              const char*, const char* message, ...) {
  if (environment == nullptr || message == nullptr) return;
  char text[512];
  std::va_list arguments;
  va_start(arguments, message);
  std::vsnprintf(text, sizeof(text), message, arguments);
  va_end(arguments);
  (*static_cast<const FmuLog*>(environment))(text);
}

class Fmi2Binding final : public Binding {
 public:
  Fmi2Binding(const Functions* functions, const FmuLog* log)
      : f_(*functions),
        callbacks_{LogMessage, std::calloc, std::free, nullptr, const_cast<FmuLog*>(log)} {}

  bool Instantiate(const FmuInterface& interface, const std::string& name,
                   const std::string& resources_uri) {
    const int type = interface.kind == FmuKind::kModelExchange ? fmi2::kTypeModelExchange
                                                               : fmi2::kTypeCoSimulation;
    component_ = f_.instantiate(name.c_str(), type, interface.token.c_str(), resources_uri.c_str(),
                                &callbacks_, 0, 0);
    return component_ != nullptr;
  }

  int EnterInitialization(double tolerance) override {
    const int status = f_.setup_experiment(component_, 1, tolerance, 0, 0, 0);
    return IsGood(status) ? f_.enter_initialization(component_) : status;
  }
  int ExitInitialization() override { return f_.exit_initialization(component_); }
  int Set(std::span<const FmuVariable> variables, const double* values) override {
    return f_.set_real(component_, References(variables), variables.size(), values);
  }
  int Get(std::span<const FmuVariable> variables, double* values) override {
    return f_.get_real(component_, References(variables), variables.size(), values);
  }
  int SaveState(void** state) override { return f_.get_state(component_, state); }
  int RestoreState(void* state) override { return f_.set_state(component_, state); }

  int EnterEventMode() override { return f_.enter_event_mode(component_); }
  int UpdateDiscreteStates(EventUpdate& update) override {
    fmi2::EventInfo info{};
    const int status = f_.new_discrete_states(component_, &info);
    update = {info.new_discrete_states_needed != 0, info.terminate_simulation != 0,
              info.next_event_time_defined != 0, info.next_event_time};
    return status;
  }
  int EnterContinuousTime() override { return f_.enter_continuous_time(component_); }
  int CompletedStep(bool& enter_event_mode, bool& terminate) override {
    fmi2::Boolean enter = 0, end = 0;
    const int status = f_.completed_step(component_, 1, &enter, &end);
    enter_event_mode = enter != 0;
    terminate = end != 0;
    return status;
  }
  int SetTime(double time_s) override { return f_.set_time(component_, time_s); }
  int SetStates(std::span<const double> states) override {
    return f_.set_states(component_, states.data(), states.size());
  }
  int GetStates(std::span<double> states) override {
    return f_.get_states(component_, states.data(), states.size());
  }
  int GetNominals(std::span<double> nominals) override {
    return f_.get_nominals(component_, nominals.data(), nominals.size());
  }
  int GetDerivatives(std::span<double> derivatives) override {
    return f_.get_derivatives(component_, derivatives.data(), derivatives.size());
  }
  int GetEventIndicators(std::span<double> indicators) override {
    return f_.get_event_indicators(component_, indicators.data(), indicators.size());
  }

  int SetInputDerivatives(std::span<const FmuVariable> inputs, const double* rates) override {
    orders_.assign(inputs.size(), 1);
    return f_.set_input_derivatives(component_, References(inputs), inputs.size(), orders_.data(),
                                    rates);
  }
  int DoStep(double time_s, double step_s, bool& terminate) override {
    terminate = false;
    return f_.do_step(component_, time_s, step_s, 1);
  }

 private:
  const fmi2::Reference* References(std::span<const FmuVariable> variables) {
    references_.clear();
    for (const FmuVariable& variable : variables) references_.push_back(variable.reference);
    return references_.data();
  }

  const Functions& f_;
  fmi2::Callbacks callbacks_;
  fmi2::Component component_ = nullptr;
  std::vector<fmi2::Reference> references_;
  std::vector<int> orders_;
};

class Fmi2Library final : public FmuLibrary {
 public:
  Fmi2Library(SharedLibrary library, const FmuInterface& interface, const std::string& resources)
      : library_(std::move(library)), interface_(interface), resources_uri_(FileUri(resources)) {}

  absl::Status Bind() {
    POLYEST_RETURN_IF_ERROR(BindCommon(library_, interface_.can_save_state, functions_));
    if (interface_.kind == FmuKind::kModelExchange) return BindModelExchange(library_, functions_);
    return BindCoSimulation(library_, interface_.can_interpolate_inputs, functions_);
  }

  std::unique_ptr<Binding> Instantiate(const std::string& name, const FmuLog* log) override {
    auto binding = std::make_unique<Fmi2Binding>(&functions_, log);
    if (!binding->Instantiate(interface_, name, resources_uri_)) return nullptr;
    return binding;
  }

 private:
  SharedLibrary library_;
  FmuInterface interface_;
  std::string resources_uri_;
  Functions functions_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FmuLibrary>> LoadFmi2(const FmuInterface& interface,
                                                     const std::string& library,
                                                     const std::string& resources) {
  POLYEST_ASSIGN_OR_RETURN(SharedLibrary loaded, SharedLibrary::Load(library, "its library"));
  auto fmu = std::make_unique<Fmi2Library>(std::move(loaded), interface, resources);
  POLYEST_RETURN_IF_ERROR(fmu->Bind());
  return fmu;
}

}  // namespace polyest::internal
