#include "core/estimator/posterior/undersampling.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/identifiability.h"

namespace polyest::internal {
namespace {

constexpr int kPhases = 8;  // number of equal parts of an interval between samples

struct Times {
  std::vector<double> time_s;  // every phase of every interval; the first begins at t = 0
  std::vector<int> row;        // row of the sample that ends the interval
};

Times FineTimes(const RowBlock& beginning) {
  Times times;
  double before = 0;
  for (int k = 0; k < beginning.count(); ++k) {
    const double after = beginning.rows[static_cast<size_t>(k)].time_s;
    for (int phase = 1; phase <= kPhases; ++phase) {
      times.time_s.push_back(phase == kPhases ? after
                                              : before + (after - before) * phase / kPhases);
      times.row.push_back(k);
    }
    before = after;
  }
  return times;
}

}  // namespace

SamplingInformation InformationBetweenSamples(const ResolvedProblem& problem,
                                              const LearnedNoise& noise, const RowBlock& beginning,
                                              const Vector& map_xi, int parameter) {
  SamplingInformation information;
  if (beginning.count() == 0 || !problem.streamed_inputs().empty()) return information;
  const Prior& prior = problem.prior();
  // Scores are used because with them this parameter can move alone.
  const Vector map_z = prior.ToScores(map_xi);
  const double deviation = prior.GermStandardDeviation()[parameter];
  const double low = std::max(prior.lower()[parameter], map_z[parameter] - 0.5 * deviation);
  const double high = std::min(prior.upper()[parameter], map_z[parameter] + 0.5 * deviation);
  const double distance = (high - low) / deviation;
  Matrix thetas = prior.ToParameters(map_xi).transpose().replicate(2, 1);
  thetas(0, parameter) = prior.OfScore(parameter, low);
  thetas(1, parameter) = prior.OfScore(parameter, high);

  const InputSignals inputs = problem.MakeInputs();
  EnsemblePropagator propagator(problem.MakeEnsemble(thetas, problem.outputs(), 1), &inputs);
  const Times times = FineTimes(beginning);
  const int m = problem.channels();
  Matrix outputs(2, m * static_cast<Eigen::Index>(times.time_s.size()));
  if (!propagator.Advance(times.time_s, outputs, Stop()).ok() || !outputs.allFinite()) {
    return information;
  }
  Vector by_phase = Vector::Zero(kPhases);
  Vector largest = Vector::Zero(m);
  for (Eigen::Index column = 0; column < outputs.cols(); ++column) {
    largest[column % m] = std::max(largest[column % m], outputs.col(column).cwiseAbs().maxCoeff());
  }
  for (size_t i = 0; i < times.time_s.size(); ++i) {
    for (int c = 0; c < m; ++c) {
      if (beginning.noise[static_cast<size_t>(times.row[i] * m + c)] <= 0) continue;  // no sample
      const auto column = static_cast<Eigen::Index>(i) * m + c;
      const double sigma =
          noise.channels[static_cast<size_t>(c)].scale *
          problem.problem().measured[static_cast<size_t>(c)].noise.StandardDeviation(
              outputs.col(column).mean(), largest[c]);
      if (sigma <= 0) continue;  // an output that is always 0 has no relative noise
      const double slope = (outputs(1, column) - outputs(0, column)) / distance / sigma;
      by_phase[static_cast<Eigen::Index>(i) % kPhases] += slope * slope;
    }
  }
  information.at_samples = by_phase[kPhases - 1];
  information.between = by_phase.maxCoeff();
  information.undersampled =
      information.at_samples < kWeakInformation && information.between > kIdentifiedInformation;
  return information;
}

}  // namespace polyest::internal
