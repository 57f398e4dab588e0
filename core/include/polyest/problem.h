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
// was before the run. With a negative delay an output shows what is to come, or an input was
// recorded late. If inputs are streamed, samples then wait for the values that they need, at most
// as long as the priors allow, and those at the end of a run, which would need values after the
// last ones, are not used. A negative delay of a streamed input must be bounded by its prior.

#include <map>
#include <memory>
#include <optional>
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

// White noise w of spectral density q that drives a state, dx/dt = f + w: what a model that is not
// perfect leaves out, disturbing forces above all (on the state that is a velocity). In Itô's
// terms, dx = f dt + √q dβ: without f, the state would wander by √(q t) in the time t.
struct ProcessNoise {
  std::string state;            // one of the model's states; each at most once
  double spectral_density = 0;  // q ≥ 0, in (unit of the state)²/s; 0 if unknown
  // Whether q is estimated, as the uncertain parameter "processNoise.<state>" with a constant prior
  // density of log q between the bounds.
  bool unknown = false;
  // Bounds of an unknown q, 10⁻⁵⁰ ≤ lower < upper ≤ 10⁵⁰ and upper ≤ 10²⁰ lower; else 0.
  double lower = 0, upper = 0;
};

// What the samples are compared with.
enum class LikelihoodForm {
  kOutputError,      // the outputs of the model from its initial states: the model is perfect
  kPredictionError,  // the predictions of a Kalman filter from the samples before
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
  // derived has the model's default. At most 10¹⁰⁰ in magnitude.
  std::map<std::string, double> fixed;
  std::vector<UncertainParameter> uncertain;  // what is estimated; at least one
  std::vector<Correlation> correlations;      // of pairs of them; a pair not listed has none
  // Settable quantities tied to others by expressions: {"k2": "k1"}. Expressions may use all
  // settable quantities, other derived ones among them, but not in a circle.
  std::map<std::string, std::string> derived;
  std::vector<NamedInput> inputs;           // an input not listed is 0
  std::vector<MeasuredOutput> measured;     // at least one for an estimator; studies may have none
  std::vector<ProcessNoise> process_noise;  // what drives the states beside the inputs
  // Default: kPredictionError if there is process noise or a parameter drifts, else kOutputError.
  // With kPredictionError the model must have from 1 to 32 states, drifting parameters among them,
  // that can be set (a StateSpaceModel, or an FMU for Model Exchange without events), and equations
  // that do not switch; outputs have no delays; noise of the samples is known, white and
  // not relative, and its outliers are not kHuber; there are no populations; regularization_mode is
  // kFixed.
  std::optional<LikelihoodForm> likelihood;
  ExpansionOptions expansion;  // how the outputs are expanded
  double regularization = 1;   // α² ≥ 0 of the cost J_mismatch + α² J_apriori
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
