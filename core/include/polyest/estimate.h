#pragma once

// What the estimator answers.
//
// The cost of parameter values is J = J_mismatch + α² J_apriori: J_mismatch is half the sum of
// squared residuals in units of their noise, J_apriori the negative logarithm of the prior's
// density, and e^{−J} is the posterior density up to a factor (α² = 1).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "polyest/diagnostic.h"
#include "polyest/types.h"

namespace polyest {

// A value of the cost; plain numbers without unit.
struct CostValue {
  // J_mismatch; ≥ 0 with noise of known size, of any sign where its size is a parameter or is
  // marginalized, since a logarithm of it is then part of the likelihood.
  double mismatch = 0;
  double prior = 0;  // J_apriori, not yet weighted; +∞ outside the prior's support
  double total = 0;  // mismatch + α² prior
};

// How well the data determine a parameter or a direction.
enum class Verdict {
  // A parameter: its standard deviation is at most half the prior's. A direction: the data's
  // information is at least ten times the prior's.
  kIdentified,
  // Between the two others.
  kWeak,
  // A parameter: its standard deviation is at least 0.9 of the prior's. A direction: the data's
  // information is less than the prior's.
  kNotIdentified,
};

// A combination of parameters, and how well the data alone determine it.
struct Direction {
  double information = 0;  // ≥ 0: prior variance ÷ variance from the data
  // Unit vector over the uncertain parameters, each in units of the prior standard deviation of its
  // normal score. If the data tell nothing about one of two correlated parameters, both still
  // change together along a direction.
  Vector coefficients;
  Verdict verdict = Verdict::kNotIdentified;  // by `information`
};

// Two parameters that the data cannot tell apart, and a combination of them, such as k/m or
// k1 + k2, that is known far better than either.
struct TradeOff {
  int first = 0, second = 0;  // indices of the uncertain parameters
  std::string combination;    // as text, "k/m"
  // Relative uncertainty of the combination: its posterior standard deviation ÷ |mean|, or that of
  // the logarithm of a product or quotient.
  double relative_std_dev = 0;
  // Posterior standard deviation ÷ |mean| of each parameter alone.
  double first_alone = 0, second_alone = 0;
};

// What is known of one uncertain parameter; numbers are in its unit unless said otherwise. Where
// residuals or windows of the record contradict model or noise, std_dev is widened to
// robust_std_dev, if that is larger, and the posterior's spread with it, but never beyond the
// prior's. Where the correlation of noise is learned, what is not known of it widens std_dev by the
// same factor as the 95 % interval. Where the curvature contradicts the posterior by a factor of 2
// or more, although nothing speaks against the posterior and it has one minimum, std_dev is
// posterior_std_dev: the cost is flat at its minimum where the data tell a limit and no more.
struct ParameterEstimate {
  std::string name;              // "x_0[2]" for run 2's own value
  std::string unit;              // "1" for a plain number; empty: the equations give none
  double map = 0;                // at the minimum of the cost: the most probable value
  double std_dev = 0;            // from the cost's curvature there; at most the prior's
  double robust_std_dev = 0;     // by the scatter of windows' scores; 0 if there are too few
  double mean = 0;               // of the posterior
  double lower95 = 0;            // 2.5 % quantile of the posterior
  double upper95 = 0;            // 97.5 % quantile of the posterior
  double posterior_std_dev = 0;  // of the posterior itself
  double prior_mean = 0;         // of the prior
  double prior_std_dev = 0;      // of the prior
  double contraction = 0;        // std_dev ÷ prior_std_dev, 0 … 1
  double bias = 0;               // how far α² ≠ 1 moves map; 0 for α² = 1
  Verdict verdict = Verdict::kNotIdentified;  // by the contraction of the normal score
};

// One parameter in one window of the record, in its unit.
struct WindowParameter {
  int parameter = 0;   // index of the uncertain parameter
  double value = 0;    // as this window and the prior alone give it
  double std_dev = 0;  // from the noise assumed
};

// What the samples of one window of the record and the prior alone say: one Gauss–Newton step from
// the estimate.
struct WindowEstimate {
  int first_run = 0, last_run = 0;          // of the window's first and last row
  double start_s = 0;                       // time of the first row, in first_run
  double end_s = 0;                         // time of the last row, in last_run
  std::vector<WindowParameter> parameters;  // those that the window identifies
};

// One of the separated pieces of a posterior.
struct ComponentEstimate {
  double weight = 0;  // the posterior's probability of this piece, 0 … 1
  // The parameters as this piece alone gives them.
  std::vector<ParameterEstimate> parameters;
};

// How well the model fits the samples of one measured output.
struct ChannelEstimate {
  std::string output;   // its name
  int64_t samples = 0;  // number of them
  // Σ (z − y)²/R at map, of whitened residuals where the noise is correlated; about `samples`,
  // less the number of parameters fitted to them, when model and noise are right, and by
  // construction when the noise was unknown. Where outliers are handled, each counts as one unless
  // there are too many of them to be gross errors.
  double chi_squared = 0;
  // Root mean square of the noise: as assumed or, where it was unknown, as estimated; in the
  // output's unit.
  double noise_std_dev = 0;
  double lag1_correlation = 0;   // of the residuals (whitened), −1 … 1, without the fit's bias
  double effective_samples = 0;  // number of independent samples that would tell as much
  double noise_time_constant_s = 0;  // of the noise's correlation; 0: white
  int64_t outliers = 0;              // number of samples with less than half their weight
  // Variance of sums of 16 successive residuals ÷ that of as many independent ones: about 1 if
  // model and noise are right, less by what an error of the linearized model may add to it; 0 if it
  // is not known, as where outliers are handled.
  double variance_ratio = 0;
  int64_t residual_sums = 0;  // number of such sums
  // Share of the noise's variance that is uncorrelated where the rest is correlated over
  // noise_time_constant_s, 0 ≤ … < 1; 0 for white noise, too.
  double noise_white_share = 0;
};

// A state of the model, or the present value of a parameter that drifts, as the samples up to the
// last one tell it; in its unit. Only where filters are behind the estimate
// (LikelihoodForm::kPredictionError).
struct FilteredQuantity {
  std::string name;    // of the state or of the parameter
  std::string unit;    // as ParameterEstimate::unit
  double mean = 0;     // of its distribution at Estimate::time_s
  double std_dev = 0;  // of that distribution
  double lower95 = 0;  // 2.5 % quantile of it
  double upper95 = 0;  // 97.5 % quantile of it
};

// The expansion that the estimate was computed on.
struct ExpansionSummary {
  int order = 0;   // p
  int terms = 0;   // S
  int points = 0;  // Q
  // Root mean square over the samples of (model − expansion)/σ, at the worst of some draws of the
  // posterior at which the model itself is run; small beside 1 when the expansion can be trusted.
  double residual_to_noise = 0;
  // Shape k̂ of the generalized Pareto distribution that the largest importance weights of those
  // draws follow, by the model itself against the expansion: below 0.5 all is well, above 0.7 the
  // draws do not represent the model's posterior. None for fewer than 25 draws, and none where the
  // draws no longer represent the posterior on the expansion (their own k̂ is above 0.7) and the
  // expansion's error can move no estimate by more than 0.01 of its standard deviations.
  std::optional<double> pareto_shape;
  int reexpansions = 0;      // how often the outputs were expanded again
  int64_t trajectories = 0;  // runs of the model in all, each over the whole record so far
};

// An estimate. If the posterior has several pieces, then map, std_dev, covariance, cost, channels
// and directions are those of the heaviest piece, and mean, posterior_std_dev and limits those of
// all pieces. A parameter is kWeak if each piece identifies it but the pieces disagree.
//
// `disagreement` is r: how much more the scores of the record's windows scatter than the noise
// explains, in the parameters' worst direction. It is 1.1 … 1.7 when all is well.
struct Estimate {
  std::vector<ParameterEstimate> parameters;  // in the problem's order
  std::vector<ComponentEstimate> components;  // heaviest first; none when there is one piece
  Matrix covariance;                          // of the parameters, from the curvature, n × n
  CostValue cost;                             // at map
  double regularization = 1;                  // α² used
  std::vector<ChannelEstimate> channels;      // in the problem's order
  std::vector<Direction> directions;          // the best known first
  std::vector<TradeOff> trade_offs;           // pairs of which only a combination is known
  ExpansionSummary expansion;                 // what it was computed on
  double disagreement = 0;                    // of windows; 0 if there are too few
  // At time_s: the model's states, then the parameters that drift; empty for output errors.
  std::vector<FilteredQuantity> filtered;
  std::vector<WindowEstimate> windows;  // at most 16, in order; none unless they disagree
  std::vector<Diagnostic> diagnostics;  // warnings; empty is good
  double time_s = 0;                    // of the last sample
  int64_t samples = 0;                  // values used, over all outputs and runs
};

}  // namespace polyest
