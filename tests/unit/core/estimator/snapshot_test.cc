// Tests estimators restored from a snapshot. The oracle is the estimator that was not interrupted:
// every number of every later estimate is the same to the bit.

#include "core/estimator/snapshot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/model/equations/equation_model.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/snapshot_session.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

std::vector<double> AllNumbersOf(const Estimate& estimate) {
  std::vector<double> numbers = NumbersOf(estimate);
  for (const ChannelEstimate& c : estimate.channels) {
    numbers.insert(numbers.end(), {c.lag1_correlation, c.effective_samples, c.noise_time_constant_s,
                                   c.noise_white_share, static_cast<double>(c.outliers)});
  }
  for (const ComponentEstimate& component : estimate.components) {
    numbers.push_back(component.weight);
    for (const ParameterEstimate& p : component.parameters) {
      numbers.insert(numbers.end(), {p.map, p.std_dev, p.mean, p.lower95, p.upper95});
    }
  }
  return numbers;
}

struct Outcome {
  std::vector<Estimate> estimates;  // of the undisturbed estimator, one a batch
  int restored = 0;                 // how often one was restored from a snapshot
};

// Feeds the record in batches. After each, the estimator is given up and restored from the latest
// snapshot, on one thread and two by turns.
Outcome ExpectSameBitsThroughRestarts(Problem problem, const Samples& samples, size_t batch = 45) {
  problem.integration.samples_between_checkpoints = kInterval;
  Outcome outcome;
  Session undisturbed(problem);
  EstimatorSnapshot latest;
  for (size_t first = 0; first < samples.rows(); first += batch) {
    const size_t end = std::min(first + batch, samples.rows());
    undisturbed.Take(testing::Rows(samples, first, batch));
    outcome.estimates.push_back(undisturbed.Current());
    Session session(problem, 1 + outcome.restored % 2);
    EXPECT_TRUE(session.estimator->Append(testing::Rows(samples, 0, end)).ok());
    if (!latest.state.empty()) {
      const absl::Status restored = session.estimator->Restore(latest);
      EXPECT_TRUE(restored.ok()) << restored;
      EXPECT_EQ(session.estimator->rows_processed(), latest.rows);
      ++outcome.restored;
    }
    EXPECT_TRUE(session.estimator->Process().ok());
    const Estimate estimate = session.Current();
    EXPECT_EQ(AllNumbersOf(estimate), AllNumbersOf(outcome.estimates.back())) << end;
    ExpectSame(estimate, outcome.estimates.back());
    if (!session.rows.empty()) {
      EXPECT_GT(session.rows.front(), latest.rows);
      latest = session.last;
    }
    // A snapshot of the restored estimator is, byte for byte, the one of the undisturbed.
    EXPECT_EQ(latest.rows, undisturbed.last.rows);
    EXPECT_TRUE(latest.state == undisturbed.last.state) << end;
  }
  EXPECT_GT(outcome.restored, 0);
  return outcome;
}

TEST(Snapshot, LetsAnEstimatorGoOnToTheSameBits) {
  const Outcome outcome = ExpectSameBitsThroughRestarts(OscillatorProblem(), OscillatorRecord());
  EXPECT_GT(outcome.estimates.back().expansion.reexpansions, 0);
  EXPECT_GE(outcome.restored, 4);
}

// The phase tells ever more of the frequency, so that the expansion moves again and again, with its
// sums, while nothing is propagated from the beginning.
TEST(Snapshot, HoldsSumsThatWereCarriedOver) {
  Problem problem = OscillatorProblem(0.005);
  problem.fixed = {{"m", 1}, {"c", 0}};
  const Samples samples = Record(
      "x", [](double t) { return 1.1 * std::cos(std::sqrt(9.7) * t); }, 0.005, 4000);
  const Outcome outcome = ExpectSameBitsThroughRestarts(problem, samples, 450);
  const Estimate &first = outcome.estimates[2], &last = outcome.estimates.back();
  EXPECT_GT(last.expansion.reexpansions, first.expansion.reexpansions + 1);
  EXPECT_LT(last.expansion.trajectories, 1.5 * first.expansion.trajectories);
}

// No affordable order follows the model. Which ones have been tried decides what is tried later.
TEST(Snapshot, HoldsWhatWasTriedInVain) {
  std::vector<UncertainParameter> parameters;
  for (const char* name : {"a", "b", "c", "d", "e"}) {
    parameters.push_back(*UncertainParameter::Uniform(name, -1, 1));
  }
  const Problem problem = TextProblem("sin(40*a) + 0*(b + c + d + e)", parameters, 0.2);
  const auto constant = [](double) { return 0.5; };
  const Outcome outcome =
      ExpectSameBitsThroughRestarts(problem, Record("y", constant, 0.02, 160), 80);
  EXPECT_TRUE(Has(outcome.estimates.back(), DiagnosticCode::kExpansionInaccurate));
}

