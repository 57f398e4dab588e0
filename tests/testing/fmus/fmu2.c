/* The functions of FMI 2.0 around a model. */
#include "model.h"

typedef struct {
  void (*log)(void*, const char*, int, const char*, const char*, ...);
  void* (*allocate)(size_t, size_t);
  void (*free)(void*);
  void (*step_finished)(void*, int);
  void* environment;
} Callbacks;

typedef struct {
  int again, terminate, nominals_changed, states_changed, next_time_defined;
  double next_time;
} EventInfo;

static void Log(Fmu* fmu, int status, const char* message) {
  const Callbacks* callbacks = fmu->log;
  callbacks->log(callbacks->environment, "fmu", status, "test", "%s", message);
}

void* fmi2Instantiate(const char* name, int type, const char* guid, const char* resources,
                      const Callbacks* callbacks, int visible, int logging) {
  (void)name, (void)type, (void)resources, (void)visible, (void)logging;
  if (strcmp(guid, "polyest-test") != 0) return NULL;
#ifdef ONLY_ONCE
  static int instances = 0;
  if (++instances > 1) return NULL;
#endif
  return NewFmu(NULL, (void*)callbacks);
}
int fmi2SetupExperiment(Fmu* fmu, int has_tolerance, double tolerance, double start_s,
                        int has_stop, double stop_s) {
  (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop_s;
  fmu->time_s = start_s;
  return kOk;
}
int fmi2EnterInitializationMode(Fmu* fmu) { return Initialize(fmu); }
int fmi2ExitInitializationMode(Fmu* fmu) { return Evaluate(fmu); }
int fmi2GetReal(Fmu* fmu, const unsigned* references, size_t count, double* values) {
  return GetReals(fmu, references, count, values);
}
int fmi2SetReal(Fmu* fmu, const unsigned* references, size_t count, const double* values) {
  return SetReals(fmu, references, count, values);
}
#ifndef WITHOUT_STATE
int fmi2GetFMUstate(Fmu* fmu, Fmu** state) {
  if (*state == NULL) *state = malloc(sizeof(Fmu));
  **state = *fmu;
  return kOk;
}
int fmi2SetFMUstate(Fmu* fmu, const Fmu* state) {
  *fmu = *state;
  return kOk;
}
int fmi2FreeFMUstate(Fmu* fmu, Fmu** state) {
  (void)fmu;
  free(*state);
  *state = NULL;
  return kOk;
}
#endif

int fmi2EnterEventMode(Fmu* fmu) { return Evaluate(fmu); }
int fmi2NewDiscreteStates(Fmu* fmu, EventInfo* info) {
  memset(info, 0, sizeof(*info));
  const int status = HandleEvent(fmu);
  info->states_changed = 1;
  info->next_time_defined = isfinite(fmu->next_event_s);
  info->next_time = fmu->next_event_s;
  return status;
}
int fmi2EnterContinuousTimeMode(Fmu* fmu) { return Evaluate(fmu); }
int fmi2CompletedIntegratorStep(Fmu* fmu, int no_set_state, int* event, int* terminate) {
  (void)fmu, (void)no_set_state;
  *event = *terminate = 0;
  return kOk;
}
int fmi2SetTime(Fmu* fmu, double time_s) {
  fmu->time_s = time_s;
  return kOk;
}
int fmi2SetContinuousStates(Fmu* fmu, const double* states, size_t count) {
  (void)count;
  SetStates(fmu, states);
  return kOk;
}
int fmi2GetContinuousStates(Fmu* fmu, double* states, size_t count) {
  (void)count;
  GetStates(fmu, states);
  return kOk;
}
int fmi2GetNominalsOfContinuousStates(Fmu* fmu, double* nominals, size_t count) {
  (void)fmu;
  for (size_t i = 0; i < count; ++i) nominals[i] = 1;
  return kOk;
}
int fmi2GetDerivatives(Fmu* fmu, double* derivatives, size_t count) {
  (void)count;
  return GetDerivatives(fmu, derivatives);
}
int fmi2GetEventIndicators(Fmu* fmu, double* indicators, size_t count) {
  (void)count;
  Indicate(fmu, indicators);
  return kOk;
}
#ifndef WITHOUT_STEP
int fmi2DoStep(Fmu* fmu, double time_s, double step_s, int no_set_state) {
  (void)no_set_state;
  return DoStep(fmu, time_s, step_s);
}
#endif
