// Tests whether the uncertainty is true where the model is not perfect: an oscillator that a random
// force drives, and one whose stiffness drifts. Each campaign draws truths, simulates a record and
// estimates from it; over many campaigns 95 % intervals must hold the truth 95 times in 100. Beside
// polyest stand an estimate that takes the model for perfect and, on the same records, a Kalman
// filter of states and parameters together (augmented_filter.h) that is told the process noise.
//
//   tracking [CAMPAIGNS]
//
// CAMPAIGNS is 100 by default, for each row. Prints a table and exits with 1 if a coverage of
// polyest's is below 95 % by more than three standard errors.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/common/check.h"

#include "polyest/catalogue.h"
#include "polyest/estimator.h"
#include "tests/calibration/augmented_filter.h"

namespace polyest::internal::calibration {
namespace {

constexpr double kDamping = 0.3, kSigma = 0.01, kStepS = 0.05;
constexpr int kRows = 1000, kStepsPerRow = 20;

// How the oscillator departs from the perfect model.
struct Kind {
  const char* name;
  double spectral_density = 0;  // of the force on 1 kg, (m/s)²/s
  double rate = 0;              // of the stiffness' walk, N/m/√s
  double ramp = 0;              // by which the stiffness falls over the record, N/m
  bool drifts = false;          // whether the problem has a drift, else process noise
};

constexpr Kind kKinds[] = {
    {.name = "white noise"},
    {.name = "random force", .spectral_density = 0.02},
    {.name = "constant stiffness", .drifts = true},
    {.name = "stiffness that walks", .rate = 0.2, .drifts = true},
    {.name = "stiffness that falls by 10 %", .ramp = 4, .drifts = true},
};

struct Record {
  double stiffness = 0, damping = 0;  // at the beginning
  std::vector<double> stiffness_at;   // each row
  Samples samples;
};

// The force where the stiffness drifts: without one the oscillation would die away.
double ForceAt(const Kind& kind, double time_s) {
  return kind.drifts ? 2 * std::sin(2 * std::numbers::pi * 0.9 * time_s) : 0;
}

// Simulates by the classical Runge–Kutta method in steps of 2.5 ms, between which the force's
// impulses and the walk's steps fall. Its frequency is right to 1e-9, a sample tells 1e-5 of it.
Record Simulate(const Kind& kind, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Record record{34 + 12 * uniform(random), 0.15 + 0.3 * uniform(random), {}, {}};
  if (kind.drifts) record.damping = kDamping;
  record.samples.columns = {{"x", {}, {}}};
  const double h = kStepS / kStepsPerRow;
  double k = record.stiffness;
  Eigen::Vector2d state(kind.drifts ? 0 : 1, 0);
  const auto rates = [&](double t, const Eigen::Vector2d& x) {
    return Eigen::Vector2d(x[1], ForceAt(kind, t) - k * x[0] - record.damping * x[1]);
  };
  for (int row = 1; row <= kRows; ++row) {
    for (int step = 0; step < kStepsPerRow; ++step) {
      const double t = (row - 1) * kStepS + step * h;
      const Eigen::Vector2d a = rates(t, state), b = rates(t + h / 2, state + h / 2 * a),
                            c = rates(t + h / 2, state + h / 2 * b),
                            d = rates(t + h, state + h * c);
      state += h / 6 * (a + 2 * b + 2 * c + d);
      state[1] += std::sqrt(kind.spectral_density * h) * normal(random);
      k += kind.rate * std::sqrt(h) * normal(random) - kind.ramp * h / (kRows * kStepS);
    }
    record.stiffness_at.push_back(k);
    record.samples.time_s.push_back(row * kStepS);
    record.samples.columns[0].value.push_back(state[0] + kSigma * normal(random));
  }
  return record;
}

Problem PerfectProblem(const Kind& kind) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"x0", kind.drifts ? 0 : 1}, {"v0", 0}};
  problem.uncertain = {UncertainParameter::Uniform("k", 30, 50).value()};
  if (kind.drifts) {
    problem.fixed["c"] = kDamping;
    problem.inputs = {{"force", SinusoidInput{.amplitude = 2, .frequency_hz = 0.9}}};
  } else {
    problem.uncertain.push_back(UncertainParameter::Uniform("c", 0.05, 0.6).value());
  }
  problem.measured = {{"x", {.absolute = kSigma}}};
  return problem;
}

