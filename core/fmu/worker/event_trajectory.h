#pragma once

// One trajectory of an FMU for Model Exchange with events, integrated on its own by CVODE:
//
//   dx/dt = f(t, x, u(t)) between events; an event is where one of the event indicators
//   z_i(t, x, u) changes its sign, at the next event time that the FMU named, where it asks for one
//   after a completed step, and where an input jumps.
//
// At an event the FMU changes its discrete and perhaps its continuous states until it is settled,
// and the integration starts anew from there. The local error of state s is held to
//
//   |e_s| ≤ rtol · max(S_s, n_s/1000) + 1e-14,
//
// S_s the largest magnitude that the state has had and n_s its nominal value of the FMU.
//
// Backward differentiation formulas (method kStiff and kAuto), or Adams' (kExplicit), with a dense
// Jacobian from differences. Events that accumulate (a bouncing ball that comes to rest without
// saying so) fail the trajectory.

#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nonlinearsolver.h>
#include <sundials/sundials_nvector.h>

#include <limits>
#include <memory>
#include <string>

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
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  // Callbacks with this object as user data.
  static int RightHandSide(double time_s, N_Vector states, N_Vector derivatives, void* self);
  static int EventIndicators(double time_s, N_Vector states, double* indicators, void* self);
  static int ErrorWeights(N_Vector states, N_Vector weights, void* self);
  static void IgnoreMessage(int, const char*, const char*, char*, void*) {}

  void MakeSolver(IntegrationMethod method);
  // A first step that is small for an interval of this length.
  void Restart(double span_s);
  bool SetPoint(double time_s, N_Vector states);
  // Up to stop_s or to an event before it.
  bool Integrate(double stop_s, bool& event);
  bool CompleteStep(bool& event);
  bool HandleEvent();
  bool CheckAccumulation();
  bool Fail(int flag);
  bool Fail(const std::string& reason);
  bool FailSinceRead(const std::string& reason);
  // The FMU's states; the solver has one more if there are none.
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
  Vector largest_;  // S, floored by the nominal values
  double time_s_ = 0;
  double last_event_s_ = 0;
  double since_event_s_ = kInfinity;  // the time between the last two events
  double read_s_ = 0;                 // outputs were read
  int close_events_ = 0;
  int steps_ = 0;  // since the last sample
  PointFailure failure_;
};

}  // namespace polyest::internal