TEST(Snapshot, ChangesNoAnswer) {
  Problem problem = OscillatorProblem();
  problem.integration.samples_between_checkpoints = kInterval;
  Session with(problem);
  with.Take(OscillatorRecord());
  ExpectSame(with.Current(), EstimateOf(problem, OscillatorRecord()));
  EXPECT_THAT(with.rows, ElementsAre(32, 64, 96, 128, 160, 192, 224));
}

TEST(Snapshot, LeavesShortRecordsAsTheyAreWithoutCheckpoints) {
  Problem rare = OscillatorProblem(), never = OscillatorProblem();
  rare.integration.samples_between_checkpoints = 240;
  never.integration.samples_between_checkpoints = 1'000'000;
  ExpectSame(EstimateOf(rare, OscillatorRecord()), EstimateOf(never, OscillatorRecord()));
}

TEST(Snapshot, HoldsAFixedExpansion) {
  Problem problem = OscillatorProblem(0.1);
  problem.expansion.adaptive = false;
  ExpectSameBitsThroughRestarts(problem, OscillatorRecord(150));
}

TEST(Snapshot, HoldsWhatHasBeenLearnedOfTheNoise) {
  Problem problem = OscillatorProblem();
  problem.measured[0].noise = {.unknown = true,
                               .correlation = NoiseCorrelation::kUnknown,
                               .outliers = OutlierHandling::kStudentT};
  const Samples samples = OscillatorRecord();
  const Outcome outcome = ExpectSameBitsThroughRestarts(problem, samples);
  EXPECT_NEAR(outcome.estimates.back().channels[0].noise_std_dev, 0.02, 0.01);
}

TEST(Snapshot, HoldsTheSampleBeforeOfCorrelatedNoise) {
  Problem problem = OscillatorProblem();
  problem.measured = {
      {"x", {.absolute = 0.02, .correlation = NoiseCorrelation::kKnown, .time_constant_s = 0.1}},
      {"v", {.absolute = 0.1, .unknown = true}}};
  Samples samples = OscillatorRecord();
  samples.columns.push_back({"v", {}, {}});
  for (const double t : samples.time_s)
    samples.columns[1].value.push_back(-3.4 * std::sin(3.1 * t));
  ExpectSameBitsThroughRestarts(problem, samples);
}

// The samples are kept one by one at the first two checkpoints and given up before the third.
TEST(Snapshot, HoldsFewSamplesWithOutliers) {
  Problem problem = OscillatorProblem();
  problem.measured[0].noise.outliers = OutlierHandling::kStudentT;
  ExpectSameBitsThroughRestarts(problem, OscillatorRecord());
}

TEST(Snapshot, HoldsTheStatesOfFilters) {
  Problem problem = OscillatorProblem();
  problem.process_noise = {{.state = "v", .spectral_density = 1e-3}};
  for (const auto method : {IntegrationMethod::kAuto, IntegrationMethod::kExplicit}) {
    problem.integration.method = method;
    const Outcome outcome = ExpectSameBitsThroughRestarts(problem, OscillatorRecord(200));
    EXPECT_GE(outcome.restored, 3);
  }
}

TEST(Snapshot, HoldsNoiseThatIsWhiteInPart) {
  Problem problem = OscillatorProblem();
  problem.measured = {{"x",
                       {.absolute = 0.02,
                        .correlation = NoiseCorrelation::kKnown,
                        .time_constant_s = 0.3,
                        .white_share = 0.4}},
                      {"v", {.unknown = true, .correlation = NoiseCorrelation::kUnknown}}};
  Samples samples = OscillatorRecord();
  samples.columns.push_back({"v", {}, {}});
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  double slow = 0;
  for (const double t : samples.time_s) {
    slow = 0.95 * slow + 0.3 * normal(random);
    samples.columns[1].value.push_back(-3.4 * std::sin(3.1 * t) + 0.1 * (slow + normal(random)));
  }
  const Outcome outcome = ExpectSameBitsThroughRestarts(problem, samples);
  EXPECT_EQ(outcome.estimates.back().channels[0].noise_white_share, 0.4);
  EXPECT_GT(outcome.estimates.back().channels[1].noise_white_share, 0);
}

TEST(Snapshot, HoldsAnOrderChosenOnTheWay) {
  Problem problem = OscillatorProblem();
  problem.expansion.order = std::nullopt;
  const Outcome outcome = ExpectSameBitsThroughRestarts(problem, OscillatorRecord());
  EXPECT_GT(outcome.estimates.back().expansion.reexpansions, 0);
}

