#pragma once

// The base of the two SUNDIALS integrators of a block: context, error norm, vector of states, and
// the translation between the sample times asked for and the steps that the solver takes.

#include <sundials/sundials_context.h>
#include <sundials/sundials_nvector.h>

#include <Eigen/Core>
#include <memory>

#include "core/propagation/block_integrator.h"
#include "core/propagation/block_vector.h"
#include "core/propagation/error_floors.h"
#include "core/propagation/error_scale.h"

namespace polyest::internal {

struct VectorDestroyer {
  void operator()(N_Vector vector) const { N_VDestroy(vector); }
};
using OwnedVector = std::unique_ptr<_generic_N_Vector, VectorDestroyer>;

// Return codes of both solvers are equal: 0 and above is success, −1 is "too much work".
class SundialsIntegrator : public BlockIntegrator {
 public:
  SundialsIntegrator(BlockSystem* system, double relative_tolerance, double time_s,
                     const ConstBlock& states);

  double time_s() const override { return time_s_; }
  ConstBlock states() const override { return BlockValues(vector_.get()); }
  IntegratorOutcome AdvanceTo(double time_s, double stop_time_s, int max_steps,
                              Block states) override;
  void Restart() override;
  bool RestartFrom(const ConstBlock& states) override;

 protected:
  // Callbacks with this object as user data.
  static int RightHandSide(double time_s, N_Vector states, N_Vector derivatives, void* self);
  static int ErrorWeights(N_Vector states, N_Vector weights, void* self);
  // Drops the solvers' messages to stderr; their return codes contain all that is needed.
  static void IgnoreMessage(int, const char*, const char*, char*, void*) {}

  // The functions of the solver, which a derived class provides.
  virtual void SetFirstStep(double step_s) = 0;
  virtual int Evolve(double time_s, double stop_time_s, int max_steps, N_Vector states,
                     double* reached_s) = 0;
  virtual int Interpolate(double time_s, N_Vector states) = 0;
  virtual double InternalTime() const = 0;  // the end of the last step
  virtual double LastStep() const = 0;      // its length in s, 0 before the first
  virtual int Reset(double time_s, N_Vector states) = 0;
  virtual const char* InWords(int flag) const = 0;

  BlockSystem* system() const { return system_; }
  SUNContext context() const { return context_; }
  N_Vector vector() const { return vector_.get(); }
  ErrorScale& scale() { return scale_; }
  // For a solver that forgets its step size when it is reset.
  void ChooseFirstStepAgain() { first_step_set_ = false; }

 private:
  IntegratorOutcome Outcome(int flag, double advance_s, double span_s) const;

  BlockSystem* const system_;
  sundials::Context context_;
  ErrorScale scale_;
  ErrorFloors floors_;
  OwnedVector vector_;  // the states at time_s_
  double time_s_;
  double covered_s_;  // dense output reaches to here
  bool first_step_set_ = false;
};

}  // namespace polyest::internal
