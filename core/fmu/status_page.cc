#include "core/fmu/status_page.h"

namespace polyest::internal {

const char* InWords(FmuCall call) {
  switch (call) {
    case FmuCall::kNothing:
      return "outside of the FMU";
    case FmuCall::kLoad:
      return "loading its library";
    case FmuCall::kInstantiate:
      return "instantiating it";
    case FmuCall::kInitialize:
      return "initializing it";
    case FmuCall::kSetVariables:
      return "setting variables";
    case FmuCall::kGetVariables:
      return "reading variables";
    case FmuCall::kDerivatives:
      return "evaluating derivatives";
    case FmuCall::kEvents:
      return "handling an event";
    case FmuCall::kStep:
      return "doing a step";
    case FmuCall::kState:
      return "saving or restoring its state";
    case FmuCall::kEnd:
      return "ending it";
  }
  return "in an unknown call";
}

}  // namespace polyest::internal
