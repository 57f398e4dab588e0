/* Includes the chosen model and defines the functions that all models share. */
#ifndef POLYEST_TESTS_MODEL_H
#define POLYEST_TESTS_MODEL_H

#include "fmu.h"
#include MODEL_FILE

/* Longest step of the Co-Simulation solver, classical Runge-Kutta, s. */
#define INTERNAL_STEP 1e-3

static Fmu* NewFmu(void* environment, void* log) {
  Fmu* fmu = calloc(1, sizeof(Fmu));
  memcpy(fmu->real, kStart, sizeof(kStart));
  fmu->next_event_s = INFINITY;
  fmu->environment = environment;
  fmu->log = log;
  return fmu;
}

static int GetReals(Fmu* fmu, const unsigned* references, size_t count, double* values) {
  const int status = Evaluate(fmu);
  for (size_t i = 0; i < count; ++i) {
    if (references[i] >= REALS) return kError;
    values[i] = fmu->real[references[i]];
  }
  return status;
}

static int SetReals(Fmu* fmu, const unsigned* references, size_t count, const double* values) {
  for (size_t i = 0; i < count; ++i) {
    if (references[i] >= REALS) return kError;
    fmu->real[references[i]] = values[i];
  }
  return kOk;
}

static int GetDerivatives(Fmu* fmu, double* derivatives) {
  const int status = Evaluate(fmu);
  for (int s = 0; s < STATES; ++s) derivatives[s] = fmu->real[kDerivatives[s]];
  return status;
}

static void SetStates(Fmu* fmu, const double* states) {
  for (int s = 0; s < STATES; ++s) fmu->real[kStates[s]] = states[s];
}

static void GetStates(const Fmu* fmu, double* states) {
  for (int s = 0; s < STATES; ++s) states[s] = fmu->real[kStates[s]];
}

/* Makes one step of classical Runge-Kutta with constant inputs. */
static int RungeKutta(Fmu* fmu, double h) {
  double x[STATES + 1], moved[STATES + 1], k[4][STATES + 1];
  const double at[4] = {0, 0.5, 0.5, 1};
  const double start_s = fmu->time_s;
  GetStates(fmu, x);
  for (int stage = 0; stage < 4; ++stage) {
    for (int s = 0; s < STATES; ++s) {
      moved[s] = stage == 0 ? x[s] : x[s] + at[stage] * h * k[stage - 1][s];
    }
    SetStates(fmu, moved);
    fmu->time_s = start_s + at[stage] * h;
    const int status = GetDerivatives(fmu, k[stage]);
    if (status != kOk) return status;
  }
  for (int s = 0; s < STATES; ++s) {
    moved[s] = x[s] + h / 6 * (k[0][s] + 2 * k[1][s] + 2 * k[2][s] + k[3][s]);
  }
  SetStates(fmu, moved);
  fmu->time_s = start_s + h;
  return kOk;
}

static int DoStep(Fmu* fmu, double time_s, double step_s) {
  const int count = (int)ceil(step_s / INTERNAL_STEP * (1 - 1e-9));
  fmu->time_s = time_s;
  for (int i = 0; i < count; ++i) {
    const int status = RungeKutta(fmu, step_s / count);
    if (status != kOk) return status;
  }
  fmu->time_s = time_s + step_s;
  return kOk;
}

#endif
