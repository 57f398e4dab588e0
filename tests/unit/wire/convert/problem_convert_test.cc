#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "proto/wire/convert/problem.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string MessageOf(const v1::Problem& problem) {
  const auto resolved = ToProblem(problem);
  EXPECT_FALSE(resolved.ok());
  EXPECT_EQ(resolved.status().code(), absl::StatusCode::kInvalidArgument) << resolved.status();
  return std::string(resolved.status().message());
}

// Returns the message for a problem with one field of SmallProblem replaced.
std::string MessageWith(const std::string& json) {
  v1::Problem problem = SmallProblem();
  const v1::Problem change = ProblemFromJson(json);
  if (!change.uncertain().empty()) problem.clear_uncertain();
  if (!change.measured().empty()) problem.clear_measured();
  problem.MergeFrom(change);
  return MessageOf(problem);
}

TEST(ToProblem, FillsInTheDefaultsOfTheContract) {
  const auto resolved = ToProblem(SmallProblem());
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  const Problem& problem = resolved->problem();
  EXPECT_EQ(problem.model->description().name, "mass_spring_damper");
  EXPECT_EQ(problem.expansion.order, std::nullopt);
  EXPECT_EQ(problem.expansion.hyperbolic_exponent, 1);
  EXPECT_EQ(problem.expansion.max_replay_row_count, std::nullopt);
  EXPECT_EQ(problem.expansion.points_per_term, 2);
  EXPECT_EQ(problem.expansion.points, PointSet::kHalton);
  EXPECT_TRUE(problem.expansion.adaptive);
  EXPECT_EQ(problem.regularization, 1);
  EXPECT_EQ(problem.regularization_mode, RegularizationMode::kFixed);
  EXPECT_EQ(problem.integration.method, IntegrationMethod::kAuto);
  EXPECT_TRUE(problem.tolerance_follows_noise);
  EXPECT_EQ(problem.integration.max_steps, 100'000);
}

TEST(ToProblem, TakesEveryOptionThatIsGiven) {
  v1::Problem given = SmallProblem();
  given.MergeFrom(ProblemFromJson(R"({
    "expansion": {"order": 5, "pointsPerTerm": 3, "points": "HAMMERSLEY", "adaptive": false,
                  "hyperbolicExponent": 0.8, "maxReplayRowCount": 20000},
    "regularization": 0,
    "regularizationMode": "L_CURVE",
    "integration": {"method": "STIFF", "relativeTolerance": 1e-9, "maxSteps": 77}
  })"));
  const auto resolved = ToProblem(given);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  const Problem& problem = resolved->problem();
  EXPECT_EQ(problem.fixed.at("k"), 39.478);
  EXPECT_EQ(problem.expansion.order, 5);
  EXPECT_EQ(problem.expansion.hyperbolic_exponent, 0.8);
  EXPECT_EQ(problem.expansion.max_replay_row_count, 20'000);
  EXPECT_EQ(problem.expansion.points_per_term, 3);
  EXPECT_EQ(problem.expansion.points, PointSet::kHammersley);
  EXPECT_FALSE(problem.expansion.adaptive);
  EXPECT_EQ(problem.regularization, 0);
  EXPECT_EQ(problem.regularization_mode, RegularizationMode::kLCurve);
  EXPECT_EQ(problem.integration.method, IntegrationMethod::kStiff);
  EXPECT_EQ(problem.integration.relative_tolerance, 1e-9);
  EXPECT_FALSE(problem.tolerance_follows_noise);
  EXPECT_EQ(problem.integration.max_steps, 77);
}

TEST(ToProblem, KnowsEveryPrior) {
  v1::Problem given = SmallProblem();
  given.clear_fixed();
  given.clear_uncertain();
  given.MergeFrom(ProblemFromJson(R"({"uncertain": [
    {"name": "k", "uniform": {"lower": 30, "upper": 50}},
    {"name": "c", "normal": {"mean": 0.2, "stdDev": 0.03}},
    {"name": "v0", "beta": {"alpha": 2, "beta": 3, "lower": -1, "upper": 3}},
    {"name": "m", "gamma": {"shape": 4, "scale": 0.1, "shift": 1}},
    {"name": "x0", "lognormal": {"mean": 40, "stdDev": 5}}
  ], "expansion": {"order": 2}})"));
  const auto resolved = ToProblem(given);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  const Vector mean = resolved->prior().Mean();
  const Vector std_dev = resolved->prior().StandardDeviation();
  // The closed forms are (a+b)/2, (b−a)/√12; μ, σ; lower + width α/(α+β), width
  // √(αβ/(α+β+1))/(α+β); shift + scale·shape, scale √shape.
  EXPECT_DOUBLE_EQ(mean[0], 40);
  EXPECT_DOUBLE_EQ(std_dev[0], 20 / std::sqrt(12.0));
  EXPECT_DOUBLE_EQ(mean[1], 0.2);
  EXPECT_DOUBLE_EQ(std_dev[1], 0.03);
  EXPECT_DOUBLE_EQ(mean[2], -1 + 4 * 2.0 / 5);
  EXPECT_DOUBLE_EQ(std_dev[2], 4 * std::sqrt(6.0 / 6) / 5);
  EXPECT_DOUBLE_EQ(mean[3], 1.4);
  EXPECT_DOUBLE_EQ(std_dev[3], 0.2);
  EXPECT_NEAR(mean[4], 40, 1e-12);
  EXPECT_NEAR(std_dev[4], 5, 1e-12);
}

absl::StatusOr<ResolvedProblem> WithUncertain(const std::string& rest) {
  v1::Problem given = SmallProblem();
  given.clear_fixed();
  given.clear_uncertain();
  given.MergeFrom(ProblemFromJson("{" + rest + "}"));
  return ToProblem(given);
}

TEST(ToProblem, LeavesABoundThatIsNotGivenOpen) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto resolved = WithUncertain(R"("uncertain": [
    {"name": "c", "truncatedNormal": {"mean": 1, "stdDev": 2, "lower": 0}},
    {"name": "k", "truncatedNormal": {"mean": 1, "stdDev": 2, "upper": 2}},
    {"name": "m", "truncatedNormal": {"mean": 1, "stdDev": 2, "lower": 0.5, "upper": 2}}])");
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  const Prior& prior = resolved->prior();
  EXPECT_EQ(prior.lower(), Vector(Eigen::Vector3d(-0.5, -kInfinity, -0.25)));
  EXPECT_EQ(prior.upper(), Vector(Eigen::Vector3d(kInfinity, 0.5, 0.5)));
  EXPECT_EQ(prior.parameters()[0].location, 1);
  EXPECT_EQ(prior.parameters()[0].scale, 2);
}

