/* Defines the parts of a model of the tests' FMUs. fmu2.c and fmu3.c include the model's file and
   add the functions of FMI 2.0 and 3.0, of both kinds. The file defines

     REALS, STATES, INDICATORS   the numbers of variables, continuous states and event indicators;
                                 the index of a variable is its value reference
     kStart[REALS]               start values
     kStates[], kDerivatives[]   the indices of the states and of their derivatives
     Initialize(fmu)             sets the states from the parameters
     Evaluate(fmu)               computes the variables that depend on states, inputs and time
     Indicate(fmu, z)            computes the event indicators
     HandleEvent(fmu)            changes states, or sets next_event_s

   Initialize, Evaluate and HandleEvent return an FMI status. */
#ifndef POLYEST_TESTS_FMU_H
#define POLYEST_TESTS_FMU_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { kOk = 0, kWarning = 1, kDiscard = 2, kError = 3 };

typedef struct Fmu {
  double real[32];
  double time_s;
  double next_event_s; /* none: infinity */
  void* environment;   /* of the logger */
  void* log;
} Fmu;

static void Log(Fmu* fmu, int status, const char* message);

#endif
