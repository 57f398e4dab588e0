#include "core/propagation/bdf_integrator.h"

#include <cvode/cvode.h>
#include <cvode/cvode_ls.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_nvector.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "core/common/check.h"
#include "core/common/held_exception.h"
#include "core/propagation/block_vector.h"
#include "core/propagation/error_floors.h"
#include "core/propagation/error_scale.h"
#include "core/propagation/newton_matrix.h"

namespace polyest::internal {
namespace {

struct VectorDestroyer {
  void operator()(N_Vector vector) const { N_VDestroy(vector); }
};
using OwnedVector = std::unique_ptr<_generic_N_Vector, VectorDestroyer>;

struct SolverDestroyer {
  void operator()(void* memory) const { CVodeFree(&memory); }
};
using OwnedSolver = std::unique_ptr<void, SolverDestroyer>;

struct LinearSolverDestroyer {
  void operator()(SUNLinearSolver solver) const {
    solver->content = nullptr;  // the integrator, which it does not own
    SUNLinSolFreeEmpty(solver);
  }
};
using OwnedLinearSolver = std::unique_ptr<_generic_SUNLinearSolver, LinearSolverDestroyer>;

const char* InWords(int flag) {
  switch (flag) {
    case CV_SUCCESS:
    case CV_TSTOP_RETURN:
      return "success";
    case CV_TOO_MUCH_WORK:
      return "too many steps between two samples";
    case CV_TOO_MUCH_ACC:
      return "the tolerance is below rounding errors";
    case CV_ERR_FAILURE:
      return "no step size gives an acceptable error";
    case CV_CONV_FAILURE:
    case CV_NLS_FAIL:
      return "Newton's iteration does not converge at any step size";
    case CV_LSOLVE_FAIL:
      return "a linear system could not be solved";
    case CV_RHSFUNC_FAIL:
    case CV_FIRST_RHSFUNC_ERR:
    case CV_REPTD_RHSFUNC_ERR:
    case CV_UNREC_RHSFUNC_ERR:
      return "the derivatives could not be evaluated";
    case CV_TOO_CLOSE:
      return "the time to integrate to is too close";
    case CV_MEM_FAIL:
      return "out of memory";
    case CV_ILL_INPUT:
      return "the solver refused its input";
    case CV_VECTOROP_ERR:
      return "a vector operation failed";
    case CV_BAD_T:
      return "the time asked for lies outside the last step";
    default:
      return "the solver failed with a code of its own";
  }
}

class BdfIntegrator final : public BlockIntegrator {
 public:
  BdfIntegrator(BlockSystem* system, double relative_tolerance, double time_s,
                const ConstBlock& states);

  double time_s() const override { return time_s_; }
  ConstBlock states() const override { return BlockValues(vector()); }
  IntegratorOutcome AdvanceTo(double time_s, double stop_time_s, int max_steps,
                              Block states) override;
  void Restart() override;
  bool RestartFrom(const ConstBlock& states) override;

 private:
  static constexpr int kFailed = -1;  // a callback's failure that no shorter step mends

  // Callbacks with this object as user data.
  static int RightHandSide(double time_s, N_Vector states, N_Vector derivatives, void* self);
  static int ErrorWeights(N_Vector states, N_Vector weights, void* self);
  // Drops the solver's messages to stderr; its return codes contain all that is needed.
  static void IgnoreMessage(int, const char*, const char*, char*, void*) {}
  static SUNLinearSolver_Type LinearSolverType(SUNLinearSolver) {
    return SUNLINEARSOLVER_MATRIX_EMBEDDED;
  }
  static int SolveLinear(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, double) {
    auto* const integrator = static_cast<BdfIntegrator*>(solver->content);
    return integrator->held_.Guard(SUNLS_PACKAGE_FAIL_UNREC,
                                   [&] { return integrator->SolveNewton(x, b); });
  }

  int Evolve(double time_s, double stop_time_s, int max_steps);
  double InternalTime() const;  // the end of the last step
  double LastStep() const;      // its length in s, 0 before the first
  void Reset();
  IntegratorOutcome Outcome(int flag, double advance_s, double span_s) const;
  int SolveNewton(N_Vector x, N_Vector b);
  void UpdateNewtonMatrix(double time_s, const Eigen::ArrayXXd& states, double gamma);
  N_Vector vector() const { return vector_.get(); }
  void* memory() const { return memory_.get(); }

