// Measures how much faster than real time one core follows a rig: a quarter car on a measured road,
// ten channels a thousand times per second, four unknowns; batches of a tenth of a second and an
// estimate every second.
//
//   quarter_car_benchmark [SECONDS]

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "core/common/check.h"
#include "polyest/equation_model.h"
#include "polyest/estimator.h"

namespace polyest::internal {
namespace {

using Clock = std::chrono::steady_clock;
using State = std::array<double, 4>;  // zs, zu, vs, vu

constexpr double kSprungMass = 300, kUnsprungMass = 55;                   // kg
constexpr double kStiffness = 18'000, kDamping = 1'200, kTyre = 200'000;  // N/m, N s/m, N/m
constexpr int kBatchRows = 100, kBatchesASecond = 10;
constexpr double kStepS = 1e-3;

struct Channel {
  const char* name;
  const char* expression;
  double noise;
};
constexpr std::array<Channel, 10> kChannels = {{{"zs", "zs", 2e-4},
                                                {"zu", "zu", 2e-4},
                                                {"vs", "vs", 5e-3},
                                                {"vu", "vu", 1e-2},
                                                {"travel", "zs - zu", 2e-4},
                                                {"travel_rate", "vs - vu", 1e-2},
                                                {"zs_accel", "-F/ms", 0.1},
                                                {"zu_accel", "(F + Ft)/mu", 1},
                                                {"suspension_force", "F", 10},
                                                {"tyre_force", "Ft", 30}}};

Problem QuarterCar() {
  EquationSpecification equations{
      .states = {{"zs", "vs"}, {"zu", "vu"}, {"vs", "-F/ms"}, {"vu", "(F + Ft)/mu"}},
      .intermediates = {{"F", "ks*(zs - zu) + cs*(vs - vu)"}, {"Ft", "kt*(road - zu)"}},
      .parameters =
          {{"ms", 290}, {"mu", kUnsprungMass}, {"ks", 16'800}, {"cs", 1000}, {"kt", 190'000}},
      .inputs = {"road"}};
  Problem problem;
  for (const Channel& channel : kChannels) {
    equations.outputs[channel.name] = channel.expression;
    problem.measured.push_back({channel.name, {.absolute = channel.noise}});
  }
  problem.model = MakeEquationModel(equations).value();
  problem.inputs = {{"road", StreamedInput()}};
  problem.uncertain = {UncertainParameter::Uniform("ms", 250, 350).value(),
                       UncertainParameter::Uniform("ks", 14'000, 22'000).value(),
                       UncertainParameter::Uniform("cs", 800, 1'600).value(),
                       UncertainParameter::Uniform("kt", 160'000, 240'000).value()};
  return problem;
}

// The quarter car by the classical Runge–Kutta method.
class Rig {
 public:
  Samples Next() {
    Samples samples;
    samples.columns.push_back({"road", {}, {}});
    for (const Channel& channel : kChannels) samples.columns.push_back({channel.name, {}, {}});
    for (int row = 0; row < kBatchRows; ++row) {
      const double t = kStepS * static_cast<double>(rows_);
      samples.time_s.push_back(t);
      samples.columns[0].value.push_back(Road(t));
      const State rates = Rates(t, state_);
      const double tyre = kTyre * (Road(t) - state_[1]);
      const std::array<double, 10> values = {state_[0],
                                             state_[1],
                                             state_[2],
                                             state_[3],
                                             state_[0] - state_[1],
                                             state_[2] - state_[3],
                                             rates[2],
                                             rates[3],
                                             -kSprungMass * rates[2],
                                             tyre};
      for (size_t c = 0; c < values.size(); ++c) {
        samples.columns[c + 1].value.push_back(values[c] + kChannels[c].noise * normal_(random_));
      }
      Step(t);
    }
    return samples;
  }

 private:
  // Twelve sines from 0.3 to 26 Hz.
  static double Road(double t) {
    double height = 0, omega = 2;
    for (int i = 0; i < 12; ++i, omega *= 1.5) {
      height += 0.01 / (1 + i) * (std::sin(omega * t + 1.7 * i) - std::sin(1.7 * i));
    }
    return height;
  }
  static State Rates(double t, const State& x) {
    const double force = kStiffness * (x[0] - x[1]) + kDamping * (x[2] - x[3]);
    return {x[2], x[3], -force / kSprungMass, (force + kTyre * (Road(t) - x[1])) / kUnsprungMass};
  }
  static State Moved(const State& x, const State& rates, double by) {
    State moved = x;
    for (size_t i = 0; i < x.size(); ++i) moved[i] += by * rates[i];
    return moved;
  }
  void Step(double t) {
    const double h = kStepS;
    const State a = Rates(t, state_), b = Rates(t + h / 2, Moved(state_, a, h / 2));
    const State c = Rates(t + h / 2, Moved(state_, b, h / 2));
    const State d = Rates(t + h, Moved(state_, c, h));
    for (size_t i = 0; i < state_.size(); ++i) {
      state_[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
    }
    ++rows_;
  }

  State state_ = {};
  int64_t rows_ = 0;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
};

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void Run(int seconds) {
  Rig rig;
  const auto estimator = Estimator::Make(QuarterCar()).value();
  double rows_s = 0, estimates_s = 0, longest_s = 0;
  Estimate estimate;
  for (int second = 0; second < seconds; ++second) {
    for (int batch = 0; batch < kBatchesASecond; ++batch) {
      const Samples samples = rig.Next();
      const Clock::time_point start = Clock::now();
      POLYEST_CHECK(estimator->Append(samples).ok() && estimator->Process().ok());
      const double batch_s = SecondsSince(start);
      longest_s = std::max(longest_s, batch_s);
      rows_s += batch_s;
    }
    const Clock::time_point start = Clock::now();
    estimate = estimator->CurrentEstimate().value();
    estimates_s += SecondsSince(start);
  }
  std::printf(
      "%d s of 10 channels at 1 kHz: %.0f times real time, with an estimate a second %.0f times; "
      "the longest batch took %.0f ms, an estimate %.0f ms\n",
      seconds, seconds / rows_s, seconds / (rows_s + estimates_s), 1e3 * longest_s,
      1e3 * estimates_s / seconds);
  constexpr std::array<double, 4> kTruth = {kSprungMass, kStiffness, kDamping, kTyre};
  for (size_t i = 0; i < kTruth.size(); ++i) {
    const ParameterEstimate& parameter = estimate.parameters[i];
    std::printf("%s %.7g, sd %.2g, truth %.7g\n", parameter.name.c_str(), parameter.mean,
                parameter.posterior_std_dev, kTruth[i]);
  }
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  const int seconds = argc > 1 ? std::atoi(argv[1]) : 60;
  if (seconds < 2 || argc > 2) {
    std::fprintf(stderr, "usage: quarter_car_benchmark [SECONDS, 2 or more]\n");
    return EXIT_FAILURE;
  }
  polyest::internal::Run(seconds);
  return EXIT_SUCCESS;
}
