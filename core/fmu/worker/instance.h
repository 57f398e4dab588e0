#pragma once

// One instance of an FMU for one point: the calls in the order that the standard demands, what went
// wrong in words, and the status page kept up to date.
//
// Calls answer whether they succeeded. After an error nothing is asked of the instance any more; a
// value that the FMU discarded may be asked for again elsewhere.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/fmu/worker/binding.h"
#include "core/fmu/worker/monitor.h"

namespace polyest::internal {

// What one worker's instances have in common.
class Instance;

struct InstanceFactory {
  FmuInterface interface;
  std::vector<FmuVariable> parameters, inputs, outputs;
  double relative_tolerance = 0;
  FmuLibrary* library = nullptr;
  Monitor* monitor = nullptr;

  std::string said;  // by the FMU, during the present call
  FmuLog log;
  // Of an FMU that can be instantiated only once: its one instance, its state before all
  // initialization, and whose state it has at present.
  std::unique_ptr<Binding> shared;
  void* untouched = nullptr;
  Instance* active = nullptr;
};

class Instance {
 public:
  // Instantiated and initialized with these values, at t = 0; of Model Exchange also through its
  // first event iteration into continuous time. failure() tells of one that failed.
  Instance(InstanceFactory* factory, int point, std::span<const double> parameters,
           std::span<const double> inputs);
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  // Empty, or the last thing that went wrong.
  const std::string& failure() const { return failure_; }
  int failure_status() const { return failure_status_; }
  bool broken() const { return broken_; }

  bool SetInputs(const double* values);
  bool GetOutputs(double* values);

  // Model Exchange. +∞: no next event.
  double next_event_s() const { return next_event_s_; }
  bool SetPoint(double time_s, std::span<const double> states);
  bool GetStates(std::span<double> states);
  bool GetNominals(std::span<double> nominals);
  bool GetDerivatives(std::span<double> derivatives);
  bool GetEventIndicators(std::span<double> indicators);
  // `event`: the FMU wants an event now.
  bool CompletedStep(bool& event);
  // Event mode, event iteration, continuous time again: the states may be others afterwards.
  bool HandleEvent();

  // Co-Simulation.
  bool SetInputRates(const double* rates);
  bool DoStep(double time_s, double step_s);

 private:
  bool Instantiate();
  bool Activate();
  bool Initialize(std::span<const double> parameters, std::span<const double> inputs);
  bool IterateEvents();
  bool Fail(int status, const std::string& what);
  template <class Call>
  bool Do(FmuCall kind, Call call);

  InstanceFactory& factory_;
  const int point_;
  double time_s_ = 0;
  double next_event_s_;
  std::string failure_;
  int failure_status_ = 0;
  bool broken_ = false;
  std::unique_ptr<Binding> own_;
  Binding* binding_ = nullptr;  // own_ or the shared one
  void* state_ = nullptr;       // saved, while another has the shared one
};

}  // namespace polyest::internal
