#include "polyest/diagnostic.h"

namespace polyest {

const char* NameOf(DiagnosticCode code) {
  switch (code) {
    case DiagnosticCode::kNotIdentified:
      return "NOT_IDENTIFIED";
    case DiagnosticCode::kUndersampled:
      return "UNDERSAMPLED";
    case DiagnosticCode::kExpansionInaccurate:
      return "EXPANSION_INACCURATE";
    case DiagnosticCode::kModelMisfit:
      return "MODEL_MISFIT";
    case DiagnosticCode::kAtPriorBound:
      return "AT_PRIOR_BOUND";
    case DiagnosticCode::kMultipleMinima:
      return "MULTIPLE_MINIMA";
    case DiagnosticCode::kNotConverged:
      return "NOT_CONVERGED";
    case DiagnosticCode::kPointsFailed:
      return "POINTS_FAILED";
    case DiagnosticCode::kNonGaussian:
      return "NON_GAUSSIAN";
    case DiagnosticCode::kCorrelatedResiduals:
      return "CORRELATED_RESIDUALS";
    case DiagnosticCode::kNoiseNotLearned:
      return "NOISE_NOT_LEARNED";
    case DiagnosticCode::kRegularizationNotDetermined:
      return "REGULARIZATION_NOT_DETERMINED";
    case DiagnosticCode::kSuspiciousData:
      return "SUSPICIOUS_DATA";
    case DiagnosticCode::kInconsistentOverTime:
      return "INCONSISTENT_OVER_TIME";
    case DiagnosticCode::kReplayPostponed:
      return "REPLAY_POSTPONED";
    case DiagnosticCode::kWindowsDisagree:
      return "WINDOWS_DISAGREE";
    case DiagnosticCode::kPriorDataConflict:
      return "PRIOR_DATA_CONFLICT";
    case DiagnosticCode::kFixedValueConflict:
      return "FIXED_VALUE_CONFLICT";
  }
  return "";
}

}  // namespace polyest
