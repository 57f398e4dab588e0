#pragma once

// What the estimator answers.

#include <cstdint>
#include <string>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/identifiability.h"
#include "core/common/types.h"
#include "core/estimator/trade_off.h"

namespace polyest {

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

struct Diagnostic {
  DiagnosticCode code;
  std::string message;
};

struct ParameterEstimate {
  std::string name;
  std::string unit;
  double map = 0;      // θ at the minimum of the cost
  double std_dev = 0;  // from the cost's curvature there; the prior's where that knows less
  double mean = 0;     // of the posterior
  double lower95 = 0;  // 2.5 % quantile of the posterior
  double upper95 = 0;  // 97.5 %
  double posterior_std_dev = 0;  // of the posterior itself
  double prior_mean = 0;
  double prior_std_dev = 0;
  double contraction = 0;  // std_dev ÷ prior_std_dev
  double bias = 0;  // brought by α² ≠ 1: map less that of α² = 1 (regularization_bias.h)
  Verdict verdict = Verdict::kNotIdentified;
};

// One of the separated pieces of a posterior.
struct ComponentEstimate {
  double weight = 0;  // the posterior's probability of it
  // Of this piece alone: the minimum and the curvature there, mean, standard deviation and limits.
  std::vector<ParameterEstimate> parameters;
};

struct ChannelEstimate {
  std::string output;
  int64_t samples = 0;
  // Σ (z − y)²/R at map, of whitened residuals where the noise is correlated; about `samples` when
  // model and noise are right, and by its making when the noise was unknown.
  double chi_squared = 0;
  // Root mean square of the noise assumed or, where it was unknown, estimated; in the output's
  // unit.
  double noise_std_dev = 0;
  double lag1_correlation = 0;   // of the residuals (whitened), free of the fit's bias
  double effective_samples = 0;  // independent ones that would tell as much: N (1 − a)/(1 + a)
  double noise_time_constant_s = 0;  // of the noise's correlation; 0: white
  int64_t outliers = 0;              // samples with less than half their weight
};

struct ExpansionSummary {
  int order = 0;
  int terms = 0;   // S
  int points = 0;  // Q
  // Worst, over posterior particles, root mean square over the samples of (model − expansion)/σ.
  double residual_to_noise = 0;
  int reexpansions = 0;
  // Model runs in all, in units of the whole record so far.
  int64_t trajectories = 0;
};

// Of a posterior in several pieces: map, std_dev, covariance, cost, channels and directions are
// those of the heaviest; mean, posterior_std_dev and limits of all. A parameter that each piece
// identifies, but not which of them it is, is WEAK.
struct Estimate {
  std::vector<ParameterEstimate> parameters;
  std::vector<ComponentEstimate> components;  // heaviest first; none when there is one piece
  Matrix covariance;                          // of the parameters, from the curvature
  CostValue cost;                             // at map
  double regularization = 1;                  // α² used
  std::vector<ChannelEstimate> channels;
  std::vector<Direction> directions;
  std::vector<TradeOff> trade_offs;  // pairs known together, not alone
  ExpansionSummary expansion;
  std::vector<Diagnostic> diagnostics;
  double time_s = 0;    // of the last sample
  int64_t samples = 0;  // values ingested, over all channels and runs
};

}  // namespace polyest
