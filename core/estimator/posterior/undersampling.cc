#include "core/estimator/posterior/undersampling.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/bayes/identifiability.h"

namespace polyest::internal {
namespace {

constexpr int kPhases = 8;  // number of equal parts of an interval between samples
// Fewest rows and turning points from which a response is judged.
constexpr int kMinRowsTested = 8;
constexpr size_t kMinTurns = 4;
// A turning point counts if the response swings by more than this many standard deviations of the
// noise before and after it.
constexpr double kSwing = 4;
// Root mean square of how far samples may be from even spacing, in intervals.
constexpr double kUneven = 0.05;
// By how many prior standard deviations parameters are moved to find other responses.
constexpr double kMoved = 2;
// Turning points between two samples from which on a response is said to have images: with four
// samples a period, or with two where there are so few parameters that all minima are searched.
constexpr double kRare = 0.5, kRareIfSearched = 1;
constexpr int kMaxSearched = 3;
constexpr double kInexact = 0.1;  // of a number of turning points between two samples

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

struct SamplingInformation {
  double at_samples = 0;
  double between = 0;  // the largest over several phases of the intervals, the samples included
  bool undersampled = false;
};

// Returns the outputs at the times (channels by turns) of the model at parameters, one row each;
// nothing if it cannot be run there or is stopped.
std::optional<Matrix> RunAt(const ResolvedProblem& problem, const Matrix& thetas,
                            const std::vector<double>& times_s, const Stop& stop) {
  const InputSignals inputs = problem.MakeInputs();
  EnsemblePropagator propagator(problem.MakeEnsemble(thetas, problem.outputs(), 1), &inputs);
  Matrix outputs(thetas.rows(), problem.channels() * std::ssize(times_s));
  if (!propagator.Advance(times_s, outputs, stop).ok() || !outputs.allFinite()) {
    return std::nullopt;
  }
  return outputs;
}

// Returns the score of parameter i moved from the estimate by a number of prior standard
// deviations, at most to the bounds of Ω. Scores are used because with them a parameter can move
// alone.
double MovedScore(const Prior& prior, const Vector& map_z, int i, double deviations) {
  return std::clamp(map_z[i] + deviations * prior.GermStandardDeviation()[i], prior.lower()[i],
                    prior.upper()[i]);
}

// Returns the parameters of the estimate, with one of them moved so.
Vector Moved(const Prior& prior, const Vector& map_xi, int i, double deviations) {
  Vector theta = prior.ToParameters(map_xi);
  theta[i] = prior.OfScore(i, MovedScore(prior, prior.ToScores(map_xi), i, deviations));
  return theta;
}

// Returns the standard deviation of the noise of a channel about an output.
double Deviation(const Findings& findings, int channel, double output, double largest) {
  const NoiseModel& noise =
      findings.problem->problem().measured[static_cast<size_t>(channel)].noise;
  return findings.expansion->noise().channels[static_cast<size_t>(channel)].scale *
         noise.StandardDeviation(output, largest);
}

// Returns the information about a parameter, from runs of the model with it moved by half a prior
// standard deviation to each side; zeros if the model cannot be run.
SamplingInformation InformationBetweenSamples(const Findings& findings, int parameter,
                                              const Stop& stop) {
  SamplingInformation information;
  const RowBlock& beginning = findings.record->beginning();
  const Prior& prior = findings.problem->prior();
  const Vector map_z = prior.ToScores(findings.map_xi);
  const double distance =
      (MovedScore(prior, map_z, parameter, 0.5) - MovedScore(prior, map_z, parameter, -0.5)) /
      prior.GermStandardDeviation()[parameter];
  Matrix thetas(2, prior.dimension());
  thetas << Moved(prior, findings.map_xi, parameter, -0.5).transpose(),
      Moved(prior, findings.map_xi, parameter, 0.5).transpose();
  const Times times = FineTimes(beginning);
  const int m = findings.problem->channels();
  const std::optional<Matrix> outputs = RunAt(*findings.problem, thetas, times.time_s, stop);
  if (!outputs) return information;
  Vector by_phase = Vector::Zero(kPhases);
  Vector largest = Vector::Zero(m);
  for (Eigen::Index column = 0; column < outputs->cols(); ++column) {
    largest[column % m] = std::max(largest[column % m], outputs->col(column).cwiseAbs().maxCoeff());
  }
  for (size_t i = 0; i < times.time_s.size(); ++i) {
    for (int c = 0; c < m; ++c) {
      if (beginning.noise[static_cast<size_t>(times.row[i] * m + c)] <= 0) continue;  // no sample
      const auto column = static_cast<Eigen::Index>(i) * m + c;
      const double sigma = Deviation(findings, c, outputs->col(column).mean(), largest[c]);
      if (sigma <= 0) continue;  // an output that is always 0 has no relative noise
      const double slope = ((*outputs)(1, column) - (*outputs)(0, column)) / distance / sigma;
      by_phase[static_cast<Eigen::Index>(i) % kPhases] += slope * slope;
    }
  }
  information.at_samples = by_phase[kPhases - 1];
  information.between = by_phase.maxCoeff();
  information.undersampled =
      information.at_samples < kWeakInformation && information.between > kIdentifiedInformation;
  return information;
}

// Returns the numbers of the rows in which a channel has a sample.
std::vector<int> RowsWithSamples(const RowBlock& beginning, int channels, int channel) {
  std::vector<int> rows;
  for (int k = 0; k < beginning.count(); ++k) {
    if (beginning.noise[static_cast<size_t>(k * channels + channel)] > 0) rows.push_back(k);
  }
  return rows;
}

// Whether the samples in these rows are so evenly spaced that those of responses that differ by the
// sampling rate are alike.
bool AreEven(const RowBlock& beginning, const std::vector<int>& rows) {
  const auto time = [&](int row) { return beginning.rows[static_cast<size_t>(row)].time_s; };
  const double interval = (time(rows.back()) - time(rows.front())) / (std::ssize(rows) - 1.0);
  double squares = 0;
  for (size_t i = 0; i < rows.size(); ++i) {
    const double late = time(rows[i]) - time(rows.front()) - static_cast<double>(i) * interval;
    squares += late * late;
  }
  return std::sqrt(squares / static_cast<double>(rows.size())) <= kUneven * interval;
}

// Returns an output at all times of one of the runs.
Vector OutputOf(const Matrix& outputs, Eigen::Index run, int channel, int channels) {
  return Vector::NullaryExpr(outputs.cols() / channels,
                             [&](Eigen::Index i) { return outputs(run, i * channels + channel); });
}

// Returns the number of turning points between two samples, the mean from the first to the last
// one; 0 where there are too few. `outputs` is a channel at all times of FineTimes, and what it
// swings by less than `least` does not count.
double TurnsBetweenSamples(const Vector& outputs, const Times& times, const std::vector<int>& rows,
                           double least) {
  const auto at = [](int row) { return (row + 1) * kPhases - 1; };
  const auto time = [&](int j) { return times.time_s[static_cast<size_t>(j)]; };
  const int begin = at(rows.front()), end = at(rows.back());
  int low = begin, high = begin;  // where the output was the lowest and the highest since a turn
  int direction = 0;
  std::vector<int> turns;
  for (int j = begin; j <= end; ++j) {
    if (outputs[j] < outputs[low]) low = j;
    if (outputs[j] > outputs[high]) high = j;
    const bool rises = direction <= 0 && outputs[j] - outputs[low] > least;
    const bool falls = direction >= 0 && outputs[high] - outputs[j] > least;
    if (!rises && !falls) continue;
    if (direction != 0) turns.push_back(rises ? low : high);
    direction = rises ? 1 : -1;
    low = high = j;
  }
  if (turns.size() < kMinTurns) return 0;
  const double interval = (time(end) - time(begin)) / (std::ssize(rows) - 1.0);
  return (std::ssize(turns) - 1.0) * interval / (time(turns.back()) - time(turns.front()));
}

// A channel whose response turns so often that others have the same samples.
struct Aliased {
  int channel = 0;
  double turns = 0;
};

// Returns the channel that turns the least of all that turn in a run, unless it turns so seldom
// that it has no images or the samples are uneven.
std::optional<Aliased> AliasedChannel(const Findings& findings, const Times& times,
                                      const Matrix& outputs) {
  const RowBlock& beginning = findings.record->beginning();
  const int m = findings.problem->channels();
  const double rare = findings.problem->dimension() > kMaxSearched ? kRare : kRareIfSearched;
  std::optional<Aliased> least;
  for (int c = 0; c < m; ++c) {
    const std::vector<int> rows = RowsWithSamples(beginning, m, c);
    if (std::ssize(rows) < kMinRowsTested) continue;
    const Vector channel = OutputOf(outputs, 0, c, m);
    const double largest = channel.cwiseAbs().maxCoeff();
    const double turns = TurnsBetweenSamples(channel, times, rows,
                                             kSwing * Deviation(findings, c, largest, largest));
    if (turns == 0) continue;
    if (turns < rare || !AreEven(beginning, rows)) return std::nullopt;
    if (!least || turns < least->turns) least = Aliased{c, turns};
  }
  return least;
}

// Whether there is an image of a response with `turns` turning points between two samples from it
// to one with `others`. A vibration of frequency f turns 2 f Δt times, and those of f and
// n/Δt ± f have the same samples at intervals Δt.
bool PassesAnImage(double turns, double others) {
  const double low = std::min(turns, others) - kInexact, high = std::max(turns, others) + kInexact;
  for (double n = 0; 2 * n - turns <= high; ++n) {
    for (const double image : {2 * n - turns, 2 * n + turns}) {
      const bool is_itself = std::abs(image - turns) < 1e-9;
      if (!is_itself && image > 0 && image >= low && image <= high) return true;
    }
  }
  return false;
}

// Whether a channel's response passes one of its images where the parameters are moved within the
// prior.
bool PriorAllowsAnImage(const Findings& findings, const Times& times, const Aliased& aliased,
                        const Stop& stop) {
  const Prior& prior = findings.problem->prior();
  const int n = prior.dimension(), m = findings.problem->channels();
  Matrix thetas(2 * n, n);
  for (int i = 0; i < n; ++i) {
    thetas.row(2 * i) = Moved(prior, findings.map_xi, i, -kMoved).transpose();
    thetas.row(2 * i + 1) = Moved(prior, findings.map_xi, i, kMoved).transpose();
  }
  const std::optional<Matrix> outputs = RunAt(*findings.problem, thetas, times.time_s, stop);
  if (!outputs) return false;
  const std::vector<int> rows = RowsWithSamples(findings.record->beginning(), m, aliased.channel);
  for (Eigen::Index run = 0; run < outputs->rows(); ++run) {
    const Vector channel = OutputOf(*outputs, run, aliased.channel, m);
    const double largest = channel.cwiseAbs().maxCoeff();
    const double least = kSwing * Deviation(findings, aliased.channel, largest, largest);
    const double turns = TurnsBetweenSamples(channel, times, rows, least);
    if (turns > 0 && PassesAnImage(aliased.turns, turns)) return true;
  }
  return false;
}

void AddAliasing(const Findings& findings, const Estimate& estimate, const Stop& stop,
                 std::vector<Diagnostic>& diagnostics) {
  const bool tells = std::ranges::any_of(estimate.parameters, [](const ParameterEstimate& p) {
    return p.verdict != Verdict::kNotIdentified;
  });
  if (!tells || dynamic_cast<const StateSpaceModel*>(findings.problem->model().get()) == nullptr) {
    return;
  }
  const Times times = FineTimes(findings.record->beginning());
  const Vector theta = findings.problem->prior().ToParameters(findings.map_xi);
  const std::optional<Matrix> outputs =
      RunAt(*findings.problem, theta.transpose(), times.time_s, stop);
  if (!outputs) return;
  const auto aliased = AliasedChannel(findings, times, *outputs);
  if (!aliased || !PriorAllowsAnImage(findings, times, *aliased, stop)) return;
  const auto channel = static_cast<size_t>(aliased->channel);
  diagnostics.push_back(
      {DiagnosticCode::kUndersampled,
       absl::StrFormat("at the estimate, %s has %.2g turning points between two samples: other "
                       "values, with a slower or faster response, may fit as well; sample more "
                       "often or at uneven times, or narrow the prior",
                       estimate.channels[channel].output, aliased->turns)});
}

}  // namespace

void AddUndersampling(const Findings& findings, const Estimate& estimate, const Stop& stop,
                      std::vector<Diagnostic>& diagnostics) {
  if (findings.record->beginning().count() == 0 || !findings.problem->streamed_inputs().empty()) {
    return;
  }
  for (int i = 0; i < findings.problem->dimension(); ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    if (parameter.verdict != Verdict::kNotIdentified) continue;
    const SamplingInformation information = InformationBetweenSamples(findings, i, stop);
    if (!information.undersampled) continue;
    diagnostics.push_back(
        {DiagnosticCode::kUndersampled,
         absl::StrFormat("the samples miss what %s changes: as many samples between them would "
                         "know it %.0f times better than the prior (in variance); sample at other "
                         "times, or more often",
                         parameter.name, information.between)});
  }
  AddAliasing(findings, estimate, stop, diagnostics);
}

}  // namespace polyest::internal
