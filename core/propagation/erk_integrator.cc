#include "core/propagation/erk_integrator.h"

#include <arkode/arkode_erkstep.h>

#include <algorithm>
#include <limits>

#include "core/common/check.h"
#include "core/propagation/sundials_integrator.h"

namespace polyest::internal {
namespace {

class ErkIntegrator final : public SundialsIntegrator {
 public:
  ErkIntegrator(BlockSystem* system, double relative_tolerance, double time_s,
                const ConstBlock& states);
  ~ErkIntegrator() override { ERKStepFree(&memory_); }
  bool LooksStiff() override;

 private:
  void SetFirstStep(double step_s) override { ERKStepSetInitStep(memory_, step_s); }
  int Evolve(double time_s, double stop_time_s, int max_steps, N_Vector states,
             double* reached_s) override;
  int Interpolate(double time_s, N_Vector states) override {
    return ERKStepGetDky(memory_, time_s, 0, states);
  }
  double InternalTime() const override;
  double LastStep() const override;
  int Reset(double time_s, N_Vector states) override {
    return ERKStepReset(memory_, time_s, states);
  }
  const char* InWords(int flag) const override;
  double LargestRate();

  void* memory_ = nullptr;
  long steps_looked_at_ = 0;
};

ErkIntegrator::ErkIntegrator(BlockSystem* system, double relative_tolerance, double time_s,
                             const ConstBlock& states)
    : SundialsIntegrator(system, relative_tolerance, time_s, states),
      memory_(ERKStepCreate(RightHandSide, time_s, vector(), context())) {
  // The first step is a guess, so more rejections are allowed than the default seven.
  constexpr int kMaxErrorTestFailures = 30;
  const bool accepted =
      memory_ != nullptr &&
      ERKStepSetErrHandlerFn(memory_, IgnoreMessage, nullptr) == ARK_SUCCESS &&
      ERKStepSetUserData(memory_, static_cast<SundialsIntegrator*>(this)) == ARK_SUCCESS &&
      ERKStepSetTableNum(memory_, ARKODE_DORMAND_PRINCE_7_4_5) == ARK_SUCCESS &&
      ERKStepWFtolerances(memory_, ErrorWeights) == ARK_SUCCESS &&
      ERKStepSetMaxErrTestFails(memory_, kMaxErrorTestFailures) == ARK_SUCCESS &&
      ERKStepSetMaxHnilWarns(memory_, -1) == ARK_SUCCESS;
  POLYEST_CHECK(accepted);
}

int ErkIntegrator::Evolve(double time_s, double stop_time_s, int max_steps, N_Vector states,
                          double* reached_s) {
  ERKStepSetMaxNumSteps(memory_, max_steps);
  ERKStepSetStopTime(memory_, stop_time_s);
  return ERKStepEvolve(memory_, time_s, states, reached_s, ARK_NORMAL);
}

double ErkIntegrator::InternalTime() const {
  double time_s = 0;
  ERKStepGetCurrentTime(memory_, &time_s);
  return time_s;
}

double ErkIntegrator::LastStep() const {
  double step_s = 0;
  ERKStepGetLastStep(memory_, &step_s);
  return step_s;
}

const char* ErkIntegrator::InWords(int flag) const {
  switch (flag) {
    case ARK_SUCCESS:
    case ARK_TSTOP_RETURN:
      return "success";
    case ARK_TOO_MUCH_WORK:
      return "too many steps between two samples";
    case ARK_TOO_MUCH_ACC:
      return "the tolerance is below rounding errors";
    case ARK_ERR_FAILURE:
      return "no step size gives an acceptable error";
    case ARK_RHSFUNC_FAIL:
    case ARK_FIRST_RHSFUNC_ERR:
    case ARK_REPTD_RHSFUNC_ERR:
    case ARK_UNREC_RHSFUNC_ERR:
      return "the derivatives could not be evaluated";
    case ARK_TOO_CLOSE:
      return "the time to integrate to is too close";
    case ARK_MEM_FAIL:
      return "out of memory";
    case ARK_ILL_INPUT:
      return "the solver refused its input";
    case ARK_VECTOROP_ERR:
      return "a vector operation failed";
    case ARK_INTERP_FAIL:
      return "interpolation failed";
    case ARK_BAD_T:
      return "the time asked for lies outside the last step";
    default:
      return "the solver failed with a code of its own";
  }
}

// Estimates the largest |λ| of ∂f/∂x over the points by a few power iterations. They start from the
// last local error, in which a mode at the limit of stability dominates:
//   v ← (f(x + v) − f(x)) ÷ |λ|, |λ| = max_s |(J v)_s| w_s ÷ max_s |v_s| w_s for each point.
double ErkIntegrator::LargestRate() {
  const Eigen::ArrayXXd x = states();
  const Eigen::ArrayXXd weights = scale().weights();
  const OwnedVector error(N_VClone(vector()));
  ERKStepGetEstLocalErrors(memory_, error.get());
  Eigen::ArrayXXd direction = BlockValues(error.get());
  Eigen::ArrayXXd rates(x.rows(), x.cols()), moved(x.rows(), x.cols());
  system()->Derivatives(time_s(), x, rates);
  double largest = 0;
  constexpr int kIterations = 4;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    // The length is that of the tolerance: small enough for linearity, large enough against
    // rounding errors.
    const Eigen::ArrayXd norm =
        (direction * weights).abs().rowwise().maxCoeff().max(std::numeric_limits<double>::min());
    direction.colwise() /= norm;
    system()->Derivatives(time_s(), x + direction, moved);
    direction = moved - rates;
    largest = (direction * weights).abs().rowwise().maxCoeff().maxCoeff();
  }
  return largest;
}

bool ErkIntegrator::LooksStiff() {
  constexpr long kStepsBetweenLooks = 500;
  long steps = 0;
  ERKStepGetNumSteps(memory_, &steps);
  if (steps - steps_looked_at_ < kStepsBetweenLooks) return false;
  steps_looked_at_ = steps;
  // On the negative real axis the method is stable for h |λ| ≤ 3.3. Steps limited by accuracy are
  // many times shorter at the tolerances in use.
  constexpr double kNearTheLimit = 2;
  return LastStep() * LargestRate() > kNearTheLimit;
}

}  // namespace

std::unique_ptr<BlockIntegrator> MakeErkIntegrator(BlockSystem* system, double relative_tolerance,
                                                   double time_s, const ConstBlock& states) {
  return std::make_unique<ErkIntegrator>(system, relative_tolerance, time_s, states);
}

}  // namespace polyest::internal
