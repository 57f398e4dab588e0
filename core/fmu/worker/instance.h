#pragma once

// One instance of an FMU for one point. It makes the calls in the order that the standard requires,
// describes failures in words, and updates the status page.
//
// Functions return whether they succeeded. After an error the FMU's functions are no longer called.
// After a status of "discard" they may be called again at another point.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/fmu/worker/binding.h"
#include "core/fmu/worker/monitor.h"

namespace polyest::internal {

// The data that all instances of one worker share.
class Instance;

struct InstanceFactory {
  FmuInterface interface;
  std::vector<FmuVariable> parameters, inputs, outputs;
  // For Model Exchange: the continuous states that the outputs are, if each of them is one. They
  // are known to the integrator, so that the FMU need not be called for them.
  std::vector<int> states_of_outputs;
  double relative_tolerance = 0;
  FmuLibrary* library = nullptr;
  Monitor* monitor = nullptr;

  std::string said;  // the FMU's message during the present call
  FmuLog log;
  // For an FMU that can be instantiated only once: its single instance, the state of that instance
  // before any initialization, and the Instance whose state it currently holds.
  std::unique_ptr<Binding> shared;
  void* untouched = nullptr;
  Instance* active = nullptr;
};

class Instance {
 public:
  // Instantiates and initializes the FMU with these values at t = 0, if they are finite. For Model
  // Exchange it also performs the first event iteration and enters continuous-time mode. If any of
  // this fails, failure() is not empty.
  Instance(InstanceFactory* factory, int point, std::span<const double> parameters,
           std::span<const double> inputs);
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  // Returns the last failure, or an empty string.
  const std::string& failure() const { return failure_; }
  int failure_status() const { return failure_status_; }
  // Whether an error has ended the use of the instance.
  bool broken() const { return broken_; }

  bool SetInputs(const double* values);
  bool GetOutputs(double* values);

  // Functions for Model Exchange. The next event time is +∞ if there is none.
  double next_event_s() const { return next_event_s_; }
  // Sets the time, the states and the inputs.
  bool SetPoint(double time_s, std::span<const double> states, const double* inputs);
  bool GetStates(std::span<double> states);
  bool GetNominals(std::span<double> nominals);
  bool GetDerivatives(std::span<double> derivatives);
  bool GetEventIndicators(std::span<double> indicators);
  // Notifies the FMU of a completed step. Sets `event` if the FMU requests an event now.
  bool CompletedStep(bool& event);
  // Enters event mode, iterates until the event is settled, and returns to continuous-time mode.
  // The states may differ afterwards.
  bool HandleEvent();

  // Functions for Co-Simulation.
  bool SetInputRates(const double* rates);
  bool DoStep(double time_s, double step_s);

 private:
  // Returns whether the values are finite; fails if not.
  bool CheckFinite(std::span<const double> values);
  bool Instantiate();
  bool Activate();
  bool Initialize(std::span<const double> parameters, std::span<const double> inputs);
  bool IterateEvents();
  bool Fail(int status, const std::string& what);
  // Passes the inputs to the FMU unless it has these already. Returns its status.
  int Pass(const double* inputs);
  template <class Call>
  bool Do(FmuCall kind, Call call);

  InstanceFactory& factory_;
  const int point_;
  double time_s_ = 0;
  std::vector<double> inputs_;  // those passed last, empty where there may be others
  double next_event_s_;
  std::string failure_;
  int failure_status_ = 0;
  bool broken_ = false;
  std::unique_ptr<Binding> own_;
  Binding* binding_ = nullptr;  // own_ or the shared instance
  void* state_ = nullptr;       // saved while another Instance uses the shared one
};

}  // namespace polyest::internal
