#pragma once

// A campaign of short runs y = v t + b + noise whose slopes v are of one population, and the exact
// posterior: given the population's mean m and spread s everything is linear and Gaussian, and m
// and s are integrated on a grid.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

#include "core/model/equations/equation_model.h"
#include "polyest/estimator.h"

namespace polyest::internal {

struct PopulationCampaign {
  static constexpr double kTrueMean = 5, kTrueSpread = 0.3, kTrueOffset = 0.4;
  static constexpr double kPriorMean = 5.5, kPriorDeviation = 1;
  static constexpr std::array<double, 4> kTimes = {0.5, 1, 1.5, 2};

  double noise = 0.1;

  Problem MakeProblem() const {
    EquationSpecification equations;
    equations.outputs = {{"y", "v * t + b"}};
    Problem problem;
    problem.model = MakeEquationModel(equations).value();
    UncertainParameter v = UncertainParameter::Normal("v", kPriorMean, kPriorDeviation).value();
    v.per_run = v.population = true;
    problem.uncertain = {std::move(v), UncertainParameter::Normal("b", 0, 1).value()};
    problem.measured = {{"y", {.absolute = noise}}};
    return problem;
  }

  Samples MakeRuns(int runs, uint64_t seed = 1) const {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    Samples samples;
    samples.columns = {{"y", {}, {}}};
    for (int run = 0; run < runs; ++run) {
      const double v = kTrueMean + kTrueSpread * normal(generator);
      for (const double t : kTimes) {
        samples.run.push_back(run);
        samples.time_s.push_back(t);
        samples.columns[0].value.push_back(v * t + kTrueOffset + noise * normal(generator));
      }
    }
    return samples;
  }

  // Runs of one sample each, at random times.
  Samples MakeShortRuns(int runs, uint64_t seed) const {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> time(0.1, 2);
    Samples samples;
    samples.columns = {{"y", {}, {}}};
    for (int run = 0; run < runs; ++run) {
      const double v = kTrueMean + kTrueSpread * normal(generator), t = time(generator);
      samples.run.push_back(run);
      samples.time_s.push_back(t);
      samples.columns[0].value.push_back(v * t + kTrueOffset + noise * normal(generator));
    }
    return samples;
  }
};

struct Moments {
  double weight = 0, first = 0, second = 0;
  void Add(double density, double mean, double variance = 0) {
    weight += density;
    first += density * mean;
    second += density * (mean * mean + variance);
  }
  double mean() const { return first / weight; }
  double deviation() const { return std::sqrt(second / weight - mean() * mean()); }
};

struct PopulationOracle {
  Moments mean, spread, offset, last;  // of the last run's slope

  PopulationOracle(const PopulationCampaign& campaign, const Samples& samples) {
    constexpr int kGrid = 300;
    // Of the logarithm of the density, at the modes of two passes: the first finds the greatest.
    double greatest = -1e300;
    for (int pass = 0; pass < 2; ++pass) {
      for (int i = 0; i < kGrid; ++i) {
        for (int j = 0; j < kGrid; ++j) {
          const double m = 2 + 7 * (i + 0.5) / kGrid, log_s = -7 + 11 * (j + 0.5) / kGrid;
          const double log_density = AddAt(campaign, samples, m, std::exp(log_s), greatest, pass);
          greatest = std::max(greatest, log_density);
        }
      }
    }
  }

 private:
  double AddAt(const PopulationCampaign& campaign, const Samples& samples, double m, double s,
               double greatest, int pass) {
    const double noise2 = campaign.noise * campaign.noise;
    double log_density = -0.5 * std::pow(m - PopulationCampaign::kPriorMean, 2) -
                         0.5 * std::pow(std::log(s / 0.5), 2);
    double A = 1, B = 0, te_last = 0, t1_last = 0, tt_last = 0;
    for (size_t row = 0; row < samples.rows();) {
      double n = 0, tt = 0, t1 = 0, ee = 0, te = 0, e1 = 0;
      const size_t first = row;
      for (; row < samples.rows() && samples.run[row] == samples.run[first]; ++row) {
        const double t = samples.time_s[row], e = samples.columns[0].value[row] - t * m;
        n += 1;
        tt += t * t;
        t1 += t;
        ee += e * e;
        te += t * e;
        e1 += e;
      }
      // C = s² t tᵀ + σ² I of a run's samples; C⁻¹ = (I − k t tᵀ)/σ².
      const double k = s * s / (noise2 + s * s * tt);
      A += (n - k * t1 * t1) / noise2;
      B += (e1 - k * t1 * te) / noise2;
      log_density -= 0.5 * (ee - k * te * te) / noise2 + 0.5 * std::log(1 + s * s * tt / noise2);
      te_last = te;
      t1_last = t1;
      tt_last = tt;
    }
    log_density += 0.5 * B * B / A - 0.5 * std::log(A);
    if (pass == 0) return log_density;
    const double density = std::exp(log_density - greatest);
    const double b = B / A, information = 1 / (s * s) + tt_last / noise2;
    mean.Add(density, m);
    spread.Add(density, s);
    offset.Add(density, b, 1 / A);
    const double follows = t1_last / noise2 / information;
    last.Add(density, m + (te_last - t1_last * b) / noise2 / information,
             1 / information + follows * follows / A);
    return log_density;
  }
};

}  // namespace polyest::internal
