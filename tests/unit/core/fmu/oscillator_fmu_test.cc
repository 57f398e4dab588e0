// Compares the oscillator as an FMU of either version and kind with the built-in one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "core/fmu/worker_ensemble.h"
#include "tests/unit/core/fmu/fmu_ensemble.h"

namespace polyest::internal {
namespace {

constexpr int kBlock = WorkerEnsemble::kPointsOfBlock;
constexpr int kPoints = 4 * kBlock + 6;  // five blocks, the last not full

FmuEnsemble Oscillators(std::shared_ptr<const Model> model, int points = kPoints) {
  FmuEnsemble ensemble(std::move(model), points, {"x", "v", "a"});
  for (int point = 0; point < points; ++point) {
    const double part = point / static_cast<double>(points);
    ensemble.Set("m", point, 0.8 + 0.4 * part);
    ensemble.Set("k", point, 30 + 20 * std::fmod(7 * part, 1));
    ensemble.Set("c", point, 0.1 + 0.3 * std::fmod(3 * part, 1));
    ensemble.Set("x0", point, 1 - part);
    ensemble.Set("v0", point, part);
  }
  return ensemble;
}

// With `uses_time`, no step is longer than the interval between two samples.
FmuEnsemble BuiltIn(int points = kPoints, bool uses_time = true) {
  FmuEnsemble ensemble = Oscillators(
      std::make_shared<UnknownEquations>(*FindBuiltinModel("mass_spring_damper"), uses_time),
      points);
  ensemble.specification.integration.method = IntegrationMethod::kExplicit;
  return ensemble;
}
FmuEnsemble Fmu(const char* name, int points = kPoints) {
  return Oscillators(*TestFmus().Find(name), points);
}

// Propagates the built-in model in blocks of the size that FMUs are propagated in: the points of a
// block have common steps.
Matrix PropagateInBlocks(const FmuEnsemble& all, const std::vector<double>& times_s) {
  Matrix outputs(all.points(), std::ssize(times_s) * std::ssize(all.specification.outputs));
  for (int first = 0; first < all.points(); first += kBlock) {
    const int count = std::min(kBlock, all.points() - first);
    FmuEnsemble block = all;
    EnsembleSpecification& specification = block.specification;
    specification.parameters = all.specification.parameters.middleRows(first, count);
    specification.amplitudes = all.specification.amplitudes.middleRows(first, count);
    outputs.middleRows(first, count) = block.Propagate(times_s);
  }
  return outputs;
}

struct ExchangeCase {
  const char* fmu;
  bool uses_time;  // whether its derivatives may depend on the time, by its description
};

class ModelExchangeOscillator : public testing::TestWithParam<ExchangeCase> {};

TEST_P(ModelExchangeOscillator, FollowsTheBuiltInToRoundingErrors) {
  FmuEnsemble fmu = Fmu(GetParam().fmu);
  FmuEnsemble built_in = BuiltIn(kPoints, GetParam().uses_time);
  fmu.Drive("force", SinusoidInput{.frequency_hz = 0.7}, 2);
  built_in.Drive("force", SinusoidInput{.frequency_hz = 0.7}, 2);
  const std::vector<double> times_s = TimesUntil(5, 0.05);
  const Matrix difference = fmu.Propagate(times_s) - PropagateInBlocks(built_in, times_s);
  // The same integrator takes the same steps. Rounding errors of 1e-16 grow over some 1000 steps,
  // and accelerations are up to 60.
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 60 * 1e-12);
}

TEST_P(ModelExchangeOscillator, JumpsWithItsInput) {
  FmuEnsemble fmu = Fmu(GetParam().fmu);
  FmuEnsemble built_in = BuiltIn(kPoints, GetParam().uses_time);
  fmu.Drive("force", StepInput{.time_s = 0.33}, 5);
  built_in.Drive("force", StepInput{.time_s = 0.33}, 5);
  const std::vector<double> times_s = TimesUntil(1, 0.1);
  const Matrix difference = fmu.Propagate(times_s) - PropagateInBlocks(built_in, times_s);
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 60 * 1e-12);
}

TEST_P(ModelExchangeOscillator, IsSeenLateThroughDelays) {
  FmuEnsemble fmu = Fmu(GetParam().fmu, kBlock);
  FmuEnsemble built_in = BuiltIn(kBlock, GetParam().uses_time);
  for (FmuEnsemble* ensemble : {&fmu, &built_in}) {
    ensemble->specification.output_delays_s.setZero(kBlock, 3);
    ensemble->specification.output_delays_s.col(0).setLinSpaced(0, 0.1);
    ensemble->specification.output_delays_s.col(2).setConstant(-0.02);
  }
  const std::vector<double> times_s = TimesUntil(2, 0.05);
  const Matrix difference = fmu.Propagate(times_s) - built_in.Propagate(times_s);
  // The same nodes are chosen, up to rounding errors.
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 60 * 1e-11);
}

