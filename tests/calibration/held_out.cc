// Asks measured records whether predictions of what was not seen yet are true: an estimate from the
// first half of a record predicts the second half, in windows within which no sample is used.
// Beside it stands the same model without process noise, its noise of unknown size, which predicts
// from the initial state alone. Which of the two to use so many samples ahead is decided within the
// first half, as `polyest compare --horizon` does it: by the score of its last 30 %.
//
//   held_out [RECORD]...    all records, unless some are named
//
// Prints how many of the samples held out 95 % intervals of new samples hold, how wide those are,
// and which model is chosen. Exits with 1 if they hold fewer than 88 %: the errors of a window have
// much in common, so that a fraction of 95 % is not known any better. More is no fault: process
// noise that stands for a model that is a little wrong grows with the square root of time, what is
// wrong does not. Exits with 77 if the records are not there (tests/testing/records.h).

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/common/check.h"
#include "polyest/catalogue.h"
#include "polyest/equation_model.h"
#include "polyest/estimator.h"
#include "tests/testing/records.h"
#include "tests/testing/two_gliders.h"

namespace polyest::internal::calibration {
namespace {

constexpr int kWindows[] = {5, 50, 500};  // samples
constexpr int kSkipped = 77;
constexpr double kLowest = 0.88;
constexpr double kHoldOut = 0.3;

struct Record {
  std::string name;  // the file's, without .csv
  std::vector<std::string> columns;
  Problem problem;  // with process noise
};

void AddUniform(Problem& problem, const char* name, double lower, double upper) {
  problem.uncertain.push_back(UncertainParameter::Uniform(name, lower, upper).value());
}

ProcessNoise Unknown(const char* state, double lower, double upper) {
  return {.state = state, .unknown = true, .lower = lower, .upper = upper};
}

// Dahl's friction. The magnitude of the velocity is smooth, as filters need it, on the scale of
// 1 cm/s.
Problem Damper() {
  Problem problem;
  problem.model = MakeEquationModel({.states = {{"w", "rho*(v - sqrt(v^2 + 1e-4)*w)"}},
                                     .outputs = {{"F", "Kx*v + Kw*w + F0"}},
                                     .inputs = {"v"}})
                      .value();
  AddUniform(problem, "Kx", 0, 5);
  AddUniform(problem, "Kw", 0, 500);
  AddUniform(problem, "rho", 0.01, 50);
  AddUniform(problem, "F0", -100, 100);
  AddUniform(problem, "w_0", -1, 1);
  problem.inputs = {{"v", StreamedInput{}}};
  problem.measured = {{"F", {}}};
  problem.process_noise = {Unknown("w", 1e-3, 100)};
  return problem;
}

Problem Pendulum() {
  Problem problem;
  problem.model = *FindBuiltinModel("pendulum");
  AddUniform(problem, "g_over_l", 1.1, 1.6);
  AddUniform(problem, "c", 0, 0.05);
  AddUniform(problem, "c2", 0, 0.05);
  AddUniform(problem, "theta0", 0.9, 1.4);
  AddUniform(problem, "omega0", 0, 2);
  AddUniform(problem, "theta.offset", -0.1, 0.1);
  problem.measured = {{"theta", {}}};
  problem.process_noise = {Unknown("omega", 1e-8, 1e-2)};
  return problem;
}

Problem Gliders() {
  Problem problem = testing::TwoGlidersProblem(2);
  problem.process_noise = {Unknown("v1", 1e-2, 1e4), Unknown("v2", 1e-2, 1e4)};
  return problem;
}

// Returns what a sensor's noise is at most: the root mean square of third differences, of which a
// smooth signal leaves little, ÷ √(1 + 9 + 9 + 1).
double SensorNoise(const std::vector<double>& z) {
  double squares = 0;
  for (size_t i = 3; i < z.size(); ++i) {
    const double difference = z[i] - 3 * z[i - 1] + 3 * z[i - 2] - z[i - 3];
    squares += difference * difference;
  }
  return std::sqrt(squares / (20 * static_cast<double>(z.size() - 3)));
}

std::unique_ptr<Estimator> EstimatorOf(const Problem& problem, const Samples& samples) {
  EstimatorOptions options;
  options.threads = 2;
  auto estimator = Estimator::Make(problem, options).value();
  POLYEST_CHECK(estimator->Append(samples).ok());
  POLYEST_CHECK(estimator->Process().ok());
  return estimator;
}

// The predictions of the rows that were held out.
struct HeldOut {
  double coverage = 0;
  double half_width = 0;  // of the 95 % interval, the median, ÷ the samples' standard deviation
};

HeldOut Judge(const PredictedOutput& output, Eigen::Index first) {
  std::vector<double> widths;
  double covered = 0, sum = 0, squares = 0;
  for (Eigen::Index row = first; row < output.measured.size(); ++row) {
    const double z = output.measured[row], lower = output.sample_quantiles(row, 0),
                 upper = output.sample_quantiles(row, 2);
    covered += lower <= z && z <= upper ? 1 : 0;
    widths.push_back((upper - lower) / 2);
    sum += z;
    squares += z * z;
  }
  const auto n = static_cast<double>(widths.size());
  std::ranges::nth_element(widths, widths.begin() + std::ssize(widths) / 2);
  return {covered / n, widths[widths.size() / 2] / std::sqrt(squares / n - (sum / n) * (sum / n))};
}

// Predicts in windows of so many samples; 0: no filter.
Prediction PredictionOf(const Estimator& estimator, const Samples& record, int window,
                        int64_t first_scored_row) {
  PredictionOptions options;
  options.record = record;
  options.draws = 200;
  options.max_rows = std::ssize(record.time_s);
  const double step_s =
      (record.time_s.back() - record.time_s.front()) / static_cast<double>(record.rows() - 1);
  options.horizon_s = window * step_s;
  options.first_scored_row = first_scored_row;
  return estimator.CurrentPrediction(options).value();
}

double LogScore(const Estimator& estimator, const Samples& record, int window, int64_t first) {
  double sum = 0;
  for (const PredictedOutput& output : PredictionOf(estimator, record, window, first).outputs) {
    sum += static_cast<double>(output.score.samples) * output.score.log_score;
  }
  return sum;
}

// Returns the prediction of each output in windows of so many samples; 0: no filter.
std::vector<HeldOut> Predict(const Estimator& estimator, const Samples& record, int window) {
  const Prediction prediction = PredictionOf(estimator, record, window, 0);
  std::vector<HeldOut> held_out;
  for (const PredictedOutput& output : prediction.outputs) {
    held_out.push_back(Judge(output, std::ssize(record.time_s) / 2));
  }
  return held_out;
}

void Print(const Record& record, size_t output, int window, const HeldOut& filters,
           const HeldOut& perfect, bool filters_chosen) {
  std::printf(
      "| %-15s | %-5s | %3d | %5.1f %%, %5.3f | %5.1f %%, %5.3f | %s |\n", record.name.c_str(),
      record.columns[record.columns.size() - record.problem.measured.size() + output].c_str(),
      window, 100 * filters.coverage, filters.half_width, 100 * perfect.coverage,
      perfect.half_width, filters_chosen ? "filters" : "perfect model");
  std::fflush(stdout);
}

// Returns whether the record's second half is predicted as it should be.
bool Run(Record record, Samples samples) {
  samples.end_of_run = true;
  Samples first_half = testing::Rows(samples, 0, samples.rows() / 2);
  first_half.end_of_run = true;
  for (MeasuredOutput& measured : record.problem.measured) {
    const auto column = std::ranges::find(first_half.columns, measured.output, &SampleColumn::name);
    measured.noise.absolute = SensorNoise(column->value);
  }
  Problem perfect = record.problem;
  perfect.process_noise.clear();
  for (MeasuredOutput& measured : perfect.measured) measured.noise = {.unknown = true};
  const auto begin = std::chrono::steady_clock::now();
  const auto filtered = EstimatorOf(record.problem, first_half);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
  const auto first = static_cast<int64_t>((1 - kHoldOut) * static_cast<double>(first_half.rows()));
  Samples seen = testing::Rows(first_half, 0, static_cast<size_t>(first));
  seen.end_of_run = true;
  const auto trial = EstimatorOf(record.problem, seen);
  const double score = LogScore(*EstimatorOf(perfect, seen), first_half, 0, first);
  const std::vector<HeldOut> of_perfect = Predict(*EstimatorOf(perfect, first_half), samples, 0);
  bool holds = true;
  for (const int window : kWindows) {
    const bool chosen = LogScore(*trial, first_half, window, first) > score;
    const std::vector<HeldOut> of_filters = Predict(*filtered, samples, window);
    for (size_t i = 0; i < of_filters.size(); ++i) {
      Print(record, i, window, of_filters[i], of_perfect[i], chosen);
      holds = holds && (chosen ? of_filters : of_perfect)[i].coverage >= kLowest;
    }
  }
  std::printf("|   estimate from the first half: %.1f s |\n", spent.count());
  return holds;
}

int RunAll(const std::vector<std::string>& wanted) {
  const std::vector<Record> records = {{"mr_damper_0V", {"v", "F"}, Damper()},
                                       {"mr_damper_4_4", {"v", "F"}, Damper()},
                                       {"pendulum", {"theta"}, Pendulum()},
                                       {"air_track_2mass", {"x1", "x2"}, Gliders()}};
  std::printf(
      "| record | output | samples ahead | filters: 95 %% holds, half width ÷ sd of samples | "
      "perfect model | chosen |\n"
      "|---|---|---|---|---|---|\n");
  bool holds = true;
  for (const Record& record : records) {
    if (!wanted.empty() && std::ranges::find(wanted, record.name) == wanted.end()) continue;
    const auto samples = testing::SharedRecord(record.name + ".csv", record.columns);
    if (!samples) {
      std::printf("../shared/data/%s.csv is not there\n", record.name.c_str());
      return kSkipped;
    }
    holds = Run(record, *samples) && holds;
  }
  if (!holds) std::printf("Intervals hold too few of the samples held out.\n");
  return holds ? 0 : 1;
}

}  // namespace
}  // namespace polyest::internal::calibration

int main(int argc, char** argv) {
  return polyest::internal::calibration::RunAll({argv + 1, argv + argc});
}