// The data tell the sum of c and k far better than each, so that the expansion returns to the
// prior, at an order above the first.
TEST(Snapshot, HoldsAnExpansionThatHasReturnedToThePrior) {
  const Problem problem =
      TextProblem("x + v*t + 4.9*i*t^2 - c*(0.2*t^2 - 0.002*t^3) - k*(0.08*t^2 - 0.001*t^3)",
                  {UncertainParameter::Lognormal("c", 0.02, 0.01).value(),
                   UncertainParameter::Lognormal("k", 0.01, 0.005).value(),
                   UncertainParameter::Normal("v", 0.4, 0.05).value(),
                   UncertainParameter::Normal("x", 0, 0.01).value(),
                   UncertainParameter::Normal("i", 0, 0.001).value()},
                  2e-3);
  const auto fall = [](double t) { return 0.004 + 0.41 * t - 0.0025 * t * t + 4e-5 * t * t * t; };
  const Outcome outcome = ExpectSameBitsThroughRestarts(problem, Record("y", fall, 2e-3, 96), 48);
  EXPECT_GT(outcome.estimates.back().expansion.order, 3);
}

TEST(Snapshot, HoldsSeveralComponents) {
  // The frequency tells a² and not its sign.
  Problem problem;
  EquationSpecification equations;
  equations.states = {{"x", "v"}, {"v", "-(5 + a^2)^2 * x"}};
  equations.parameters = {{"x_0", 1}};
  equations.outputs = {{"y", "x"}};
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = {UncertainParameter::Normal("a", -0.2, 0.7).value()};
  problem.measured = {{"y", {.absolute = 0.1}}};
  problem.expansion.order = 4;
  const Samples samples = Record(
      "y", [](double t) { return std::cos(5.64 * t); }, 0.1, 300);
  const Outcome outcome = ExpectSameBitsThroughRestarts(problem, samples, 70);
  EXPECT_THAT(outcome.estimates.back().components, SizeIs(2));
}

TEST(Snapshot, HoldsParametersOfRuns) {
  Problem problem = OscillatorProblem();
  problem.uncertain[1].per_run = true;
  const Outcome outcome = ExpectSameBitsThroughRestarts(problem, OscillatorRecord(50, 4));
  EXPECT_THAT(outcome.estimates.back().parameters, SizeIs(5));
}

TEST(Snapshot, HoldsRunsWhoseParametersHaveBeenEliminated) {
  Problem problem = OscillatorProblem();
  problem.uncertain[1].per_run = true;
  problem.measured[0].noise.unknown = true;
  const Outcome outcome = ExpectSameBitsThroughRestarts(problem, OscillatorRecord(16, 16), 90);
  ASSERT_THAT(outcome.estimates.back().parameters, SizeIs(2));
  EXPECT_EQ(outcome.estimates.back().parameters[1].name, "x0[15]");
}

TEST(Snapshot, HoldsWhereTheRunsAre) {
  for (const int rows : {20, 50}) {  // a run shorter than the interval, and longer
    const Outcome outcome =
        ExpectSameBitsThroughRestarts(OscillatorProblem(), OscillatorRecord(rows, 240 / rows), 30);
    EXPECT_GE(outcome.restored, 4);
  }
}

TEST(Snapshot, HoldsWhichTrajectoriesHaveFailed) {
  // The solution of ẋ = k x² reaches infinity at t = 1/(k x0), which lies within the record for the
  // larger k.
  Problem problem;
  EquationSpecification equations;
  equations.states = {{"x", "k * x^2"}};
  equations.parameters = {{"x_0", 1}};
  equations.outputs = {{"y", "x"}};
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = {UncertainParameter::Uniform("k", 0.05, 0.3).value()};
  problem.measured = {{"y", {.absolute = 0.3}}};
  problem.expansion.order = 3;
  problem.expansion.points_per_term = 6;
  problem.expansion.adaptive = false;
  const Samples samples = Record(
      "y", [](double t) { return 1 / (1 - 0.08 * t); }, 0.3, 120);
  const Outcome outcome = ExpectSameBitsThroughRestarts(problem, samples, 25);
  EXPECT_TRUE(Has(outcome.estimates.back(), DiagnosticCode::kPointsFailed));
}

TEST(Snapshot, HoldsAStiffModel) {
  Problem problem;
  EquationSpecification equations;
  equations.states = {{"x", "-1000 * (x - cos(w * t))"}};
  equations.outputs = {{"y", "x"}};
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = {UncertainParameter::Uniform("w", 0.8, 1.2).value()};
  problem.measured = {{"y", {.absolute = 0.05}}};
  problem.expansion.order = 3;
  const Samples samples = Record(
      "y", [](double t) { return std::cos(0.97 * t); }, 0.05, 150);
  for (const IntegrationMethod method : {IntegrationMethod::kStiff, IntegrationMethod::kAuto}) {
    problem.integration.method = method;
    ExpectSameBitsThroughRestarts(problem, samples);
  }
}

