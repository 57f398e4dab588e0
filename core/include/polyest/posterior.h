#pragma once

// The posterior in detail: marginal and joint densities, quantiles and draws. An estimate describes
// the same posterior from fewer draws. Estimator::CurrentPosterior computes it.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "polyest/density.h"
#include "polyest/diagnostic.h"
#include "polyest/types.h"

namespace polyest {

// Limits past which options are INVALID_ARGUMENT.
inline constexpr int kMaxPosteriorSamples = 100'000;  // PosteriorOptions::samples
inline constexpr int kMaxPosteriorBins = 1'000;       // PosteriorOptions::density_bins
inline constexpr int kMaxJointBins = 200;             // PosteriorOptions::joint_bins
inline constexpr size_t kMaxJointDensities = 100;     // PosteriorOptions::joints
inline constexpr size_t kMaxProbabilities = 1'000;    // PosteriorOptions::probabilities

// How draws of the posterior were made.
enum class PosteriorMethod {
  // Weighted draws of a Gaussian, for a posterior that is nearly Gaussian, or of an even cover, in
  // at most three dimensions.
  kImportanceSampling,
  kMarkovChains,  // differential evolution, started from draws of tempered posteriors
};

// What to compute.
struct PosteriorOptions {
  std::vector<double> probabilities = {0.025, 0.5, 0.975};  // of the quantiles, in (0, 1)
  int density_bins = 100;  // of each marginal density; 0: no densities
  // Pairs of uncertain parameters, each of two different ones, whose joint density is wanted.
  std::vector<std::pair<std::string, std::string>> joints;
  int joint_bins = 40;  // on each axis of a joint density, ≥ 1
  int samples = 0;      // number of draws to return
};

// The posterior of one parameter; numbers are in its unit unless said otherwise.
struct PosteriorMarginal {
  std::string parameter;      // its name
  std::string unit;           // "1" for a plain number; empty: the equations give none
  double mean = 0;            // of the posterior
  double std_dev = 0;         // of the posterior
  Vector quantiles;           // one for each probability asked for
  DensityEstimate density;    // over the central 99.9 %; empty when not asked for
  double effective_size = 0;  // number of independent draws that would tell as much
  double r_hat = 0;           // of the chains, 1 when they have mixed; 0 for importance sampling
};

// The posterior of two parameters together.
struct PosteriorJoint {
  std::string first, second;  // their names
  JointDensity density;       // over the central 99.9 % of each
};

// The posterior.
struct Posterior {
  PosteriorMethod method = PosteriorMethod::kMarkovChains;  // how it was drawn
  int64_t draws = 0;                         // number of draws the answer is computed from
  double effective_size = 0;                 // the least of the marginals'
  double r_hat = 0;                          // the largest of the marginals'
  std::vector<PosteriorMarginal> marginals;  // in the problem's order
  std::vector<PosteriorJoint> joints;        // as asked for
  Matrix samples;  // draws returned × uncertain parameters, equally weighted
  // The group of Markov chains that each of them is of, in increasing order and as often as the
  // others to within one. Groups never exchange anything, so that R̂ can be computed from them.
  // Empty for importance sampling, for a posterior in pieces of which one was drawn so, and where a
  // group has less than half of its share of the posterior.
  std::vector<int> sample_chains;
  // log of the density that model, noise and prior give to the samples, ∫ p(z | θ) p(θ) dθ; the
  // unit of a sample's density is 1/unit of its output. The difference of two problems' for the
  // same samples is the log of the odds that the samples give to them. Noise of unknown size counts
  // with p(s) ∝ 1/s, so that only problems with the same unknown noises can be compared. None where
  // α² is not 1, where a component has none, where parameters of ended runs have been integrated
  // out, and where samples with outliers contradict the noise or have not told its unknown size
  // yet.
  std::optional<double> log_evidence;
  // Those of an estimate from the same draws, and kNotConverged if the chains have not mixed.
  std::vector<Diagnostic> diagnostics;
  double time_s = 0;          // of the last sample
  int64_t sample_values = 0;  // values taken, as Estimate::samples
};

}  // namespace polyest
