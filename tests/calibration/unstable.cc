// Tests whether the uncertainty is true where trajectories part from one another: Lorenz's
// equations, which are chaotic, and an inverted pendulum that feedback holds up, both driven at
// random. No trajectory from the initial state follows such a record, filters do. Each campaign
// simulates a record and estimates three parameters from it. Beside polyest stands, on the same
// records, a cubature Kalman filter of states and parameters together (augmented_filter.h). Both
// are told the density of the process noise, and both take the states' distribution for a normal
// one. That is not true between the lobes of Lorenz's attractor, where intervals hold the truth a
// little too seldom.
//
//   unstable [CAMPAIGNS]
//
// CAMPAIGNS is 30 by default. Prints a table and exits with 1 if polyest's intervals hold the truth
// less often than the other filter's by more than three standard errors of a fraction of 95 %.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "core/common/check.h"
#include "polyest/equation_model.h"
#include "polyest/estimator.h"
#include "tests/calibration/augmented_filter.h"

namespace polyest::internal::calibration {
namespace {

constexpr int kRows = 1000, kUnknowns = 3;
constexpr int kStepsPerRow = 10;

// An unknown that is lognormal: its logarithm has this mean and standard deviation.
struct Unknown {
  const char* name;
  double truth, median, spread;
};

// The first row, at t = 0, has no sample. The input at a row is held until the next one.
struct Record {
  std::vector<double> z, input;  // by row
};

struct Rig {
  const char* name;
  EquationSpecification equations;
  std::array<Unknown, kUnknowns> unknowns;
  Eigen::VectorXd initial;
  Eigen::VectorXd spectral_densities;
  double step_s, sigma;
  // The derivatives of the states for these parameters and this input.
  std::function<Eigen::VectorXd(const Eigen::VectorXd& x, const double* theta, double input)> rates;
  // The input that is chosen after a row was measured; empty: there is none.
  std::function<double(int row, double z, double z_before)> control;
};

Rig Lorenz() {
  return {.name = "Lorenz",
          .equations = {.states = {{"x", "s*(y - x)"}, {"y", "x*(r - z) - y"}, {"z", "x*y - b*z"}},
                        .outputs = {{"x", "x"}},
                        .parameters = {{"x_0", 1}, {"y_0", 1}, {"z_0", 25}}},
          .unknowns = {{{"s", 10, 9, 0.15}, {"r", 28, 27, 0.1}, {"b", 8.0 / 3, 2.8, 0.15}}},
          .initial = Eigen::Vector3d(1, 1, 25),
          .spectral_densities = Eigen::Vector3d::Constant(0.1),
          .step_s = 0.05,
          .sigma = 1,
          .rates =
              [](const Eigen::VectorXd& x, const double* theta, double) {
                return Eigen::VectorXd(Eigen::Vector3d(theta[0] * (x[1] - x[0]),
                                                       x[0] * (theta[1] - x[2]) - x[1],
                                                       x[0] * x[1] - theta[2] * x[2]));
              },
          .control = {}};
}

Rig InvertedPendulum() {
  return {.name = "inverted pendulum",
          .equations = {.states = {{"angle", "omega"}, {"omega", "g*sin(angle) - c*omega + e*u"}},
                        .outputs = {{"angle", "angle"}},
                        .parameters = {{"angle_0", 0.05}},
                        .inputs = {"u"}},
          .unknowns = {{{"g", 20, 18, 0.15}, {"c", 0.2, 0.25, 0.4}, {"e", 2, 2.2, 0.15}}},
          .initial = Eigen::Vector2d(0.05, 0),
          .spectral_densities = Eigen::Vector2d(0, 0.05 * 0.05),
          .step_s = 0.02,
          .sigma = 0.003,
          .rates =
              [](const Eigen::VectorXd& x, const double* theta, double input) {
                return Eigen::VectorXd(Eigen::Vector2d(
                    x[1], theta[0] * std::sin(x[0]) - theta[1] * x[1] + theta[2] * input));
              },
          .control =
              [](int row, double z, double z_before) {
                const double t = 0.02 * row;
                return -25 * z - 3 * (z - z_before) / 0.02 + 2 * std::sin(3 * t) +
                       2 * std::copysign(1.0, std::sin(1.1 * t));
              }};
}

// One step of the classical Runge–Kutta method with a constant input.
Eigen::VectorXd Stepped(const Rig& rig, const Eigen::VectorXd& x, const double* theta, double input,
                        double h) {
  const Eigen::VectorXd a = rig.rates(x, theta, input), b = rig.rates(x + h / 2 * a, theta, input),
                        c = rig.rates(x + h / 2 * b, theta, input),
                        d = rig.rates(x + h * c, theta, input);
  return x + h / 6 * (a + 2 * b + 2 * c + d);
}

// Simulates in tenths of the sampling interval, between which the noise's impulses fall. The input
// is held between rows.
Record Simulate(const Rig& rig, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double theta[] = {rig.unknowns[0].truth, rig.unknowns[1].truth, rig.unknowns[2].truth};
  const double h = rig.step_s / kStepsPerRow;
  Record record{{0}, {0}};
  Eigen::VectorXd x = rig.initial;
  double before = x[0];
  for (int row = 1; row <= kRows; ++row) {
    for (int step = 0; step < kStepsPerRow; ++step) {
      x = Stepped(rig, x, theta, record.input.back(), h);
      for (Eigen::Index i = 0; i < x.size(); ++i) {
        x[i] += std::sqrt(rig.spectral_densities[i] * h) * normal(random);
      }
    }
    const double z = x[0] + rig.sigma * normal(random);
    record.z.push_back(z);
    record.input.push_back(rig.control ? rig.control(row, z, before) : 0);
    before = z;
  }
  return record;
}

Problem ProblemOf(const Rig& rig) {
  Problem problem;
  problem.model = MakeEquationModel(rig.equations).value();
  for (const Unknown& unknown : rig.unknowns) {
    const double variance = unknown.spread * unknown.spread;
    const double mean = unknown.median * std::exp(variance / 2);
    problem.uncertain.push_back(
        UncertainParameter::Lognormal(unknown.name, mean, mean * std::sqrt(std::expm1(variance)))
            .value());
  }
  Eigen::Index state = 0;
  for (const auto& [name, rate] : rig.equations.states) {
    const double q = rig.spectral_densities[state++];
    if (q > 0) problem.process_noise.push_back({.state = name, .spectral_density = q});
  }
  if (rig.control) problem.inputs = {{"u", StreamedInput{Interpolation::kHold}}};
  problem.measured = {{rig.equations.outputs.begin()->first, {.absolute = rig.sigma}}};
  return problem;
}

Samples SamplesOf(const Rig& rig, const Record& record) {
  Samples samples;
  std::vector<bool> missing(record.z.size(), false);
  missing[0] = true;
  samples.columns = {{rig.equations.outputs.begin()->first, record.z, missing}};
  if (rig.control) samples.columns.push_back({"u", record.input, {}});
  for (int row = 0; row <= kRows; ++row) samples.time_s.push_back(row * rig.step_s);
  samples.end_of_run = true;
  return samples;
}

// How a method estimates one unknown over the campaigns.
struct Errors {
  int inside = 0;
  std::vector<double> ratios, relative;