Problem ProblemOf(const Kind& kind) {
  Problem problem = PerfectProblem(kind);
  if (kind.drifts) {
    problem.uncertain[0].drift = RandomWalk{.unknown = true, .lower = 0.002, .upper = 2};
  } else {
    problem.process_noise = {{.state = "v", .unknown = true, .lower = 1e-7, .upper = 1}};
  }
  return problem;
}

// How a quantity is estimated over the campaigns.
class Errors {
 public:
  void Add(double truth, double mean, double deviation, double lower, double upper) {
    ++count_;
    inside_ += lower <= truth && truth <= upper ? 1 : 0;
    squares_ += (mean - truth) * (mean - truth) / (truth * truth);
    ratios_.push_back(std::abs(mean - truth) / deviation);
  }
  void AddNormal(double truth, double mean, double deviation) {
    Add(truth, mean, deviation, mean - 1.96 * deviation, mean + 1.96 * deviation);
  }
  double Coverage() const { return static_cast<double>(inside_) / count_; }

  void Print(const char* kind, const char* what, const char* method) {
    std::ranges::nth_element(ratios_, ratios_.begin() + std::ssize(ratios_) / 2);
    std::printf("| %-28s | %-17s | %-15s | %6.1f %% | %5.2f | %8.3f %% |\n", kind, what, method,
                100 * Coverage(), ratios_[ratios_.size() / 2], 100 * std::sqrt(squares_ / count_));
  }

 private:
  int count_ = 0, inside_ = 0;
  double squares_ = 0;
  std::vector<double> ratios_;
};

struct Seconds {
  double polyest = 0, filter = 0;
};

