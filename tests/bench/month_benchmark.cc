// Measures memory and the time of estimates as a record grows over thirty days. A rig repeats a
// test every minute, with one sample per second or as many as the argument says. The store keeps no
// rows but computes them again when they are read, so that only the estimator is measured.
//
//   month_benchmark [SAMPLES A SECOND]

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <vector>

#include "core/common/check.h"
#include "polyest/catalogue.h"
#include "polyest/estimator.h"

namespace polyest::internal {
namespace {

// N/m and N s/m, for a mass of 1 kg that starts at 1 m, at rest.
constexpr double kStiffness = 41.3, kDamping = 0.23;
constexpr double kNoise = 0.01;  // m
constexpr int kRunSeconds = 60, kRunsADay = 24 * 60;

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Returns a number uniform in (0, 1) that depends on the index alone.
double Uniform(uint64_t index) {
  index += 0x9e3779b97f4a7c15;
  index = (index ^ (index >> 30)) * 0xbf58476d1ce4e5b9;
  index = (index ^ (index >> 27)) * 0x94d049bb133111eb;
  return (static_cast<double>((index ^ (index >> 31)) >> 11) + 0.5) * 0x1p-53;
}

// Returns a standard normal number by the method of Box and Muller.
double Normal(int64_t row) {
  const auto index = static_cast<uint64_t>(2 * row);
  return std::sqrt(-2 * std::log(Uniform(index))) *
         std::cos(2 * std::numbers::pi * Uniform(index + 1));
}

// Returns x(t) of m x'' + c x' + k x = 0.
double Displacement(double time_s) {
  const double decay = 0.5 * kDamping, frequency = std::sqrt(kStiffness - decay * decay);
  return std::exp(-decay * time_s) *
         (std::cos(frequency * time_s) + decay / frequency * std::sin(frequency * time_s));
}

class Rig final : public SampleStore {
 public:
  explicit Rig(int rate_hz) : rate_hz_(rate_hz) {}

  int64_t rows() const override { return rows_; }
  int64_t rows_a_day() const { return int64_t{kRunsADay} * kRunSeconds * rate_hz_; }

  absl::Status Append(const RowBlock& block) override {
    rows_ += std::ssize(block.rows);
    return absl::OkStatus();
  }
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override {
    block.rows.clear();
    block.values.clear();
    block.noise.clear();
    block.run_ended = false;
    for (int64_t row = first; row < first + count; ++row) {
      block.rows.push_back({Run(row), Time(row)});
      block.values.push_back(Sample(row));
      block.noise.push_back(kNoise);
    }
    return absl::OkStatus();
  }

  int Run(int64_t row) const { return static_cast<int>(row / (kRunSeconds * rate_hz_)); }
  double Time(int64_t row) const {
    return static_cast<double>(row % (kRunSeconds * rate_hz_)) / rate_hz_;
  }
  double Sample(int64_t row) const { return Displacement(Time(row)) + kNoise * Normal(row); }

 private:
  int rate_hz_;
  int64_t rows_ = 0;
};

Problem Oscillator() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"x0", 1}, {"v0", 0}};
  problem.uncertain = {UncertainParameter::Uniform("k", 30, 50).value(),
                       UncertainParameter::Uniform("c", 0.1, 0.4).value()};
  problem.measured = {{"x", {.absolute = kNoise}}};
  return problem;
}

double ResidentMegabytes() {
  std::ifstream file("/proc/self/statm");
  double size = 0, resident = 0;
  file >> size >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

double EstimateMilliseconds(const Estimator& estimator, Estimate& estimate) {
  std::vector<double> times;
  for (int i = 0; i < 5; ++i) {
    const Clock::time_point start = Clock::now();
    estimate = estimator.CurrentEstimate().value();
    times.push_back(1e3 * SecondsSince(start));
  }
  std::ranges::sort(times);
  return times[2];
}

// Appends and processes the rows of a day, one run at a time.
void TakeDay(const Rig& rig, Estimator& estimator) {
  const int64_t end = rig.rows() + rig.rows_a_day();
  Samples samples;
  while (rig.rows() < end) {
    samples.time_s.clear();
    samples.run.clear();
    samples.columns = {{"x", {}, {}}};
    const int run = rig.Run(rig.rows());
    for (int64_t row = rig.rows(); rig.Run(row) == run; ++row) {
      samples.time_s.push_back(rig.Time(row));
      samples.run.push_back(run);
      samples.columns[0].value.push_back(rig.Sample(row));
    }
    POLYEST_CHECK(estimator.Append(samples).ok() && estimator.Process().ok());
  }
}

void Run(int rate_hz) {
  const auto rig = std::make_shared<Rig>(rate_hz);
  const auto estimator = Estimator::Make(Oscillator(), {.store = rig, .snapshot = {}}).value();
  std::printf(
      " day        rows  min to take it   MB  ms an estimate          k - truth      c - truth\n");
  double first_megabytes = 0, first_milliseconds = 0, megabytes = 0, milliseconds = 0;
  for (int day = 1; day <= 30; ++day) {
    const Clock::time_point start = Clock::now();
    TakeDay(*rig, *estimator);
    const double minutes = SecondsSince(start) / 60;
    if (day != 1 && day % 5 != 0) continue;
    Estimate estimate;
    milliseconds = EstimateMilliseconds(*estimator, estimate);
    megabytes = ResidentMegabytes();
    if (day == 1) {
      first_milliseconds = milliseconds;
      first_megabytes = megabytes;
    }
    const ParameterEstimate &k = estimate.parameters[0], &c = estimate.parameters[1];
    std::printf("%4d  %10lld  %14.2f  %4.0f  %14.1f  %8.1e (sd %.1e)  %8.1e (sd %.1e)\n", day,
                static_cast<long long>(rig->rows()), minutes, megabytes, milliseconds,
                k.map - kStiffness, k.std_dev, c.map - kDamping, c.std_dev);
    std::fflush(stdout);
  }
  std::printf("day 30 against day 1: memory %.2f times, time of an estimate %.2f times\n",
              megabytes / first_megabytes, milliseconds / first_milliseconds);
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  const int rate_hz = argc > 1 ? std::atoi(argv[1]) : 1;
  if (rate_hz < 1 || rate_hz > 1000 || argc > 2) {
    std::fprintf(stderr, "usage: month_benchmark [SAMPLES A SECOND, 1 to 1000]\n");
    return EXIT_FAILURE;
  }
  polyest::internal::Run(rate_hz);
  return EXIT_SUCCESS;
}
