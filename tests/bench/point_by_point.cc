#include "tests/bench/point_by_point.h"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>

#include "core/common/check.h"
#include "tests/bench/half_car.h"

namespace polyest::internal::bench {
namespace {

struct Trajectory {
  std::array<double, HalfCar::kParameters> parameters;
  double middle_s;  // middle of the interval between two kinks of the road
};

int RightHandSide(double time_s, N_Vector states, N_Vector derivatives, void* data) {
  const auto& trajectory = *static_cast<Trajectory*>(data);
  std::array<double, HalfCar::kStates> x, rates;
  std::copy_n(N_VGetArrayPointer(states), x.size(), x.begin());
  HalfCar::Derivatives(time_s, x, trajectory.parameters,
                       std::array<double, 2>{Road(0, time_s, trajectory.middle_s),
                                             Road(1, time_s, trajectory.middle_s)},
                       rates);
  std::copy(rates.begin(), rates.end(), N_VGetArrayPointer(derivatives));
  return 0;
}

void Read(N_Vector states, int point, int sample, Matrix& outputs) {
  std::array<double, HalfCar::kStates> x;
  std::array<double, HalfCar::kOutputs> y;
  std::copy_n(N_VGetArrayPointer(states), x.size(), x.begin());
  HalfCar::Outputs(0, x, std::array<double, 2>{}, std::array<double, 2>{}, y);
  for (int j = 0; j < HalfCar::kOutputs; ++j) outputs(point, sample * HalfCar::kOutputs + j) = y[j];
}

void Run(void* memory, N_Vector states, int point, int samples, Trajectory& trajectory,
         Matrix& outputs) {
  double reached_s = 0;
  double begin_s = 0;
  int sample = 0;
  Read(states, point, sample++, outputs);
  const double end_s = (samples - 1) * 0.01;
  for (int piece = 0; piece <= 4; ++piece) {
    const double piece_end_s = piece < 4 ? kBreaks[piece] : end_s;
    trajectory.middle_s = (begin_s + piece_end_s) / 2;
    // The integration restarts at each kink, with a step short enough not to miss the bump.
    CVodeReInit(memory, begin_s, states);
    CVodeSetInitStep(memory, 1e-3);
    POLYEST_CHECK(CVodeSetStopTime(memory, piece_end_s) == CV_SUCCESS);
    for (; sample < samples && sample * 0.01 < piece_end_s + 1e-9; ++sample) {
      const double time_s = std::min(sample * 0.01, piece_end_s);
      POLYEST_CHECK(CVode(memory, time_s, states, &reached_s, CV_NORMAL) >= 0);
      Read(states, point, sample, outputs);
    }
    begin_s = piece_end_s;
  }
}

}  // namespace

void PropagatePointByPoint(Formula formula, double relative_tolerance, const Matrix& parameters,
                           int samples, Matrix& outputs) {
  sundials::Context context;
  N_Vector states = N_VNew_Serial(HalfCar::kStates, context);
  for (int point = 0; point < parameters.rows(); ++point) {
    Trajectory trajectory{{parameters(point, 0), parameters(point, 1)}, 0};
    N_VConst(0, states);
    void* memory = CVodeCreate(formula == Formula::kAdams ? CV_ADAMS : CV_BDF, context);
    CVodeInit(memory, RightHandSide, 0, states);
    // Displacements reach about 0.05 m and velocities 1 m/s. A user would choose these tolerances.
    CVodeSStolerances(memory, relative_tolerance, 0.05 * relative_tolerance);
    CVodeSetUserData(memory, &trajectory);
    CVodeSetMaxNumSteps(memory, 100'000);
    SUNNonlinearSolver fixed_point = nullptr;
    SUNMatrix matrix = nullptr;
    SUNLinearSolver linear = nullptr;
    if (formula == Formula::kAdams) {
      fixed_point = SUNNonlinSol_FixedPoint(states, 0, context);
      CVodeSetNonlinearSolver(memory, fixed_point);
    } else {
      matrix = SUNDenseMatrix(HalfCar::kStates, HalfCar::kStates, context);
      linear = SUNLinSol_Dense(states, matrix, context);
      CVodeSetLinearSolver(memory, linear, matrix);
    }
    Run(memory, states, point, samples, trajectory, outputs);
    CVodeFree(&memory);
    if (fixed_point != nullptr) SUNNonlinSolFree(fixed_point);
    if (linear != nullptr) SUNLinSolFree(linear);
    if (matrix != nullptr) SUNMatDestroy(matrix);
  }
  N_VDestroy(states);
}

}  // namespace polyest::internal::bench