  BlockSystem* const system_;
  sundials::Context context_;
  ErrorScale scale_;
  ErrorFloors floors_;
  OwnedVector vector_;  // the states at time_s_
  double time_s_;
  double covered_s_;  // dense output reaches to here
  bool first_step_set_ = false;
  OwnedLinearSolver linear_solver_;
  OwnedSolver memory_;
  HeldException held_;  // of a callback
  NewtonMatrix newton_matrix_;
  double factored_gamma_ = 0;  // 0 before the first factorization
  long differentiated_at_step_ = 0;
  long convergence_failures_ = 0;
};

BdfIntegrator::BdfIntegrator(BlockSystem* system, double relative_tolerance, double time_s,
                             const ConstBlock& states)
    : system_(system),
      scale_(system->points(), system->states(), relative_tolerance),
      floors_(system, &scale_),
      vector_(NewBlockVector(system->points(), system->states(), &scale_, context_)),
      time_s_(time_s),
      covered_s_(time_s),
      linear_solver_(SUNLinSolNewEmpty(context_)),
      memory_(CVodeCreate(CV_BDF, context_)),
      newton_matrix_(system) {
  POLYEST_CHECK(memory_ != nullptr && linear_solver_ != nullptr);
  BlockValues(vector()) = states;
  scale_.Grow(BlockValues(vector()));
  linear_solver_->ops->gettype = LinearSolverType;
  linear_solver_->ops->solve = SolveLinear;
  linear_solver_->content = this;
  // The first step is a guess, so more rejections are allowed than the defaults of seven and ten.
  constexpr int kMaxFailures = 30;
  const bool accepted =
      CVodeSetErrHandlerFn(memory(), IgnoreMessage, nullptr) == CV_SUCCESS &&
      CVodeInit(memory(), RightHandSide, time_s, vector()) == CV_SUCCESS &&
      CVodeSetUserData(memory(), this) == CV_SUCCESS &&
      CVodeWFtolerances(memory(), ErrorWeights) == CV_SUCCESS &&
      CVodeSetLinearSolver(memory(), linear_solver_.get(), nullptr) == CV_SUCCESS &&
      CVodeSetMaxErrTestFails(memory(), kMaxFailures) == CV_SUCCESS &&
      CVodeSetMaxConvFails(memory(), kMaxFailures) == CV_SUCCESS &&
      CVodeSetMaxHnilWarns(memory(), -1) == CV_SUCCESS;
  POLYEST_CHECK(accepted);
}

int BdfIntegrator::RightHandSide(double time_s, N_Vector states, N_Vector derivatives, void* self) {
  auto* const integrator = static_cast<BdfIntegrator*>(self);
  return integrator->held_.Guard(kFailed, [&] {
    const Eigen::ArrayXXd& x = BlockValues(states);
    integrator->scale_.Watch(&x);
    // A value that is not finite is left to the error norm, which identifies the point and makes
    // the solver shorten the step.
    integrator->system_->Derivatives(time_s, x, BlockValues(derivatives));
    return 0;
  });
}

int BdfIntegrator::ErrorWeights(N_Vector states, N_Vector weights, void* self) {
  auto* const integrator = static_cast<BdfIntegrator*>(self);
  return integrator->held_.Guard(kFailed, [&] {
    integrator->scale_.Grow(BlockValues(states));
    BlockValues(weights) = integrator->scale_.weights();
    return 0;
  });
}

IntegratorOutcome BdfIntegrator::Outcome(int flag, double advance_s, double span_s) const {
  IntegratorOutcome outcome;
  if (flag >= 0) return outcome;
  outcome.ok = false;
  outcome.flag = flag;
  outcome.reason = InWords(flag);
  outcome.worst_point = scale_.worst_point();
  outcome.too_many_steps = flag == CV_TOO_MUCH_WORK;
  if (outcome.too_many_steps && StandsStill(advance_s, time_s_, span_s)) {
    outcome.too_many_steps = false;
    outcome.reason = kStandstillReason;
  }
  return outcome;
}

IntegratorOutcome BdfIntegrator::AdvanceTo(double time_s, double stop_time_s, int max_steps,
                                           Block states) {
  POLYEST_CHECK(time_s >= time_s_ && stop_time_s >= time_s);
  int flag = 0;
  const double before_s = std::max(time_s_, covered_s_);
  const double span_s = time_s - time_s_;
  if (time_s > covered_s_) {
    const Eigen::ArrayXXd& x = BlockValues(vector());
    const double step_s =
        first_step_set_ && LastStep() > 0 ? LastStep() : floors_.FirstStep(time_s_, x, span_s);
    floors_.Update(time_s_, x, step_s, span_s);
    if (!first_step_set_) CVodeSetInitStep(memory(), step_s);
    first_step_set_ = true;
    // SUNDIALS cannot unset a stop time, so a time that is never reached is used for "none".
    const double stop_s = std::min(stop_time_s, std::numeric_limits<double>::max());
    flag = Evolve(time_s, stop_s, max_steps);
    covered_s_ = std::max(InternalTime(), time_s_);
  } else if (time_s > time_s_) {
    flag = CVodeGetDky(memory(), time_s, 0, vector());
    if (flag >= 0) time_s_ = time_s;
  }
  if (flag >= 0) states = BlockValues(vector());
  return Outcome(flag, covered_s_ - before_s, span_s);
}

int BdfIntegrator::Evolve(double time_s, double stop_time_s, int max_steps) {
  CVodeSetMaxNumSteps(memory(), max_steps);
  CVodeSetStopTime(memory(), stop_time_s);
  const int flag = CVode(memory(), time_s, vector(), &time_s_, CV_NORMAL);
  held_.Rethrow();
  return flag;
}

double BdfIntegrator::InternalTime() const {
  double time_s = 0;
  CVodeGetCurrentTime(memory(), &time_s);
  return time_s;
}

double BdfIntegrator::LastStep() const {
  double step_s = 0;
  CVodeGetLastStep(memory(), &step_s);
  return step_s;
}

void BdfIntegrator::Reset() {
  factored_gamma_ = 0;
  differentiated_at_step_ = 0;
  convergence_failures_ = 0;
  first_step_set_ = false;  // the solver forgets its step size
  POLYEST_CHECK(CVodeReInit(memory(), time_s_, vector()) == CV_SUCCESS);
  covered_s_ = time_s_;
}

// The right-hand side is the same as before, and so are the floors.
bool BdfIntegrator::RestartFrom(const ConstBlock& states) {
  BlockValues(vector()) = states;
  scale_.Grow(BlockValues(vector()));
  Reset();
  return true;
}

void BdfIntegrator::Restart() {
  Reset();
  scale_.ForgetFloors();
}

void BdfIntegrator::UpdateNewtonMatrix(double time_s, const Eigen::ArrayXXd& states, double gamma) {
  constexpr long kMaxSteps = 20;
  constexpr double kMaxChange = 0.3;
  long steps = 0;
  long failures = 0;
  CVodeGetNumSteps(memory(), &steps);
  CVodeGetNumNonlinSolvConvFails(memory(), &failures);
  const bool differentiate = factored_gamma_ == 0 || failures != convergence_failures_ ||
                             steps >= differentiated_at_step_ + kMaxSteps;
  if (differentiate) {
    newton_matrix_.Differentiate(time_s, states, scale_);
    differentiated_at_step_ = steps;
    convergence_failures_ = failures;
  }
  if (differentiate || !(std::abs(gamma / factored_gamma_ - 1) <= kMaxChange)) {
    newton_matrix_.Factor(gamma);
    factored_gamma_ = gamma;
  }
}

int BdfIntegrator::SolveNewton(N_Vector x, N_Vector b) {
  double time_s = 0, gamma = 0, rl1 = 0;
  N_Vector predicted, states, rates, zn1;
  void* user_data;
  const int flag = CVodeGetNonlinearSystemData(memory(), &time_s, &predicted, &states, &rates,
                                               &gamma, &rl1, &zn1, &user_data);
  if (flag != CV_SUCCESS) return SUNLS_PACKAGE_FAIL_UNREC;
  UpdateNewtonMatrix(time_s, BlockValues(states), gamma);
  BlockValues(x) = BlockValues(b);
  newton_matrix_.SolveInPlace(BlockValues(x));
  if (gamma != factored_gamma_) BlockValues(x) *= 2 / (1 + gamma / factored_gamma_);
  return SUNLS_SUCCESS;
}

}  // namespace

std::unique_ptr<BlockIntegrator> MakeBdfIntegrator(BlockSystem* system, double relative_tolerance,
                                                   double time_s, const ConstBlock& states) {
  return std::make_unique<BdfIntegrator>(system, relative_tolerance, time_s, states);
}

}  // namespace polyest::internal