// Makes m ẍ + k x = force from rest in two runs: x = k⁻¹ F (1 − cos ωt) for a step. The linear
// input has this step from its first knot on.
Problem DrivenProblem(Interpolation interpolation) {
  Problem problem = OscillatorProblem(0.02);
  problem.fixed = {{"m", 1}, {"c", 0}, {"x0", 0}};
  problem.uncertain.pop_back();
  problem.inputs = {{"force", StreamedInput{.interpolation = interpolation}}};
  return problem;
}

Samples DrivenRecord(int rows) {
  Samples samples = Record(
      "x", [](double t) { return (1 - std::cos(3.1 * t)) / 9.61; }, 0.02, rows, 2);
  samples.columns.push_back({"force", std::vector<double>(samples.rows(), 1.0), {}});
  return samples;
}

TEST(Snapshot, FindsTheStreamedInputsInTheRows) {
  for (const Interpolation interpolation :
       {Interpolation::kHold, Interpolation::kLinear, Interpolation::kCubic,
        Interpolation::kShapePreserving}) {
    Samples samples = DrivenRecord(80);
    // The force is not quite constant, so that the knots count.
    for (size_t k = 0; k < samples.rows(); ++k) {
      samples.columns[1].value[k] += 0.01 * std::sin(static_cast<double>(k * k));
    }
    ExpectSameBitsThroughRestarts(DrivenProblem(interpolation), samples, 30);
  }
}

TEST(Snapshot, FindsTheKnotsOfInputsBetweenWhichItWasMade) {
  for (const Interpolation interpolation :
       {Interpolation::kHold, Interpolation::kLinear, Interpolation::kCubic}) {
    Samples samples = DrivenRecord(80);
    samples.columns[1].missing.assign(samples.rows(), false);
    for (size_t k = 0; k < samples.rows(); ++k) {
      samples.columns[1].value[k] += 0.01 * std::sin(static_cast<double>(k * k));
      samples.columns[1].missing[k] = k % 7 != 3;
    }
    ExpectSameBitsThroughRestarts(DrivenProblem(interpolation), samples, 30);
  }
}

TEST(Snapshot, FindsTheStreamedInputsOfLongBeforeWhereTheyAreDelayed) {
  Problem problem = DrivenProblem(Interpolation::kLinear);
  problem.uncertain.push_back(UncertainParameter::Uniform("force.delay", 0, 0.4).value());
  ExpectSameBitsThroughRestarts(problem, DrivenRecord(60), 40);
}

TEST(Snapshot, ServesManyTrajectories) {
  Problem problem = OscillatorProblem();
  problem.uncertain.push_back(UncertainParameter::Uniform("v0", -0.5, 0.5).value());
  problem.expansion.points_per_term = 5;  // 20 terms make two blocks.
  ExpectSameBitsThroughRestarts(problem, OscillatorRecord(100));
}

// A model that simulates itself: x = a in every run.
class ConstantModel final : public SelfPropagatingModel {
 public:
  ConstantModel() {
    description_.name = "constant";
    description_.parameters = {{"a", "1", "value", 0}};
    description_.outputs = {{"x", "1", "value"}};
  }
  const ModelDescription& description() const override { return description_; }

  std::unique_ptr<TrajectoryEnsemble> StartEnsemble(EnsembleSpecification specification,
                                                    const InputSignals*) const override {
    class Constant final : public TrajectoryEnsemble {
     public:
      explicit Constant(const Matrix& a) : a_(a.col(0)) {}
      int points() const override { return static_cast<int>(a_.size()); }
      absl::Status Advance(std::span<const double>, MatrixRef outputs, const Stop&) override {
        outputs.colwise() = a_;
        return absl::OkStatus();
      }
      const std::vector<PointFailure>& failures() const override { return failures_; }

     private:
      Vector a_;
      std::vector<PointFailure> failures_;
    };
    return std::make_unique<Constant>(specification.parameters);
  }

 private:
  ModelDescription description_;
};

TEST(Snapshot, OfAModelThatSimulatesItselfIsMadeWhereARunBegins) {
  Problem problem;
  problem.model = std::make_shared<ConstantModel>();
  problem.uncertain = {UncertainParameter::Normal("a", 0, 1).value()};
  problem.measured = {{"x", {.absolute = 0.1}}};
  problem.expansion.order = 2;
  const auto constant = [](double) { return 0.4; };
  ExpectSameBitsThroughRestarts(problem, Record("x", constant, 0.1, 50, 4));
  problem.integration.samples_between_checkpoints = 60;
  Session session(problem);
  session.Take(Record("x", constant, 0.1, 50, 4));
  EXPECT_THAT(session.rows, ElementsAre(100));
}

}  // namespace
}  // namespace polyest::internal