constexpr char kTwoNormals[] = R"("uncertain": [
    {"name": "k", "normal": {"mean": 40, "stdDev": 1}},
    {"name": "c", "normal": {"mean": 0.2, "stdDev": 0.03}}])";

TEST(ToProblem, CorrelatesPriors) {
  const auto resolved = WithUncertain(absl::StrCat(
      kTwoNormals, R"(, "correlations": [{"first": "k", "second": "c", "coefficient": 0.6}])"));
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  EXPECT_NEAR(resolved->prior().factor()(1, 0), 0.6, 1e-15);
}

TEST(ToProblem, NamesThePlaceOfABadCorrelation) {
  EXPECT_EQ(WithUncertain(absl::StrCat(kTwoNormals, R"(, "correlations": [
                {"first": "k", "second": "c", "coefficient": 0.6},
                {"first": "kk", "second": "c", "coefficient": 0.6}])"))
                .status()
                .message(),
            "correlations[1]: unknown parameter \"kk\"; uncertain are k, c");
}

template <typename Signal>
const Signal& OnlySignal(const absl::StatusOr<ResolvedProblem>& resolved) {
  EXPECT_TRUE(resolved.ok()) << resolved.status();
  return std::get<Signal>(resolved->problem().inputs.at(0).signal);
}

