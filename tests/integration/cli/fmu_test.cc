// Tests FMUs of a folder, in this process and in a daemon.

#include <gmock/gmock.h>

#include <cmath>
#include <string>

#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class FmuCommandTest : public CommandTest {
 protected:
  // Returns the demonstration's problem with this model and method of integration. The tolerance is
  // tight, since a step over the samples, which only a built-in model allows, errs otherwise, and
  // too tight for control trajectories, which FMUs do not have and which may decide about a move of
  // the expansion.
  std::string Problem(const std::string& model, const std::string& method = "AUTO") const {
    return File("problem.json",
                R"({"model": )" + model + R"(, "integration": {"method": ")" + method +
                    R"(", "relativeTolerance": 1.5e-13}, "fixed": {"m": 1.0, "x0": 1.0},
      "uncertain": [{"name": "k", "uniform": {"lower": 31.584, "upper": 47.376}},
                    {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}}],
      "measured": [{"output": "x", "noise": {"absolute": 0.01}}]})");
  }
  v1::Estimate Estimate(const std::string& model, const std::string& method = "AUTO") {
    const Finished run = Run({"estimate", Problem(model, method), data_, "--format", "json",
                              "--fmu-dir", POLYEST_TEST_FMUS});
    EXPECT_EQ(run.exit_status, 0) << run.err;
    return ParseEstimate(run.out);
  }
  // Returns the largest difference from the estimates of the built-in model, in standard
  // deviations.
  double Difference(const std::string& fmu) {
    const v1::Estimate with_fmu = Estimate(R"({"fmu": ")" + fmu + R"("})");
    double largest = 0;
    for (int i = 0; i < 2; ++i) {
      const auto& parameter = built_in_.parameters(i);
      const double difference = with_fmu.parameters(i).map() - parameter.map();
      largest = std::max(largest, std::abs(difference) / parameter.std_dev());
    }
    return largest;
  }

  const std::string data_ = File("data.csv", DemoRows(100));
  // Integrated as an FMU is: by itself a linear model would be stepped exactly.
  const v1::Estimate built_in_ = Estimate(R"({"builtin": "mass_spring_damper"})", "EXPLICIT");
};

TEST_F(FmuCommandTest, EstimatesAsTheBuiltInModelWhereTheIntegratorIsOurs) {
  EXPECT_LT(Difference("oscillator_me2"), 1e-6);
  EXPECT_LT(Difference("oscillator_me3"), 1e-6);
}

TEST_F(FmuCommandTest, EstimatesAsTheBuiltInModelToTheErrorOfTheFmusOwnSteps) {
  // The FMU's steps of 1 ms of fourth order err by ω⁵ h⁴ t/120 = 4e-10 m at ω = 6.4 rad/s over 5 s,
  // which is 4e-8 of the noise of one sample. The built-in model's integrator errs by less.
  EXPECT_LT(Difference("oscillator_cs2"), 1e-3);
  EXPECT_LT(Difference("oscillator_cs3"), 1e-3);
}

TEST_F(FmuCommandTest, EstimatesWithProcessNoiseAsTheBuiltInModel) {
  const std::string noisy = R"(, "processNoise": [{"state": "v", "spectralDensity": 0.01}])";
  const v1::Estimate own = Estimate(R"({"builtin": "mass_spring_damper"})" + noisy, "EXPLICIT");
  for (const char* fmu : {"oscillator_me2", "oscillator_me3"}) {
    const v1::Estimate other = Estimate(R"({"fmu": ")" + std::string(fmu) + R"("})" + noisy);
    for (int i = 0; i < 2; ++i) {
      const v1::ParameterEstimate& parameter = own.parameters(i);
      EXPECT_NEAR(other.parameters(i).map(), parameter.map(), 1e-6 * parameter.std_dev()) << fmu;
      EXPECT_NEAR(other.parameters(i).std_dev(), parameter.std_dev(), 1e-6 * parameter.std_dev());
      // The process noise is not without effect.
      EXPECT_GT(parameter.std_dev(), 1.2 * built_in_.parameters(i).std_dev());
    }
  }
}

TEST_F(FmuCommandTest, RefusesProcessNoiseAndDriftWhereStatesAndParametersCannotBeSet) {
  const auto refusal = [&](const std::string& rest) {
    const Finished run = Run({"estimate", Problem(rest), data_, "--fmu-dir", POLYEST_TEST_FMUS});
    EXPECT_EQ(run.exit_status, 2);
    return run.err;
  };
  const std::string noisy = R"(, "processNoise": [{"state": "v", "spectralDensity": 0.01}])";
  EXPECT_THAT(refusal(R"({"fmu": "oscillator_cs2"})" + noisy),
              HasSubstr("likelihood: PREDICTION_ERROR needs a model whose states can be set, but "
                        "oscillator_cs2 is an FMU for Co-Simulation"));
  const std::string drifting = File("drifting.json", R"({"model": {"fmu": "oscillator_me2"},
      "uncertain": [{"name": "k", "uniform": {"lower": 30, "upper": 50},
                     "drift": {"randomWalk": {"stdDevPerSqrtS": 1}}}],
      "measured": [{"output": "x", "noise": {"absolute": 0.01}}]})");
  const Finished run = Run({"estimate", drifting, data_, "--fmu-dir", POLYEST_TEST_FMUS});
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(run.err, HasSubstr("uncertain[0].drift: k cannot drift: model oscillator_me2 takes "
                                 "its parameters at the start of a run only"));
}

