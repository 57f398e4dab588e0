#include "core/propagation/erk_integrator.h"

#include <arkode/arkode_erkstep.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/common/check.h"
#include "core/propagation/sundials_block.h"

namespace polyest {
namespace {

const char* InWords(int flag) {
  switch (flag) {
    case ARK_SUCCESS:
    case ARK_TSTOP_RETURN:
      return "success";
    case ARK_TOO_MUCH_WORK:
      return "too many steps between two samples";
    case ARK_TOO_MUCH_ACC:
      return "the tolerance is below rounding errors";
    case ARK_ERR_FAILURE:
      return "the step size fell without an acceptable error";
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
      return "the solver failed";
  }
}

class ErkIntegrator final : public EnsembleIntegrator {
 public:
  ErkIntegrator(EnsembleSystem* system, double relative_tolerance, double time_s,
                const ConstBlock& states);
  ~ErkIntegrator() override { ERKStepFree(&memory_); }

  double time_s() const override { return block_.time_s; }
  ConstBlock states() const override { return EnsembleValues(block_.vector.get()); }
  IntegratorOutcome AdvanceTo(double time_s, double stop_time_s, int most_steps,
                              Block states) override;
  void Restart() override;
  bool LooksStiff() override;

 private:
  int Evolve(double time_s, double stop_time_s, int most_steps);
  IntegratorOutcome Outcome(int flag, double advance_s);

  SundialsBlock block_;
  void* memory_ = nullptr;
  double covered_s_;  // dense output reaches to here
  bool started_ = false;
};

ErkIntegrator::ErkIntegrator(EnsembleSystem* system, double relative_tolerance, double time_s,
                             const ConstBlock& states)
    : block_(system, relative_tolerance, time_s, states), covered_s_(time_s) {
  memory_ =
      ERKStepCreate(SundialsBlock::RightHandSide, time_s, block_.vector.get(), block_.context);
  POLYEST_CHECK(memory_ != nullptr);
  // More rejections than the default seven: the first step is a guess.
  constexpr int kMostErrorTestFailures = 30;
  const bool accepted =
      ERKStepSetErrHandlerFn(memory_, SundialsBlock::IgnoreMessage, nullptr) == ARK_SUCCESS &&
      ERKStepSetUserData(memory_, &block_) == ARK_SUCCESS &&
      ERKStepSetTableNum(memory_, ARKODE_DORMAND_PRINCE_7_4_5) == ARK_SUCCESS &&
      ERKStepWFtolerances(memory_, SundialsBlock::ErrorWeights) == ARK_SUCCESS &&
      ERKStepSetMaxErrTestFails(memory_, kMostErrorTestFailures) == ARK_SUCCESS &&
      ERKStepSetMaxHnilWarns(memory_, -1) == ARK_SUCCESS;
  POLYEST_CHECK(accepted);
}

int ErkIntegrator::Evolve(double time_s, double stop_time_s, int most_steps) {
  if (!started_) {
    ERKStepSetInitStep(memory_, block_.FirstStep(time_s - block_.time_s));
    started_ = true;
  }
  ERKStepSetMaxNumSteps(memory_, most_steps);
  // There is no way to take a stop time back, so that "none" is one that is never reached.
  ERKStepSetStopTime(memory_, std::min(stop_time_s, std::numeric_limits<double>::max()));
  return ERKStepEvolve(memory_, time_s, block_.vector.get(), &block_.time_s, ARK_NORMAL);
}

IntegratorOutcome ErkIntegrator::Outcome(int flag, double advance_s) {
  IntegratorOutcome outcome;
  if (flag >= 0) return outcome;
  outcome.ok = false;
  outcome.flag = flag;
  outcome.reason = InWords(flag);
  outcome.worst_point = block_.scale.worst_point();
  outcome.too_many_steps = flag == ARK_TOO_MUCH_WORK;
  // Many steps that lead nowhere: more of them will not help.
  constexpr double kStandstill = 1e-13;
  if (outcome.too_many_steps && !(advance_s > kStandstill * std::abs(block_.time_s))) {
    outcome.too_many_steps = false;
    outcome.reason = "the step size fell below the resolution of time";
  }
  return outcome;
}

IntegratorOutcome ErkIntegrator::AdvanceTo(double time_s, double stop_time_s, int most_steps,
                                           Block states) {
  POLYEST_CHECK(time_s >= block_.time_s && stop_time_s >= time_s);
  int flag = ARK_SUCCESS;
  const double before_s = block_.time_s;
  if (time_s > covered_s_) {
    flag = Evolve(time_s, stop_time_s, most_steps);
    ERKStepGetCurrentTime(memory_, &covered_s_);
    covered_s_ = std::max(covered_s_, block_.time_s);
  } else if (time_s > block_.time_s) {
    flag = ERKStepGetDky(memory_, time_s, 0, block_.vector.get());
    if (flag == ARK_SUCCESS) block_.time_s = time_s;
  }
  if (flag >= 0) states = block_.values();
  return Outcome(flag, block_.time_s - before_s);
}

void ErkIntegrator::Restart() {
  const int flag = ERKStepReset(memory_, block_.time_s, block_.vector.get());
  POLYEST_CHECK(flag == ARK_SUCCESS);
  covered_s_ = block_.time_s;
}

bool ErkIntegrator::LooksStiff() { return false; }

}  // namespace

std::unique_ptr<EnsembleIntegrator> MakeErkIntegrator(EnsembleSystem* system,
                                                      double relative_tolerance, double time_s,
                                                      const ConstBlock& states) {
  return std::make_unique<ErkIntegrator>(system, relative_tolerance, time_s, states);
}

}  // namespace polyest