// Where all outputs are continuous states, the FMU is not called for them.
TEST_P(ModelExchangeOscillator, HasTheSameStatesWhateverElseIsRead) {
  FmuEnsemble states = Fmu(GetParam().fmu);
  FmuEnsemble all = Fmu(GetParam().fmu);
  states.specification.outputs = {*states.Description().FindOutput("v"),
                                  *states.Description().FindOutput("x")};
  all.specification.outputs = {states.specification.outputs[0], states.specification.outputs[1],
                               *all.Description().FindOutput("a")};
  const std::vector<double> times_s = TimesUntil(1, 0.1);
  const Matrix of_states = states.Propagate(times_s);
  const Matrix of_all = all.Propagate(times_s);
  for (Eigen::Index k = 0; k < std::ssize(times_s); ++k) {
    EXPECT_EQ(of_states.middleCols(2 * k, 2), of_all.middleCols(3 * k, 2)) << times_s[k];
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, ModelExchangeOscillator,
                         testing::Values(ExchangeCase{"oscillator_me2", true},
                                         ExchangeCase{"oscillator_me3", false}));

class CoSimulationOscillator : public testing::TestWithParam<const char*> {};

TEST_P(CoSimulationOscillator, FollowsTheBuiltInToTheErrorOfItsOwnSteps) {
  FmuEnsemble fmu = Fmu(GetParam());
  FmuEnsemble built_in = BuiltIn();
  built_in.specification.integration.relative_tolerance = 1e-11;
  const std::vector<double> times_s = TimesUntil(5, 0.05);
  const Matrix difference = fmu.Propagate(times_s) - built_in.Propagate(times_s);
  // Classical Runge–Kutta on x' = iωx has the relative error ω^5 h^4 t/120 by the time t. Here ω ≤
  // √(50/0.8) = 7.9 rad/s, h = 1 ms and t = 5 s. The amplitude of x is at most 1.1, that of v is ω
  // times and that of a ω² times as large. The damping at most doubles the error.
  const double omega = std::sqrt(50 / 0.8);
  const double error = 2 * 1.1 * std::pow(omega, 5) * 1e-12 * 5 / 120;
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), omega * omega * error);
  EXPECT_GT(difference.cwiseAbs().maxCoeff(), 0);
}

INSTANTIATE_TEST_SUITE_P(Versions, CoSimulationOscillator,
                         testing::Values("oscillator_cs2", "oscillator_cs3"));

TEST(FmuEnsemble, DoesNotDependOnTheNumberOfWorkers) {
  for (const char* name : {"oscillator_me2", "oscillator_cs3"}) {
    FmuEnsemble one = Fmu(name);
    FmuEnsemble two = Fmu(name);
    two.specification.threads = 2;
    const std::vector<double> times_s = TimesUntil(1, 0.1);
    EXPECT_EQ(one.Propagate(times_s), two.Propagate(times_s)) << name;
  }
}

// Returns the number of processes that this one has started and that have not ended.
int Children() {
  int children = 0;
  for (const auto& process : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(process.path() / "status");
    for (std::string line; std::getline(file, line);) {
      if (line == "PPid:\t" + std::to_string(getpid())) ++children;
    }
  }
  return children;
}

TEST(FmuEnsemble, SharesTrajectoriesOnTheirOwnAmongWorkers) {
  FmuEnsemble ensemble("oscillator_cs2", 3, {"x"});
  ensemble.specification.threads = 2;
  const int before = Children();
  EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
  Matrix outputs(3, 1);
  ASSERT_TRUE(propagator.Advance(std::vector{0.1}, outputs, Stop()).ok());
  EXPECT_EQ(Children(), before + 2);
}

TEST(FmuEnsemble, DoesNotDependOnHowTheTimesAreCut) {
  for (const char* name : {"oscillator_me2", "oscillator_cs2"}) {
    FmuEnsemble ensemble = Fmu(name);
    ensemble.Drive("force", SinusoidInput{.frequency_hz = 0.7}, 2);
    const std::vector<double> times_s = TimesUntil(1, 0.1);
    const Matrix whole = ensemble.Propagate(times_s);
    EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
    Matrix cut(whole.rows(), whole.cols());
    for (size_t k = 0; k < times_s.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(3 * k);
      ASSERT_TRUE(
          propagator.Advance(std::span(&times_s[k], 1), cut.middleCols(column, 3), Stop()).ok());
    }
    EXPECT_EQ(whole, cut) << name;
  }
}

}  // namespace
}  // namespace polyest::internal
