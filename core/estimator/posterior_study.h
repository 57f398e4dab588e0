#pragma once

// The posterior (21)–(23) in full: marginal and joint densities, quantiles and draws of it, on the
// expansion. What an estimate says of the posterior is the same, from fewer draws.

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/bayes/weighted_samples.h"
#include "core/estimator/assessment.h"

namespace polyest {

inline constexpr int kMostPosteriorSamples = 100'000;
inline constexpr int kMostPosteriorBins = 1'000;
inline constexpr int kMostJointBins = 200;
inline constexpr size_t kMostJointDensities = 100;
inline constexpr size_t kMostProbabilities = 1'000;

struct PosteriorOptions {
  std::vector<double> probabilities = {0.025, 0.5, 0.975};  // of the quantiles, in (0, 1)
  int density_bins = 100;                                   // 0: no densities
  // Pairs of uncertain parameters, each of two different ones.
  std::vector<std::pair<std::string, std::string>> joints;
  int joint_bins = 40;  // an axis, ≥ 1
  int samples = 0;      // draws given out

  // INVALID_ARGUMENT names the field, the value and the rule.
  absl::Status Validate(const Prior& prior) const;
  // The work that answers deserve that go into such detail.
  PosteriorEffort Effort() const;
};

struct PosteriorMarginal {
  std::string parameter;
  std::string unit;
  double mean = 0;
  double std_dev = 0;
  Vector quantiles;         // one a probability
  DensityEstimate density;  // over the central 99.9 %; empty when not asked for
  double effective_size = 0;
  double r_hat = 0;  // 0 for importance sampling, which has no chains
};

struct PosteriorJoint {
  std::string first, second;
  JointDensity density;
};

struct Posterior {
  PosteriorMethod method = PosteriorMethod::kMarkovChains;
  int64_t draws = 0;
  double effective_size = 0;  // the least of the marginals'
  double r_hat = 0;           // the largest of the marginals'
  std::vector<PosteriorMarginal> marginals;
  std::vector<PosteriorJoint> joints;
  Matrix samples;  // samples × n, equally weighted, of θ
  // What an estimate from the same draws is warned of, and NOT_CONVERGED where its chains have not
  // mixed.
  std::vector<Diagnostic> diagnostics;
  double time_s = 0;
  int64_t sample_values = 0;  // taken, as Estimate::samples
};

// options have been validated.
Posterior DescribePosterior(const Assessed& assessed, const Prior& prior,
                            const PosteriorOptions& options);

}  // namespace polyest
