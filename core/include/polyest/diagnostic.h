#pragma once

// What an answer says of its own quality: numerical outcomes that are not errors.

#include <string>

namespace polyest {

// What a diagnostic warns of.
enum class DiagnosticCode {
  kNotIdentified,        // a parameter or direction on which the data say less than the prior
  kUndersampled,         // the samples taken do not see what an uncertain parameter changes
  kExpansionInaccurate,  // the expansion differs from the model by too much; uncertainty widened
  kModelMisfit,          // residuals far from what the noise would leave
  kAtPriorBound,         // the estimate lies on a bound of the prior
  kMultipleMinima,       // other minima of comparable cost, or a posterior in several pieces
  kNotConverged,         // the minimizer gave up, or the posterior's chains have not mixed
  kPointsFailed,         // trajectories that could not be integrated were left out
  kNonGaussian,          // the posterior's spread is not that of the cost's curvature
  kCorrelatedResiduals,  // residuals are not white, and the noise is taken to be
  kNoiseNotLearned,      // a noise of unknown size, of which there are too few samples
  kRegularizationNotDetermined,  // the rule asked for does not choose an α²; 1 stands instead
};

// One warning.
struct Diagnostic {
  DiagnosticCode code;  // for programs
  std::string message;  // for people: one sentence, with the parameter and the numbers concerned
};

}  // namespace polyest
