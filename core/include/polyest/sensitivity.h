#pragma once

// Which uncertain parameters matter, and when, before anything is measured: Sobol' indices of the
// outputs, read off the coefficients of their expansions over the prior (B. Sudret, "Global
// sensitivity analysis using polynomial chaos expansions", Reliab. Eng. Syst. Saf. 93, 2008).
//
// In an orthonormal basis the variance of y = Σ_s c_s φ_s(ξ) is V = Σ_{s≥1} c_s². Of it are
//   first order  S_i = Σ c_s²/V over the terms s in which ξ_i alone occurs: the share that would
//                      vanish on average if parameter i were known;
//   total        T_i = Σ c_s²/V over the terms s in which ξ_i occurs: the share that would remain
//                      on average if all others were known. T_i ≥ S_i; the difference is due to
//                      interactions of i with others. Σ_i S_i ≤ 1 ≤ Σ_i T_i.
// Each germ belongs to one parameter, so these are the parameters' own indices. Correlated
// parameters have none.
//
// The activity of a parameter is the share of the variance of all outputs and times that involves
// it, each output in units of its noise σ_o:
//   a_i = Σ_o ∫ T_i V/σ_o² dt ÷ Σ_o ∫ V/σ_o² dt                     (trapezoidal rule).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "polyest/diagnostic.h"
#include "polyest/prior_propagation.h"
#include "polyest/problem.h"
#include "polyest/stop.h"
#include "polyest/types.h"

namespace polyest {

// An expansion is inaccurate if it differs from the model by more than this share of an output's
// variance: residual² ÷ variance of the model, both at draws of the prior.
inline constexpr double kUnexplained = 0.05;

// What to compute.
struct SensitivityOptions {
  double until_s = 0;                // > 0: the last time
  double step_s = 0;                 // > 0; times are 0, step, 2 step … until
  std::vector<std::string> outputs;  // names; empty: the measured ones, or all if none is
  // Draws of the prior at which the expansion is compared with the model, kMinPriorDraws …
  // kMaxPriorDraws.
  int draws = kPriorDraws;
  int threads = 1;  // ≥ 1; results do not depend on it

  // Returns OK, or INVALID_ARGUMENT with the field, the value and the rule.
  absl::Status Validate() const;
};

// One output over time, in its unit. Vectors have one entry for each time, matrices are times ×
// parameters.
struct OutputSensitivity {
  std::string output;  // its name
  std::string unit;    // "1" for a plain number; empty: the equations give none
  Vector mean;         // under the prior
  Vector std_dev;      // √V
  // S_i, 0 … 1; 0 where the output does not vary: where √V is no more than an error of the
  // integration, ten times its relative tolerance of the output's largest magnitude.
  Matrix first_order;
  Matrix total;  // T_i, 0 … 1; 0 where the output does not vary
  // Root mean square of model − expansion at draws of the prior that are in no fit. Where it is not
  // small beside √V, the indices cannot be trusted.
  Vector residual;
  // σ_o of a sample equal to the mean: the problem's noise of the output, or 1 % of the range of
  // its predictions.
  Vector noise;
};

// How much one parameter matters over all outputs and times.
struct ParameterActivity {
  std::string parameter;  // its name
  double share = 0;       // a_i, 0 … 1; 0 when nothing varies
  // The largest √(T_i V)/σ_o of any output at any time: the most by which not knowing this
  // parameter changes one sample, in standard deviations of the sample's noise.
  double peak_to_noise = 0;
};

// The sensitivities of the outputs.
struct SensitivityAnalysis {
  std::vector<double> time_s;               // 0, step, 2 step …
  std::vector<std::string> parameters;      // the columns of the matrices
  std::vector<OutputSensitivity> outputs;   // as asked for
  std::vector<ParameterActivity> activity;  // the most active first
  int order = 0;                            // of the expansion, p
  int terms = 0;                            // of the expansion, S
  int points = 0;                           // of collocation, Q
  int draws = 0;                            // of the prior, besides
  // kExpansionInaccurate when the expansion differs from the model by more than kUnexplained of an
  // output's variance; kPointsFailed.
  std::vector<Diagnostic> diagnostics;
};

// Computes Sobol' indices over the problem's prior. INVALID_ARGUMENT names the field, the value and
// the rule, `correlations` when there are any; otherwise as PropagatePrior.
absl::StatusOr<SensitivityAnalysis> AnalyzeSensitivity(const Problem& problem,
                                                       const SensitivityOptions& options,
                                                       const Stop& stop = {});

}  // namespace polyest