absl::StatusOr<ResolvedProblem> WithForce(const std::string& signal) {
  v1::Problem problem = SmallProblem();
  problem.MergeFrom(ProblemFromJson(R"({"inputs": [{"name": "force", )" + signal + "}]}"));
  return ToProblem(problem);
}

TEST(ToProblem, KnowsEveryInput) {
  const auto constant = WithForce(R"("constant": {"amplitude": 2})");
  EXPECT_EQ(OnlySignal<ConstantInput>(constant).amplitude, 2);
  const auto step = WithForce(R"("step": {"amplitude": 3, "timeS": 0.5})");
  EXPECT_EQ(OnlySignal<StepInput>(step).amplitude, 3);
  EXPECT_EQ(OnlySignal<StepInput>(step).time_s, 0.5);
  const auto sinusoid =
      WithForce(R"("sinusoid": {"amplitude": 1, "frequencyHz": 0.5, "phaseRad": 1.5})");
  EXPECT_EQ(OnlySignal<SinusoidInput>(sinusoid).amplitude, 1);
  EXPECT_EQ(OnlySignal<SinusoidInput>(sinusoid).frequency_hz, 0.5);
  EXPECT_EQ(OnlySignal<SinusoidInput>(sinusoid).phase_rad, 1.5);
  const auto bump =
      WithForce(R"("halfSineBump": {"amplitude": 4, "startS": 0.1, "durationS": 0.2})");
  EXPECT_EQ(OnlySignal<HalfSineBumpInput>(bump).amplitude, 4);
  EXPECT_EQ(OnlySignal<HalfSineBumpInput>(bump).start_s, 0.1);
  EXPECT_EQ(OnlySignal<HalfSineBumpInput>(bump).duration_s, 0.2);
}

TEST(ToProblem, KnowsChirpsTablesAndStreams) {
  const auto with_chirp =
      WithForce(R"("chirp": {"amplitude": 1, "startFrequencyHz": 2, "endFrequencyHz": 3,
                             "startS": 4, "durationS": 5, "phaseRad": 6})");
  const ChirpInput& chirp = OnlySignal<ChirpInput>(with_chirp);
  EXPECT_EQ(chirp.amplitude, 1);
  EXPECT_EQ(chirp.start_frequency_hz, 2);
  EXPECT_EQ(chirp.end_frequency_hz, 3);
  EXPECT_EQ(chirp.start_s, 4);
  EXPECT_EQ(chirp.duration_s, 5);
  EXPECT_EQ(chirp.phase_rad, 6);
  const auto with_table = WithForce(R"("table": {"timeS": [0, 1], "value": [5, 6], "hold": true})");
  const TableInput& table = OnlySignal<TableInput>(with_table);
  EXPECT_EQ(table.time_s, (std::vector<double>{0, 1}));
  EXPECT_EQ(table.value, (std::vector<double>{5, 6}));
  EXPECT_EQ(table.interpolation, Interpolation::kHold);
  EXPECT_EQ(table.amplitude, 1);
  const auto scaled = WithForce(R"("table": {"timeS": [0], "value": [5], "amplitude": 2})");
  EXPECT_EQ(OnlySignal<TableInput>(scaled).amplitude, 2);
  const auto streamed = WithForce(R"("streamed": {})");
  EXPECT_EQ(OnlySignal<StreamedInput>(streamed).interpolation, Interpolation::kCubic);
  EXPECT_EQ(OnlySignal<StreamedInput>(streamed).amplitude, 1);
  const auto held = WithForce(R"("streamed": {"hold": true, "amplitude": 0})");
  EXPECT_EQ(OnlySignal<StreamedInput>(held).interpolation, Interpolation::kHold);
  EXPECT_EQ(OnlySignal<StreamedInput>(held).amplitude, 0);
  const auto shaped = WithForce(R"("streamed": {"interpolation": "SHAPE_PRESERVING"})");
  EXPECT_EQ(OnlySignal<StreamedInput>(shaped).interpolation, Interpolation::kShapePreserving);
}

