#pragma once

// What is to be estimated: a model, what of it is uncertain, what drives it and what is measured.
//
// The settable quantities can be given a value or a prior by name. They are the model's parameters,
// its initial states among them, and the parameters of its channels,
//
//   u(t) = u.gain · u.amplitude · shape(t − u.delay) + u.offset    of an input u,
//   sample(t) = x.gain · x(t − x.delay) + x.offset + noise         of an output x,
//
// by default gain 1, delay 0 and offset 0. The delay of an output must be bounded by its prior.
// Samples of an output before the largest delay that the prior allows are not used: they show what
// was before the run. A negative delay, by which an output shows what is to come, is possible
// without streamed inputs only; with them, delay the inputs instead.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "polyest/expansion_options.h"
#include "polyest/input_signal.h"
#include "polyest/integration_options.h"
#include "polyest/model.h"
#include "polyest/noise.h"
#include "polyest/uncertain_parameter.h"

namespace polyest {

// What drives an input of the model.
struct NamedInput {
  std::string name;           // one of the model's inputs
  InputSpecification signal;  // a constant, a step, …, or values that come with the samples
};

// An output that is measured.
struct MeasuredOutput {
  std::string output;  // one of the model's outputs
  NoiseModel noise;    // of its samples
};

// How the regularization weight α² is chosen. Where a rule has no answer, α² is 1, and a diagnostic
// says so.
enum class RegularizationMode {
  kFixed,        // Problem::regularization
  kLCurve,       // the corner of the L-curve of mismatch and prior
  kDiscrepancy,  // the largest α² whose minimum meets the data as well as their noise allows
  kEvidence,     // the α² that makes the data most probable
};

// Everything an estimator is made from. Names are checked when it is made.
struct Problem {
  std::shared_ptr<const Model> model;  // not null
  // Settable quantities whose values are known. A quantity that is neither fixed nor uncertain nor
  // derived has the model's default.
  std::map<std::string, double> fixed;
  std::vector<UncertainParameter> uncertain;  // what is estimated; at least one
  std::vector<Correlation> correlations;      // of pairs of them; a pair not listed has none
  // Settable quantities tied to others by expressions: {"k2": "k1"}. Expressions may use all
  // settable quantities, other derived ones among them, but not in a circle.
  std::map<std::string, std::string> derived;
  std::vector<NamedInput> inputs;        // an input not listed is 0
  std::vector<MeasuredOutput> measured;  // at least one for an estimator; studies may have none
  ExpansionOptions expansion;            // how the outputs are expanded
  double regularization = 1;             // α² ≥ 0 of the cost J_mismatch + α² J_prior
  RegularizationMode regularization_mode = RegularizationMode::kFixed;  // how α² is chosen
  IntegrationOptions integration;  // how trajectories are integrated
  // Whether integration.relative_tolerance is tightened, down to 1e-12, where the noise of the
  // samples or the error of integration that it leaves asks for it; set it to false with a
  // tolerance of your own. Without effect on a fixed expansion.
  bool tolerance_follows_noise = true;
  // The condition under which a row's samples are used, in the language of equation models, over t
  // and columns of the data: "v > 5 && !reverse". Where it is 0, the row's streamed inputs still
  // drive the model, and its measured samples count as missing. Columns that it names are allowed
  // in the data beside measured outputs and streamed inputs; where one has no sample, it keeps its
  // last value of the run, and before the first one no row is used. Empty: every row is used.
  std::string use_when;
};

}  // namespace polyest