template <class Act>
void Timed(double& seconds, const Act& act) {
  const auto begin = std::chrono::steady_clock::now();
  act();
  seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

AugmentedFilter FilterOf(const Kind& kind) {
  const Problem problem = PerfectProblem(kind);
  const auto n = 2 + std::ssize(problem.uncertain);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(n), q = mean;
  Eigen::MatrixXd covariance = 1e-12 * Eigen::MatrixXd::Identity(n, n);
  mean[0] = kind.drifts ? 0 : 1;
  mean.tail(n - 2) = (Eigen::VectorXd(2) << 40, 0.325).finished().head(n - 2);
  covariance(2, 2) = 20.0 * 20 / 12;
  if (n > 3) covariance(3, 3) = 0.55 * 0.55 / 12;
  q[1] = kind.spectral_density;
  // A ramp is no walk: the rate is one that follows it.
  q[2] = kind.rate > 0 ? kind.rate * kind.rate : kind.ramp > 0 ? 0.1 * 0.1 : 0;
  const auto dynamics = [&kind, n](double t, const Eigen::VectorXd& x) {
    Eigen::VectorXd rates = Eigen::VectorXd::Zero(n);
    rates[0] = x[1];
    rates[1] = ForceAt(kind, t) - x[2] * x[0] - (n > 3 ? x[3] : kDamping) * x[1];
    return rates;
  };
  return AugmentedFilter(dynamics, mean, covariance, q);
}

struct Table {
  Errors perfect[2], polyest[2], filter[2], smoothed;
  Seconds seconds;
};

void Add(const Record& record, const ParameterEstimate& parameter, Errors& errors) {
  const double truth = parameter.name == "k" ? record.stiffness : record.damping;
  errors.Add(truth, parameter.mean, parameter.std_dev, parameter.lower95, parameter.upper95);
}

void AddPolyest(const Kind& kind, const Record& record, Table& table) {
  const auto estimator = Estimator::Make(ProblemOf(kind)).value();
  POLYEST_CHECK(estimator->Append(record.samples).ok());
  Estimate estimate;
  Timed(table.seconds.polyest, [&] {
    POLYEST_CHECK(estimator->Process().ok());
    estimate = estimator->CurrentEstimate().value();
  });
  if (!kind.drifts) {
    for (size_t i = 0; i < 2; ++i) Add(record, estimate.parameters[i], table.polyest[i]);
    return;
  }
  const FilteredQuantity& now = estimate.filtered.back();
  table.polyest[0].Add(record.stiffness_at.back(), now.mean, now.std_dev, now.lower95, now.upper95);
  PredictionOptions options;
  options.outputs = {"k"};
  options.draws = 100;
  options.smoothed = true;
  for (const int row : {199, 399, 599, 799}) {
    options.times.push_back({0, record.samples.time_s[static_cast<size_t>(row)]});
  }
  const Prediction smoothed = estimator->CurrentPrediction(options).value();
  const PredictedOutput& k = smoothed.outputs[0];
  for (Eigen::Index i = 0; i < 4; ++i) {
    table.smoothed.Add(record.stiffness_at[static_cast<size_t>(200 * i + 199)], k.mean[i],
                       k.std_dev[i], k.quantiles(i, 0), k.quantiles(i, 2));
  }
}

void AddPerfect(const Kind& kind, const Record& record, Table& table) {
  const auto estimator = Estimator::Make(PerfectProblem(kind)).value();
  POLYEST_CHECK(estimator->Append(record.samples).ok());
  POLYEST_CHECK(estimator->Process().ok());
  const Estimate estimate = estimator->CurrentEstimate().value();
  for (size_t i = 0; i < estimate.parameters.size(); ++i) {
    if (!kind.drifts) {
      Add(record, estimate.parameters[i], table.perfect[i]);
    } else {
      const ParameterEstimate& k = estimate.parameters[i];
      table.perfect[i].Add(record.stiffness_at.back(), k.mean, k.std_dev, k.lower95, k.upper95);
    }
  }
}

void AddFilter(const Kind& kind, const Record& record, Table& table) {
  AugmentedFilter filter = FilterOf(kind);
  Timed(table.seconds.filter, [&] {
    for (size_t row = 0; row < record.samples.rows(); ++row) {
      filter.Take(record.samples.time_s[row], record.samples.columns[0].value[row], kSigma);
    }
  });
  table.filter[0].AddNormal(kind.drifts ? record.stiffness_at.back() : record.stiffness,
                            filter.mean(2), filter.deviation(2));
  if (!kind.drifts) table.filter[1].AddNormal(record.damping, filter.mean(3), filter.deviation(3));
}

// Whether the intervals hold the truth often enough: campaigns are independent, times of one not.
bool Holds(const Errors& errors, int campaigns) {
  return errors.Coverage() >= 0.95 - 3 * std::sqrt(0.95 * 0.05 / campaigns);
}

bool RunKind(const Kind& kind, int campaigns) {
  Table table;
  for (int i = 0; i < campaigns; ++i) {
    const Record record = Simulate(kind, static_cast<uint64_t>(i) + 1);
    AddPolyest(kind, record, table);
    AddPerfect(kind, record, table);
    AddFilter(kind, record, table);
  }
  bool holds = true;
  const char* const quantities[2] = {kind.drifts ? "k at the end" : "k", "c"};
  for (int i = 0; i < (kind.drifts ? 1 : 2); ++i) {
    table.polyest[i].Print(kind.name, quantities[i], "polyest");
    table.perfect[i].Print("", "", "perfect model");
    table.filter[i].Print("", "", "augmented CKF");
    holds = Holds(table.polyest[i], campaigns) && holds;
  }
  if (kind.drifts) {
    table.smoothed.Print("", "k in the past", "polyest");
    holds = Holds(table.smoothed, campaigns) && holds;
  }
  std::printf("|   seconds a campaign: polyest %.3f, augmented CKF %.3f |\n",
              table.seconds.polyest / campaigns, table.seconds.filter / campaigns);
  std::fflush(stdout);
  return holds;
}

int Run(int campaigns) {
  std::printf(
      "| what is not perfect          | quantity          | method          | 95 %% holds | "
      "|error|/sd, median | rms error |\n|---|---|---|---|---|---|\n");
  bool holds = true;
  for (const Kind& kind : kKinds) holds = RunKind(kind, campaigns) && holds;
  if (!holds) std::printf("Intervals of polyest hold the truth too seldom.\n");
  return holds ? 0 : 1;
}

}  // namespace
}  // namespace polyest::internal::calibration

int main(int argc, char** argv) {
  const int campaigns = argc > 1 ? std::atoi(argv[1]) : 100;
  if (argc > 2 || campaigns < 1) {
    std::fprintf(stderr, "usage: tracking [CAMPAIGNS]\n");
    return 2;
  }
  return polyest::internal::calibration::Run(campaigns);
}