TEST(ToProblem, TakesTheNoiseOfEachOutput) {
  v1::Problem given = SmallProblem();
  given.clear_measured();
  given.MergeFrom(ProblemFromJson(R"({"measured": [
    {"output": "x", "noise": {"absolute": 0.1, "relative": 0.2, "relativeToMax": 0.3,
                               "fullScale": 50}}]})"));
  const auto resolved = ToProblem(given);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  const MeasuredOutput& measured = resolved->problem().measured.at(0);
  EXPECT_EQ(measured.output, "x");
  EXPECT_EQ(measured.noise.absolute, 0.1);
  EXPECT_EQ(measured.noise.relative, 0.2);
  EXPECT_EQ(measured.noise.relative_to_max, 0.3);
  EXPECT_EQ(measured.noise.full_scale, 50);
}

TEST(ToProblem, TakesTheCorrelationOfTheNoise) {
  v1::Problem given = SmallProblem();
  given.clear_measured();
  given.MergeFrom(ProblemFromJson(R"({"measured": [{"output": "x", "noise": {
      "absolute": 0.1, "correlation": {"timeConstantS": 2, "whiteShare": 0.25}}}]})"));
  const auto resolved = ToProblem(given);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  const NoiseModel& noise = resolved->problem().measured.at(0).noise;
  EXPECT_EQ(noise.correlation, NoiseCorrelation::kKnown);
  EXPECT_EQ(noise.time_constant_s, 2);
  EXPECT_EQ(noise.white_share, 0.25);
}

TEST(ToProblem, NamesThePlaceOfABadPrior) {
  EXPECT_EQ(MessageWith(R"({"uncertain": [{"name": "k", "uniform": {"lower": 5, "upper": 3}}]})"),
            "uncertain[0].uniform: lower 5 must be below upper 3");
  EXPECT_THAT(MessageWith(R"({"uncertain": [{"name": "v0", "uniform": {"lower": 0, "upper": 1}},
                                            {"name": "c", "normal": {"mean": 1}}]})"),
              StartsWith("uncertain[1].normal.stdDev: "));
  EXPECT_THAT(MessageWith(R"({"uncertain": [{"name": "v0", "beta": {"alpha": 0.5, "beta": 2,
                                             "lower": 0, "upper": 1}}]})"),
              StartsWith("uncertain[0].beta.alpha: 0.5"));
  EXPECT_THAT(MessageWith(R"({"uncertain": [{"name": "v0", "gamma": {"shape": 0, "scale": 1}}]})"),
              StartsWith("uncertain[0].gamma.shape: 0"));
  EXPECT_EQ(
      MessageWith(R"({"uncertain": [{"name": "v0", "lognormal": {"mean": -1, "stdDev": 1}}]})"),
      "uncertain[0].lognormal.mean: -1 must be > 0");
  EXPECT_EQ(MessageWith(
                R"({"uncertain": [{"name": "v0", "truncatedNormal": {"mean": 1, "stdDev": 1}}]})"),
            "uncertain[0].truncatedNormal: lower or upper must be given");
  EXPECT_EQ(MessageWith(R"({"uncertain": [{"name": "v0", "truncatedNormal": {"mean": 1, "stdDev": 1,
                                           "lower": 3, "upper": 2}}]})"),
            "uncertain[0].truncatedNormal: lower 3 must be below upper 2");
  EXPECT_EQ(MessageWith(R"({"uncertain": [{"name": "v0"}]})"),
            "uncertain[0]: v0 needs a prior: uniform, normal, beta, gamma, lognormal or "
            "truncatedNormal");
  EXPECT_EQ(MessageWith(R"({"uncertain": [{"uniform": {"lower": 0, "upper": 1}}]})"),
            "uncertain[0].name: must not be empty");
}

