#pragma once

// One trajectory of an FMU for Model Exchange with events, integrated by its own CVODE solver:
//
//   dx/dt = f(t, x, u(t)) between events.
//
// An event occurs where an event indicator z_i(t, x, u) changes its sign, at the next event time
// that the FMU announced, where the FMU requests one after a completed step, and where an input
// jumps.
//
// At an event the FMU updates its discrete and possibly its continuous states until they settle.
// The integration restarts from there. The local error of state s is bounded by
//
//   |e_s| ≤ rtol · max(S_s, n_s/1000) + 1e-14,
//
// where S_s is the largest magnitude that the state has had and n_s its nominal value according to
// the FMU.
//
// The method is a backward differentiation formula (kStiff and kAuto) or an Adams formula
// (kExplicit). The former uses a dense Jacobian from finite differences. Events that accumulate (a
// bouncing ball that comes to rest without the FMU handling it) fail the trajectory.

#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nonlinearsolver.h>
#include <sundials/sundials_nvector.h>

#include <memory>
#include <string>

#include "core/common/held_exception.h"
#include "core/common/types.h"
#include "core/fmu/worker/instance.h"
#include "core/fmu/worker/pointwise_ensemble.h"
#include "core/propagation/block_inputs.h"

namespace polyest::internal {

class EventTrajectory final : public PointTrajectory {
 public:
  EventTrajectory(const InstanceFactory* factory, std::unique_ptr<Instance> instance,
                  BlockInputs inputs, const IntegrationOptions& options);
  ~EventTrajectory() override;

  bool AdvanceTo(double time_s) override;
  bool ReadOutputs(double* outputs) override;
  PointFailure failure() const override;

 private:
  static constexpr int kFailed = -1;  // a callback's failure that no shorter step mends

  // Callbacks of CVODE; the user data is this object.
  static int RightHandSide(double time_s, N_Vector states, N_Vector derivatives, void* self);
  static int EventIndicators(double time_s, N_Vector states, double* indicators, void* self);
  static int ErrorWeights(N_Vector states, N_Vector weights, void* self);
  static void IgnoreMessage(int, const char*, const char*, char*, void*) {}

  void MakeSolver(IntegrationMethod method);
  // Restarts the solver at the present time and states. `span_s` is the time until the next break
  // or sample; the first step is a small fraction of it.
  void Restart(double span_s);
  bool SetPoint(double time_s, N_Vector states);
  // Integrates to stop_s or to an event before it, and sets `event` if there was one.
  bool Integrate(double stop_s, bool& event);
  bool CompleteStep(bool& event);
  bool HandleEvent();
  bool CheckAccumulation();
  bool Fail(int flag);
  bool Fail(const std::string& reason);
  bool FailSinceRead(const std::string& reason);
  // Returns the FMU's states. The vector holds one more element if the FMU has no states.
  std::span<double> States(N_Vector vector) const;

  const InstanceFactory& factory_;
  std::unique_ptr<Instance> instance_;
  BlockInputs inputs_;
  const double relative_tolerance_;
  const int max_steps_;
  sundials::Context context_;
  N_Vector states_ = nullptr;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver linear_solver_ = nullptr;
  SUNNonlinearSolver fixed_point_ = nullptr;
  void* solver_ = nullptr;
  Vector largest_;  // S_s, at least n_s/1000
  double time_s_ = 0;
  double last_event_s_ = 0;
  double since_event_s_ = kInfinity;  // time between the last two events
  double read_s_ = 0;                 // when the outputs were last read
  int close_events_ = 0;
  int steps_ = 0;       // number since the last sample
  HeldException held_;  // of a callback
  PointFailure failure_;
};

}  // namespace polyest::internal
