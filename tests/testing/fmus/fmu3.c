/* The functions of FMI 3.0 around a model. */
#include <stdbool.h>
#include <stdint.h>

#include "model.h"

typedef void LogCallback(void*, int, const char*, const char*);

static void Log(Fmu* fmu, int status, const char* message) {
  ((LogCallback*)fmu->log)(fmu->environment, status, "test", message);
}

void* fmi3InstantiateModelExchange(const char* name, const char* token, const char* resources,
                                   bool visible, bool logging, void* environment,
                                   LogCallback* log) {
  (void)name, (void)resources, (void)visible, (void)logging;
  if (strcmp(token, "polyest-test") != 0) return NULL;
  return NewFmu(environment, (void*)log);
}
void* fmi3InstantiateCoSimulation(const char* name, const char* token, const char* resources,
                                  bool visible, bool logging, bool event_mode, bool early_return,
                                  const uint32_t* intermediate, size_t count, void* environment,
                                  LogCallback* log, void* update) {
  (void)event_mode, (void)early_return, (void)intermediate, (void)count, (void)update;
  return fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, log);
}
int fmi3EnterInitializationMode(Fmu* fmu, bool has_tolerance, double tolerance, double start_s,
                                bool has_stop, double stop_s) {
  (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop_s;
  fmu->time_s = start_s;
  return Initialize(fmu);
}
int fmi3ExitInitializationMode(Fmu* fmu) { return Evaluate(fmu); }
int fmi3GetFloat64(Fmu* fmu, const uint32_t* references, size_t count, double* values,
                   size_t value_count) {
  if (count != value_count) return kError;
  return GetReals(fmu, references, count, values);
}
int fmi3SetFloat64(Fmu* fmu, const uint32_t* references, size_t count, const double* values,
                   size_t value_count) {
  if (count != value_count) return kError;
  return SetReals(fmu, references, count, values);
}
int fmi3GetFloat32(Fmu* fmu, const uint32_t* references, size_t count, float* values,
                   size_t value_count) {
  if (count != 1 || value_count != 1) return kError;
  double value = 0;
  const int status = GetReals(fmu, references, 1, &value);
  *values = (float)value;
  return status;
}
int fmi3SetFloat32(Fmu* fmu, const uint32_t* references, size_t count, const float* values,
                   size_t value_count) {
  if (count != 1 || value_count != 1) return kError;
  const double value = *values;
  return SetReals(fmu, references, 1, &value);
}

int fmi3EnterEventMode(Fmu* fmu) { return Evaluate(fmu); }
int fmi3UpdateDiscreteStates(Fmu* fmu, bool* again, bool* terminate, bool* nominals_changed,
                             bool* states_changed, bool* next_time_defined, double* next_time_s) {
  *again = *terminate = *nominals_changed = false;
  *states_changed = true;
  const int status = HandleEvent(fmu);
  *next_time_defined = isfinite(fmu->next_event_s);
  *next_time_s = fmu->next_event_s;
  return status;
}
int fmi3EnterContinuousTimeMode(Fmu* fmu) { return Evaluate(fmu); }
int fmi3CompletedIntegratorStep(Fmu* fmu, bool no_set_state, bool* event, bool* terminate) {
  (void)fmu, (void)no_set_state;
  *event = *terminate = false;
  return kOk;
}
int fmi3SetTime(Fmu* fmu, double time_s) {
  fmu->time_s = time_s;
  return kOk;
}
int fmi3SetContinuousStates(Fmu* fmu, const double* states, size_t count) {
  (void)count;
  SetStates(fmu, states);
  return kOk;
}
int fmi3GetContinuousStates(Fmu* fmu, double* states, size_t count) {
  (void)count;
  GetStates(fmu, states);
  return kOk;
}
int fmi3GetNominalsOfContinuousStates(Fmu* fmu, double* nominals, size_t count) {
  (void)fmu;
  for (size_t i = 0; i < count; ++i) nominals[i] = 1;
  return kOk;
}
int fmi3GetContinuousStateDerivatives(Fmu* fmu, double* derivatives, size_t count) {
  (void)count;
  return GetDerivatives(fmu, derivatives);
}
int fmi3GetEventIndicators(Fmu* fmu, double* indicators, size_t count) {
  (void)count;
  Indicate(fmu, indicators);
  return kOk;
}
int fmi3DoStep(Fmu* fmu, double time_s, double step_s, bool no_set_state, bool* event_needed,
               bool* terminate, bool* early_return, double* last_successful_s) {
  (void)no_set_state;
  *event_needed = *terminate = *early_return = false;
  const int status = DoStep(fmu, time_s, step_s);
  *last_successful_s = fmu->time_s;
  return status;
}