TEST(ToProblem, NamesTheFieldThatIsWrong) {
  EXPECT_THAT(MessageOf(v1::Problem()), StartsWith("model: "));
  EXPECT_THAT(
      MessageWith(R"({"model": {"builtin": "rocket"}})"),
      testing::AllOf(StartsWith("model.builtin: "), HasSubstr("rocket"), HasSubstr("duffing")));
  EXPECT_THAT(MessageWith(R"({"fixed": {"kk": 1}})"),
              testing::AllOf(StartsWith("fixed.kk: "), HasSubstr("v0")));
  EXPECT_THAT(MessageWith(R"({"measured": [{"output": "x"}]})"), StartsWith("measured[0].noise: "));
  EXPECT_THAT(MessageWith(R"({"measured": [{"output": "x", "noise": {"relative": -1}}]})"),
              StartsWith("measured[0].noise.relative: -1"));
  EXPECT_EQ(MessageWith(R"({"measured": [{"output": "x", "noise": {
                "absolute": 1, "correlation": {"timeConstantS": 2, "whiteShare": 1}}}]})"),
            "measured[0].noise.correlation.whiteShare: 1 must be at least 0 and below 1");
  EXPECT_THAT(MessageWith(R"({"measured": [{"output": "x", "noise": {
                  "absolute": 1, "correlation": {"auto": true, "whiteShare": 0.5}}}]})"),
              StartsWith("measured[0].noise.correlation.whiteShare: 0.5 has no effect without "
                         "timeConstantS"));
  EXPECT_THAT(MessageWith(R"({"inputs": [{"name": "force"}]})"),
              StartsWith("inputs[0]: force needs a signal"));
  EXPECT_THAT(MessageWith(R"({"inputs": [{"name": "wind", "constant": {}}]})"),
              StartsWith("inputs[0]: "));
  EXPECT_THAT(MessageWith(R"({"expansion": {"order": -1}})"), StartsWith("expansion.order: -1"));
  EXPECT_THAT(MessageWith(R"({"regularization": -2})"), StartsWith("regularization: -2"));
}

TEST(ToProblem, TakesTheConditionOfUsedRows) {
  v1::Problem given = SmallProblem();
  given.MergeFrom(ProblemFromJson(R"({"useWhen": "v > 5 && !reverse"})"));
  const auto resolved = ToProblem(given);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  EXPECT_EQ(resolved->problem().use_when, "v > 5 && !reverse");
  EXPECT_THAT(resolved->gate()->columns(), ::testing::ElementsAre("reverse", "v"));
  EXPECT_THAT(MessageWith(R"({"useWhen": "v > 5 && * reverse"})"),
              StartsWith("useWhen: column 10"));
}

TEST(ToProblem, TakesProcessNoise) {
  v1::Problem given = SmallProblem();
  given.MergeFrom(ProblemFromJson(R"({"processNoise": [
      {"state": "x", "spectralDensity": 0.01},
      {"state": "v", "unknown": true, "lower": 1e-4, "upper": 1}]})"));
  const auto resolved = ToProblem(given);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  EXPECT_TRUE(resolved->uses_filters());
  EXPECT_EQ(resolved->prior().Names().back(), "processNoise.v");
  EXPECT_EQ(resolved->problem().process_noise[0].spectral_density, 0.01);
  EXPECT_FALSE(ToProblem(SmallProblem())->uses_filters());
  EXPECT_EQ(MessageWith(R"({"processNoise": [{"state": "v", "spectralDensity": -1}]})"),
            "processNoise[0].spectralDensity: -1 must be a finite number ≥ 0");
  EXPECT_THAT(MessageWith(R"({"likelihood": "OUTPUT_ERROR", "processNoise": [{"state": "v"}]})"),
              StartsWith("likelihood: OUTPUT_ERROR takes the model for perfect"));
}

