#include "core/estimator/memory_use.h"

#include <algorithm>
#include <cmath>

#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {
namespace {

// Vectors of a trajectory's states that its integrator holds: CVODES keeps a history of up to the
// order 5 or 12 and some for its own work; a block of trajectories has a Jacobian besides.
constexpr double kVectorsOfStates = 24;
// Rows whose outputs, and what the fit leaves of them, are held at a time.
constexpr double kRows = 64;
// Matrices of S × S of a channel: G of the samples and of their differences, and once more those of
// the state that is kept and of the windows of the record.
constexpr double kSumsOfChannel = 6;
// Everything that does not grow with the sizes below.
constexpr double kBase = 64 << 10;

struct Sizes {
  double terms = 0;     // S
  double points = 0;    // Q and the check points
  double channels = 0;  // m
  double states = 0;
};

int64_t Bytes(const Sizes& sizes) {
  const auto& [terms, points, channels, states] = sizes;
  // The collocation matrix and its orthogonal factor, and its triangular one.
  const double factors = 2 * points * terms + terms * terms;
  const double sums = kSumsOfChannel * channels * terms * terms;
  const double trajectories = points * (kVectorsOfStates * states + 2 * kRows * channels);
  return static_cast<int64_t>(kBase + sizeof(double) * (factors + sums + trajectories));
}

double StatesOf(const ResolvedProblem& problem) {
  const auto states = static_cast<double>(problem.problem().model->description().states.size());
  // A filter has a covariance besides.
  return problem.uses_filters() ? states * (states + 1) : states;
}

}  // namespace

int64_t BytesOf(const ResolvedProblem& problem, const RegionalExpansion& expansion) {
  const ExpansionDesign& design = expansion.design();
  return Bytes({static_cast<double>(design.basis->size()),
                static_cast<double>(design.points.rows() + design.check_points.rows()),
                static_cast<double>(problem.channels()), StatesOf(problem)});
}

int64_t BytesOf(const ComponentMixture& mixture) {
  int64_t bytes = 0;
  for (size_t i = 0; i < mixture.size(); ++i) {
    const MixtureComponent& component = mixture.component(i);
    bytes += BytesOf(component.problem(), component.expansion());
  }
  return bytes;
}

int64_t ExpectedBytes(const ResolvedProblem& problem) {
  const ExpansionOptions& options = problem.problem().expansion;
  const int dimension = problem.dimension();
  const Truncation truncation = FirstTruncation(options, dimension);
  const auto terms = static_cast<double>(TermCount(dimension, truncation, kMaxTerms));
  const double points = PointCountOnPrior(options, dimension, truncation, terms);
  return Bytes({terms, points + CheckCount(dimension), static_cast<double>(problem.channels()),
                StatesOf(problem)});
}

}  // namespace polyest::internal