TEST_F(FmuCommandTest, ListsAndDescribesFmusBesideTheBuiltInModels) {
  const Finished list = Run({"models", "--fmu-dir", POLYEST_TEST_FMUS});
  EXPECT_EQ(list.exit_status, 0) << list.err;
  EXPECT_THAT(list.out, HasSubstr("mass_spring_damper"));
  EXPECT_THAT(list.out, HasSubstr("oscillator_cs3"));
  EXPECT_THAT(list.out, HasSubstr("FMI 3.0 Co-Simulation"));
  const Finished one = Run({"models", "oscillator_me2", "--fmu-dir", POLYEST_TEST_FMUS});
  EXPECT_THAT(one.out, HasSubstr("damping coefficient"));
  EXPECT_THAT(one.out, HasSubstr("FMI 2.0 Model Exchange"));
}

TEST_F(FmuCommandTest, AnswersTheSameByADaemon) {
  DaemonProcess daemon({"--fmu-dir", POLYEST_TEST_FMUS});
  const std::string problem = Problem(R"({"fmu": "oscillator_me2"})");
  const std::vector<std::string> command = {"propagate", problem, "--until", "1", "--step", "0.5"};
  std::vector<std::string> local = command;
  local.insert(local.end(), {"--fmu-dir", POLYEST_TEST_FMUS});
  std::vector<std::string> remote = command;
  remote.insert(remote.end(), {"--server", daemon.address()});
  const Finished here = Run(local);
  const Finished there = Run(remote);
  EXPECT_EQ(here.exit_status, 0) << here.err;
  EXPECT_EQ(there.exit_status, 0) << there.err;
  EXPECT_EQ(here.out, there.out);
  const Finished stream = Run({"stream", problem, data_, "--server", daemon.address()});
  EXPECT_EQ(stream.exit_status, 0) << stream.err;
}

TEST_F(FmuCommandTest, WarnsOfDataWhereOnlyTheDaemonHasTheModel) {
  DaemonProcess daemon({"--fmu-dir", POLYEST_TEST_FMUS});
  const std::string problem = File("noisy.json", R"({"model": {"fmu": "oscillator_me2"},
      "uncertain": [{"name": "k", "uniform": {"lower": 31.584, "upper": 47.376}}],
      "measured": [{"output": "x", "noise": {"absolute": 10}}]})");
  const std::string late = File("late.csv", "t,x\n12.35,0.5\n12.40,0.6\n12.45,0.7\n");
  const Finished here = Run({"estimate", problem, late, "--fmu-dir", POLYEST_TEST_FMUS});
  const Finished there = Run({"estimate", problem, late, "--server", daemon.address()});
  EXPECT_EQ(there.exit_status, here.exit_status) << there.err;
  EXPECT_THAT(here.err, HasSubstr("warning: t"));
  EXPECT_EQ(there.err, here.err);
}

TEST_F(FmuCommandTest, ADaemonOutlivesAnFmuThatCrashes) {
  DaemonProcess daemon({"--fmu-dir", POLYEST_TEST_FMUS});
  const std::string crash = File("crash.json", R"({"model": {"fmu": "faulty_cs2"},
      "fixed": {"crash_at": 0.25}, "uncertain": [{"name": "x0", "normal": {"stdDev": 1}}]})");
  const Finished failed =
      Run({"propagate", crash, "--until", "1", "--step", "0.5", "--server", daemon.address()});
  EXPECT_NE(failed.exit_status, 0);
  EXPECT_THAT(failed.err, HasSubstr("fmu faulty_cs2: the worker was killed by signal 11"));
  EXPECT_EQ(Run({"models", "--server", daemon.address()}).exit_status, 0);
}

TEST_F(FmuCommandTest, SaysWhichFmusThereAreAndHowToNameTheirFolder) {
  const std::string problem = Problem(R"({"fmu": "rig"})");
  const Finished unknown = Run({"estimate", problem, data_, "--fmu-dir", POLYEST_TEST_FMUS});
  EXPECT_EQ(unknown.exit_status, 2);
  EXPECT_THAT(unknown.err, HasSubstr("model.fmu: there is no FMU \"rig\"; there are ball_me2"));
  const Finished without = Run({"estimate", problem, data_});
  EXPECT_EQ(without.exit_status, 2);
  EXPECT_THAT(without.err, HasSubstr("no folder of FMUs was named (--fmu-dir)"));
  const Finished nowhere = Run({"models", "--fmu-dir", "/nowhere"});
  EXPECT_EQ(nowhere.exit_status, 2);
  EXPECT_THAT(nowhere.err, HasSubstr("--fmu-dir: \"/nowhere\" is not a folder"));
}

}  // namespace
}  // namespace polyest::internal
