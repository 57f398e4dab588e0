#pragma once

// Warnings about the quality of an answer. They are not errors: the answer is there.

#include <string>

namespace polyest {

// What a diagnostic warns of.
enum class DiagnosticCode {
  kNotIdentified,        // the verdict on a parameter is kNotIdentified
  kUndersampled,         // samples miss what changes, or fit other responses
  kExpansionInaccurate,  // the expansion or integration is too inaccurate; uncertainty widened
  kModelMisfit,          // residuals far from what the noise would leave
  kAtPriorBound,         // the estimate lies on a bound of the prior
  kMultipleMinima,       // other minima of comparable cost, or a posterior in several pieces
  kNotConverged,         // the minimizer gave up, or the posterior's chains have not mixed
  kPointsFailed,         // trajectories that could not be integrated were left out
  kNonGaussian,          // the posterior's spread is not that of the cost's curvature
  kCorrelatedResiduals,  // residuals are correlated in time; the noise is taken to be white
  kNoiseNotLearned,      // the data do not determine a noise of unknown size or correlation
  kRegularizationNotDetermined,  // the rule asked for does not choose an α²; it stays 1
  kSuspiciousData,               // the data are allowed but probably not what was meant
  kInconsistentOverTime,         // a parameter differs between parts of the record
  kReplayPostponed,              // max_replay_row_count has put off what the estimate needs
  kWindowsDisagree,              // windows of the record scatter by more than the noise explains
  kPriorDataConflict,            // what the data say is improbable by the prior
  kFixedValueConflict,           // the residuals ask for another value of what is held fixed
};

// Returns the code's name in messages and files, such as "NOT_IDENTIFIED": that of the value of
// Diagnostic.Code in the API; empty if the code is none of these.
const char* NameOf(DiagnosticCode code);

// One warning.
struct Diagnostic {
  DiagnosticCode code;  // for programs
  std::string message;  // for people: one sentence, with the parameter and the numbers concerned
};

}  // namespace polyest