  void Add(double truth, double mean, double deviation, double lower, double upper) {
    inside += lower <= truth && truth <= upper ? 1 : 0;
    ratios.push_back(std::abs(mean - truth) / deviation);
    relative.push_back(std::abs(mean / truth - 1));
  }
  double Coverage() const { return inside / static_cast<double>(ratios.size()); }
};

double Median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + std::ssize(values) / 2);
  return values[values.size() / 2];
}

struct Table {
  std::array<Errors, kUnknowns> polyest, filter;
  double polyest_s = 0, filter_s = 0;
  int64_t trajectories = 0;
};

template <class Act>
double SecondsOf(const Act& act) {
  const auto begin = std::chrono::steady_clock::now();
  act();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void AddPolyest(const Rig& rig, const Record& record, Table& table) {
  const auto estimator = Estimator::Make(ProblemOf(rig)).value();
  POLYEST_CHECK(estimator->Append(SamplesOf(rig, record)).ok());
  Estimate estimate;
  table.polyest_s += SecondsOf([&] {
    POLYEST_CHECK(estimator->Process().ok());
    estimate = estimator->CurrentEstimate().value();
  });
  table.trajectories += estimate.expansion.trajectories;
  for (size_t i = 0; i < kUnknowns; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[i];
    table.polyest[i].Add(rig.unknowns[i].truth, parameter.mean, parameter.std_dev,
                         parameter.lower95, parameter.upper95);
  }
}

// The unknowns are states of the filter, by their logarithms' normal scores.
void AddFilter(const Rig& rig, const Record& record, Table& table) {
  const Eigen::Index n = rig.initial.size();
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(n + kUnknowns), q = mean;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(n + kUnknowns, n + kUnknowns);
  mean.head(n) = rig.initial;
  q.head(n) = rig.spectral_densities;
  covariance.diagonal().head(n).setConstant(1e-12);
  const auto value = [&](double score, size_t i) {
    return rig.unknowns[i].median * std::exp(rig.unknowns[i].spread * score);
  };
  double input = 0;
  AugmentedFilter filter(
      [&](double, const Eigen::VectorXd& x) {
        const double theta[] = {value(x[n], 0), value(x[n + 1], 1), value(x[n + 2], 2)};
        Eigen::VectorXd rates = Eigen::VectorXd::Zero(n + kUnknowns);
        rates.head(n) = rig.rates(x.head(n), theta, input);
        return rates;
      },
      mean, covariance, q);
  table.filter_s += SecondsOf([&] {
    for (size_t row = 1; row < record.z.size(); ++row) {
      input = record.input[row - 1];
      filter.Take(static_cast<double>(row) * rig.step_s, record.z[row], rig.sigma);
    }
  });
  for (size_t i = 0; i < kUnknowns; ++i) {
    const double score = filter.mean(n + static_cast<Eigen::Index>(i)),
                 deviation = filter.deviation(n + static_cast<Eigen::Index>(i));
    table.filter[i].Add(rig.unknowns[i].truth, value(score, i),
                        value(score, i) * rig.unknowns[i].spread * deviation,
                        value(score - 1.96 * deviation, i), value(score + 1.96 * deviation, i));
  }
}

void Print(const char* rig, const char* unknown, const char* method, const Errors& errors) {
  std::printf("| %-17s | %-7s | %-13s | %5.1f %% | %4.2f | %6.3f %% |\n", rig, unknown, method,
              100 * errors.Coverage(), Median(errors.ratios), 100 * Median(errors.relative));
}

// Returns whether polyest's intervals hold the truth as often as the other filter's.
bool Run(const Rig& rig, int campaigns) {
  Table table;
  for (int i = 0; i < campaigns; ++i) {
    const Record record = Simulate(rig, static_cast<uint64_t>(i) + 1);
    AddPolyest(rig, record, table);
    AddFilter(rig, record, table);
  }
  bool holds = true;
  const double slack = 3 * std::sqrt(0.95 * 0.05 / campaigns);
  for (size_t i = 0; i < kUnknowns; ++i) {
    Print(rig.name, rig.unknowns[i].name, "polyest", table.polyest[i]);
    Print("", "", "augmented CKF", table.filter[i]);
    holds = holds && table.polyest[i].Coverage() >= table.filter[i].Coverage() - slack;
  }
  std::printf("|   a campaign: polyest %.2f s, %lld trajectories; augmented CKF %.3f s |\n",
              table.polyest_s / campaigns, static_cast<long long>(table.trajectories / campaigns),
              table.filter_s / campaigns);
  std::fflush(stdout);
  return holds;
}

int RunAll(int campaigns) {
  std::printf(
      "| rig | unknown | method | 95 %% holds | |error|/sd, median | |error|, median |\n"
      "|---|---|---|---|---|---|\n");
  const bool lorenz = Run(Lorenz(), campaigns), pendulum = Run(InvertedPendulum(), campaigns);
  if (!lorenz || !pendulum)
    std::printf("Intervals of polyest hold the truth less often than the other filter's.\n");
  return lorenz && pendulum ? 0 : 1;
}

}  // namespace
}  // namespace polyest::internal::calibration

int main(int argc, char** argv) {
  const int campaigns = argc > 1 ? std::atoi(argv[1]) : 30;
  if (argc > 2 || campaigns < 1) {
    std::fprintf(stderr, "usage: unstable [CAMPAIGNS]\n");
    return 2;
  }
  return polyest::internal::calibration::RunAll(campaigns);
}