TEST(ToProblem, TakesDrift) {
  v1::Problem given = SmallProblem();
  const std::string name = given.uncertain(0).name();
  auto& walk = *given.mutable_uncertain(0)->mutable_drift()->mutable_random_walk();
  walk.set_std_dev_per_sqrt_s(0.2);
  const auto resolved = ToProblem(given);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  EXPECT_TRUE(resolved->uses_filters());
  EXPECT_EQ(resolved->problem().uncertain[0].drift, RandomWalk{.std_dev_per_sqrt_s = 0.2});
  walk.set_std_dev_per_sqrt_s(0);
  walk.set_unknown(true);
  walk.set_lower(0.1);
  walk.set_upper(1);
  EXPECT_EQ(ToProblem(given)->prior().Names().back(), name + ".drift");
  walk.set_upper(0.1);
  EXPECT_EQ(ToProblem(given).status().message(),
            "uncertain[0].drift.randomWalk.lower: 0.1 must be above 0 and below upper 0.1; both "
            "must lie between 1e-50 and 1e+50, and upper be at most 1e+20 times lower");
  given.mutable_uncertain(0)->mutable_drift()->Clear();
  EXPECT_THAT(std::string(ToProblem(given).status().message()),
              StartsWith("uncertain[0].drift: needs a kind"));
}

TEST(ToProblem, TakesRunsOfAPopulation) {
  v1::Problem problem = SmallProblem();
  EXPECT_FALSE(ToProblem(problem)->population());
  problem.mutable_uncertain(0)->set_population(true);
  EXPECT_THAT(std::string(ToProblem(problem).status().message()),
              StartsWith("uncertain[0].population: v0 needs perRun"));
  problem.mutable_uncertain(0)->set_per_run(true);
  const auto resolved = ToProblem(problem);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  EXPECT_TRUE(resolved->population());
  EXPECT_THAT(resolved->prior().Names(), ElementsAre("v0[0]", "v0.median", "v0.spread"));
}

TEST(ToProblem, KnowsEveryRuleOfRegularization) {
  for (const auto& [given, expected] :
       {std::pair{v1::Problem::REGULARIZATION_MODE_UNSPECIFIED, RegularizationMode::kFixed},
        {v1::Problem::FIXED, RegularizationMode::kFixed},
        {v1::Problem::L_CURVE, RegularizationMode::kLCurve},
        {v1::Problem::DISCREPANCY, RegularizationMode::kDiscrepancy},
        {v1::Problem::EVIDENCE, RegularizationMode::kEvidence}}) {
    v1::Problem problem = SmallProblem();
    problem.set_regularization_mode(given);
    EXPECT_EQ(ToProblem(problem)->problem().regularization_mode, expected);
  }
}

TEST(ToProblem, RefusesNumbersThatAreNoEnumerators) {
  v1::Problem problem = SmallProblem();
  problem.mutable_expansion()->set_points(static_cast<v1::ExpansionOptions::Points>(17));
  EXPECT_EQ(MessageOf(problem), "expansion.points: 17 is not a valid value");
  problem = SmallProblem();
  problem.mutable_integration()->set_method(static_cast<v1::IntegrationOptions::Method>(9));
  EXPECT_EQ(MessageOf(problem), "integration.method: 9 is not a valid value");
  problem = SmallProblem();
  problem.set_regularization_mode(static_cast<v1::Problem::RegularizationMode>(5));
  EXPECT_EQ(MessageOf(problem), "regularizationMode: 5 is not a valid value");
}

TEST(ToProblem, RefusesAnExpansionThatIsTooLarge) {
  v1::Problem problem = SmallProblem();
  problem.mutable_expansion()->set_order(1'000'000);
  EXPECT_EQ(ToProblem(problem).status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace polyest::internal
