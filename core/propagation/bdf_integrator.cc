#include "core/propagation/bdf_integrator.h"

#include <cvode/cvode.h>
#include <cvode/cvode_ls.h>
#include <sundials/sundials_linearsolver.h>

#include <cmath>

#include "core/common/check.h"
#include "core/propagation/newton_matrix.h"
#include "core/propagation/sundials_integrator.h"

namespace polyest::internal {
namespace {

class BdfIntegrator final : public SundialsIntegrator {
 public:
  BdfIntegrator(BlockSystem* system, double relative_tolerance, double time_s,
                const ConstBlock& states);
  ~BdfIntegrator() override;

 private:
  static SUNLinearSolver_Type LinearSolverType(SUNLinearSolver) {
    return SUNLINEARSOLVER_MATRIX_EMBEDDED;
  }
  static int SolveLinear(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, double) {
    return static_cast<BdfIntegrator*>(solver->content)->SolveNewton(x, b);
  }

  void SetFirstStep(double step_s) override { CVodeSetInitStep(memory_, step_s); }
  int Evolve(double time_s, double stop_time_s, int max_steps, N_Vector states,
             double* reached_s) override;
  int Interpolate(double time_s, N_Vector states) override {
    return CVodeGetDky(memory_, time_s, 0, states);
  }
  double InternalTime() const override;
  double LastStep() const override;
  int Reset(double time_s, N_Vector states) override;
  const char* InWords(int flag) const override;
  int SolveNewton(N_Vector x, N_Vector b);
  void UpdateNewtonMatrix(double time_s, const Eigen::ArrayXXd& states, double gamma);

  void* memory_ = nullptr;
  SUNLinearSolver solver_ = nullptr;
  NewtonMatrix newton_matrix_;
  double factored_gamma_ = 0;  // 0 before the first factorization
  long differentiated_at_step_ = 0;
  long convergence_failures_ = 0;
};

BdfIntegrator::BdfIntegrator(BlockSystem* system, double relative_tolerance, double time_s,
                             const ConstBlock& states)
    : SundialsIntegrator(system, relative_tolerance, time_s, states),
      memory_(CVodeCreate(CV_BDF, context())),
      solver_(SUNLinSolNewEmpty(context())),
      newton_matrix_(system) {
  POLYEST_CHECK(memory_ != nullptr && solver_ != nullptr);
  solver_->ops->gettype = LinearSolverType;
  solver_->ops->solve = SolveLinear;
  solver_->content = this;
  // The first step is a guess, so more rejections are allowed than the defaults of seven and ten.
  constexpr int kMaxFailures = 30;
  const bool accepted =
      CVodeSetErrHandlerFn(memory_, IgnoreMessage, nullptr) == CV_SUCCESS &&
      CVodeInit(memory_, RightHandSide, time_s, vector()) == CV_SUCCESS &&
      CVodeSetUserData(memory_, static_cast<SundialsIntegrator*>(this)) == CV_SUCCESS &&
      CVodeWFtolerances(memory_, ErrorWeights) == CV_SUCCESS &&
      CVodeSetLinearSolver(memory_, solver_, nullptr) == CV_SUCCESS &&
      CVodeSetMaxErrTestFails(memory_, kMaxFailures) == CV_SUCCESS &&
      CVodeSetMaxConvFails(memory_, kMaxFailures) == CV_SUCCESS &&
      CVodeSetMaxHnilWarns(memory_, -1) == CV_SUCCESS;
  POLYEST_CHECK(accepted);
}

BdfIntegrator::~BdfIntegrator() {
  CVodeFree(&memory_);
  solver_->content = nullptr;
  SUNLinSolFreeEmpty(solver_);
}

int BdfIntegrator::Evolve(double time_s, double stop_time_s, int max_steps, N_Vector states,
                          double* reached_s) {
  CVodeSetMaxNumSteps(memory_, max_steps);
  CVodeSetStopTime(memory_, stop_time_s);
  return CVode(memory_, time_s, states, reached_s, CV_NORMAL);
}

double BdfIntegrator::InternalTime() const {
  double time_s = 0;
  CVodeGetCurrentTime(memory_, &time_s);
  return time_s;
}

double BdfIntegrator::LastStep() const {
  double step_s = 0;
  CVodeGetLastStep(memory_, &step_s);
  return step_s;
}

int BdfIntegrator::Reset(double time_s, N_Vector states) {
  factored_gamma_ = 0;
  differentiated_at_step_ = 0;
  convergence_failures_ = 0;
  ChooseFirstStepAgain();
  return CVodeReInit(memory_, time_s, states);
}

void BdfIntegrator::UpdateNewtonMatrix(double time_s, const Eigen::ArrayXXd& states, double gamma) {
  constexpr long kMaxSteps = 20;
  constexpr double kMaxChange = 0.3;
  long steps = 0;
  long failures = 0;
  CVodeGetNumSteps(memory_, &steps);
  CVodeGetNumNonlinSolvConvFails(memory_, &failures);
  const bool differentiate = factored_gamma_ == 0 || failures != convergence_failures_ ||
                             steps >= differentiated_at_step_ + kMaxSteps;
  if (differentiate) {
    newton_matrix_.Differentiate(time_s, states, scale());
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
  const int flag = CVodeGetNonlinearSystemData(memory_, &time_s, &predicted, &states, &rates,
                                               &gamma, &rl1, &zn1, &user_data);
  if (flag != CV_SUCCESS) return SUNLS_PACKAGE_FAIL_UNREC;
  UpdateNewtonMatrix(time_s, BlockValues(states), gamma);
  BlockValues(x) = BlockValues(b);
  newton_matrix_.SolveInPlace(BlockValues(x));
  if (gamma != factored_gamma_) BlockValues(x) *= 2 / (1 + gamma / factored_gamma_);
  return SUNLS_SUCCESS;
}

const char* BdfIntegrator::InWords(int flag) const {
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

}  // namespace

std::unique_ptr<BlockIntegrator> MakeBdfIntegrator(BlockSystem* system, double relative_tolerance,
                                                   double time_s, const ConstBlock& states) {
  return std::make_unique<BdfIntegrator>(system, relative_tolerance, time_s, states);
}

}  // namespace polyest::internal
