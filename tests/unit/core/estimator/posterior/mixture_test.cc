// Tests posteriors in several pieces, each with an expansion of its own.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "polyest/estimator.h"
#include "tests/testing/oscillator.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/posterior/mixture_cases.h"
#include "tests/unit/core/estimator/stopping_store.h"

namespace polyest::internal::mixture {
namespace {

using testing::Rows;

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(Mixture, IsWhatOneExpansionDoesNotServe) {
  Case one = OfASign("", 0.15, 400);
  one.problem.expansion.adaptive = false;
  EXPECT_TRUE(Has(EstimateOf(one.problem, one.samples), DiagnosticCode::kExpansionInaccurate));
  // The early samples need no mixture, because one expansion serves them.
  const Estimate early = EstimateOf(one.problem, Rows(one.samples, 0, 10));
  EXPECT_THAT(early.components, IsEmpty());
}

TEST(Mixture, NamesItsPiecesAndWhatTheyLeaveOpen) {
  const Case one = OfASign("", 0.15, 400);
  const Estimate estimate = EstimateOf(one.problem, one.samples);
  const std::string message = Message(estimate, DiagnosticCode::kMultipleMinima);
  EXPECT_THAT(message, HasSubstr("in 2 separated pieces"));
  EXPECT_THAT(message, HasSubstr("% at a = 0.799"));
  EXPECT_THAT(message, HasSubstr("% at a = -0.799"));
  EXPECT_TRUE(Has(estimate, DiagnosticCode::kNonGaussian));
  EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kWeak);
  EXPECT_EQ(estimate.components[0].parameters[0].verdict, Verdict::kIdentified);
  EXPECT_LT(estimate.parameters[0].lower95, -0.79);
  EXPECT_GT(estimate.parameters[0].upper95, 0.79);
}

TEST(Mixture, IsDrawnFromByItsWeights) {
  const Case one = OfASign("", 0.15, 400);
  const auto estimator = MakeEstimator(one.problem);
  ASSERT_TRUE(estimator->Append(one.samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  PosteriorOptions options;
  options.samples = 1000;
  const Posterior posterior = estimator->CurrentPosterior(options).value();
  const Estimate estimate = estimator->CurrentEstimate().value();
  EXPECT_GT(estimate.components[0].parameters[0].map, 0);
  // Stratified resampling gives each piece its share to a few draws.
  EXPECT_NEAR((posterior.samples.col(0).array() > 0).count(), 1000 * estimate.components[0].weight,
              5);
  EXPECT_NEAR(posterior.marginals[0].mean, estimate.parameters[0].mean, 0.01);
}

// Both signs fit the record alike under every noise model. The weights are therefore those of the
// prior at ±0.8, e^{0.8·0.15·2/0.7²} to one.
TEST(Mixture, WeighsItsPiecesAlikeWhateverIsUnknownOfTheNoise) {
  for (const NoiseModel& noise :
       {NoiseModel{.absolute = 1, .unknown = true},
        NoiseModel{.absolute = kNoise, .correlation = NoiseCorrelation::kUnknown},
        NoiseModel{.absolute = kNoise, .outliers = OutlierHandling::kStudentT},
        NoiseModel{.absolute = 1, .unknown = true, .outliers = OutlierHandling::kHuber}}) {
    Case one = OfASign("", 0.15, 400);
    one.problem.measured[0].noise = noise;
    const Estimate estimate = EstimateOf(one.problem, one.samples);
    ASSERT_THAT(estimate.components, SizeIs(2));
    EXPECT_GT(estimate.components[0].parameters[0].map, 0);
    const double ratio = std::exp(2 * 0.8 * 0.15 / (0.7 * 0.7));
    EXPECT_NEAR(estimate.components[0].weight, ratio / (1 + ratio), 0.02);
    EXPECT_NEAR(estimate.channels[0].noise_std_dev, kNoise, 0.15 * kNoise);
  }
}

TEST(Mixture, HasTheLowestOfItsPiecesProfiles) {
  const Case one = OfASign("", 0.15, 400);
  const auto estimator = MakeEstimator(one.problem);
  ASSERT_TRUE(estimator->Append(one.samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  const CostProfiles profiles = estimator->CurrentProfiles({}).value();
  ASSERT_THAT(profiles.profiles, SizeIs(1));
  const CostProfile& profile = profiles.profiles[0];
  EXPECT_TRUE(std::ranges::is_sorted(profile.value));
  EXPECT_LT(profile.value.minCoeff(), -0.79);
  EXPECT_GT(profile.value.maxCoeff(), 0.79);
  const auto exact = [&](double a) {
    return ExactCost(one.samples, one.output, one.log_prior, Vector::Constant(1, a));
  };
  for (Eigen::Index i = 0; i < profile.value.size(); ++i) {
    EXPECT_NEAR(profile.total[i] - profiles.least.total,
                exact(profile.value[i]) - exact(profiles.map[0]), 0.05)
        << profile.value[i];
  }
}

std::vector<double> ComponentsOf(const Estimate& estimate) {
  std::vector<double> numbers;
  for (const ComponentEstimate& component : estimate.components) {
    numbers.push_back(component.weight);
    for (const ParameterEstimate& p : component.parameters) {
      numbers.insert(numbers.end(), {p.map, p.std_dev, p.mean, p.lower95, p.upper95});
    }
  }
  return numbers;
}

void ExpectSameMixture(const Estimate& a, const Estimate& b) {
  ExpectSame(a, b);
  EXPECT_EQ(ComponentsOf(a), ComponentsOf(b));
}

TEST(Mixture, IsTheSameToTheBitHoweverTheRowsCome) {
  const Case one = OfASignBesideADamping();
  const Estimate whole = EstimateOf(one.problem, one.samples);
  ASSERT_THAT(whole.components, SizeIs(2));
  for (const size_t batch : {1U, 70U}) {
    const auto estimator = MakeEstimator(one.problem);
    for (size_t row = 0; row < one.samples.rows(); row += batch) {
      ASSERT_TRUE(
          estimator->Append(Rows(one.samples, row, std::min(batch, one.samples.rows() - row)))
              .ok());
      ASSERT_TRUE(estimator->Process().ok());
    }
    ExpectSameMixture(estimator->CurrentEstimate().value(), whole);
  }
}

TEST(Mixture, IsTheSameToTheBitThroughAnyStops) {
  const Case one = OfASign("", 0.15, 400);
  const auto store = std::make_shared<StoppingStore>();
  EstimatorOptions options;
  options.store = store;
  const auto estimator = MakeEstimator(one.problem, options);
  ASSERT_TRUE(estimator->Append(one.samples).ok());
  int stops = 0;
  absl::Status status = absl::CancelledError("");
  for (int reads = 1; absl::IsCancelled(status) && reads < 1000; ++reads) {
    status = estimator->Process(store->StopAfter(reads));
    if (!absl::IsCancelled(status)) break;
    ++stops;
    double all = 0;
    const Estimate estimate = estimator->CurrentEstimate().value();
    for (const ComponentEstimate& component : estimate.components) all += component.weight;
    if (!estimate.components.empty()) {
      EXPECT_NEAR(all, 1, 1e-5);
    }
  }
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_GT(stops, 5);
  ExpectSameMixture(estimator->CurrentEstimate().value(), EstimateOf(one.problem, one.samples));
}

// The model integrates x″ = −(5 + a²)² x on several threads.
TEST(Mixture, IsTheSameToTheBitForAnyNumberOfThreads) {
  Case one = OfASign("", 0.15, 150);
  EquationSpecification equations;
  equations.states = {{"x", "v"}, {"v", "-(5 + a^2)^2 * x"}};
  equations.outputs = {{"y", "x"}};
  equations.parameters = {{"x_0", 1}};
  one.problem.model = MakeEquationModel(equations).value();
  const auto estimate_with = [&](int threads) {
    EstimatorOptions options;
    options.threads = threads;
    const auto estimator = MakeEstimator(one.problem, options);
    EXPECT_TRUE(estimator->Append(one.samples).ok());
    EXPECT_TRUE(estimator->Process().ok());
    return estimator->CurrentEstimate().value();
  };
  const Estimate with_one = estimate_with(1);
  ASSERT_THAT(with_one.components, SizeIs(2));
  ExpectSameMixture(estimate_with(3), with_one);
}

// A small term beside the frequency tells the signs apart in time. It makes a difference of 0.016 ÷
// 0.1 of its noise in each sample, which adds ½ N (0.16)² to the cost over N samples. This is 14, a
// weight of 10⁻⁶, from N = 1,100 on.
TEST(Mixture, DropsAFalseMinimumThatLosesItsWeight) {
  const Problem problem = TextProblem("cos((5 + a^2) * t) + 0.01 * a",
                                      {UncertainParameter::Normal("a", 0, 0.7).value()}, 4);
  const Samples record = Record([](double t) { return std::cos(5.64 * t) + 0.008; }, 0.05, 2500, 6);
  const auto estimator = MakeEstimator(problem);
  double before = 1;
  for (const size_t rows : {100U, 400U, 2500U}) {
    const auto taken = static_cast<size_t>(estimator->rows_appended());
    ASSERT_TRUE(estimator->Append(Rows(record, taken, rows - taken)).ok());
    ASSERT_TRUE(estimator->Process().ok());
    const Estimate estimate = estimator->CurrentEstimate().value();
    if (rows == 2500U) {
      EXPECT_THAT(estimate.components, IsEmpty());
      EXPECT_NEAR(estimate.parameters[0].map, 0.8, 5 * estimate.parameters[0].std_dev);
      EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kIdentified);
      EXPECT_FALSE(Has(estimate, DiagnosticCode::kMultipleMinima));
      EXPECT_FALSE(Has(estimate, DiagnosticCode::kNonGaussian));
      continue;
    }
    ASSERT_THAT(estimate.components, SizeIs(2)) << rows;
    const double false_weight = estimate.components[0].parameters[0].map < 0
                                    ? estimate.components[0].weight
                                    : estimate.components[1].weight;
    EXPECT_LT(false_weight, before);
    before = false_weight;
  }
}

// The output 5 + cos 4a gives six pieces over 3π/2 (two of them at its ends).
TEST(Mixture, FollowsAllPieces) {
  const Problem problem =
      TextProblem("cos((5 + 0.5 * cos(4 * a)) * t)",
                  {UncertainParameter::Uniform("a", 0, 1.5 * std::numbers::pi).value()}, 24);
  const Samples record = Record([](double t) { return std::cos(5.1 * t); }, 0.05, 400, 7);
  const Estimate estimate = EstimateOf(problem, record);
  EXPECT_THAT(estimate.components, SizeIs(6));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kMultipleMinima), HasSubstr("6 separated pieces"));
  for (const ComponentEstimate& component : estimate.components) {
    EXPECT_NEAR(5 + 0.5 * std::cos(4 * component.parameters[0].map), 5.1, 0.01);
  }
}

TEST(Mixture, IsNotMadeOfOnePiece) {
  testing::OscillatorTruth truth;
  const Samples record = testing::OscillatorRecord(20, 52, truth);
  EXPECT_THAT(EstimateOf(testing::OscillatorProblem(3), record).components, IsEmpty());
}

// The frequency holds b − a²: the posterior is a banana that gets ever thinner.
TEST(Mixture, IsNotMadeOfABanana) {
  const Problem problem = TextProblem("cos((5 + b - a^2) * t)",
                                      {UncertainParameter::Normal("a", 0, 0.5).value(),
                                       UncertainParameter::Normal("b", 0, 0.5).value()},
                                      5);
  for (const int rows : {50, 250}) {
    const Estimate estimate =
        EstimateOf(problem, Record([](double t) { return std::cos(4.8 * t); }, 0.05, rows, 8));
    EXPECT_THAT(estimate.components, IsEmpty()) << rows;
  }
}

// The data show only k/m: the posterior is a valley through the whole prior.
TEST(Mixture, IsNotMadeOfAValley) {
  const Problem problem = TextProblem("cos(sqrt(k / m) * t)",
                                      {UncertainParameter::Uniform("k", 20, 40).value(),
                                       UncertainParameter::Uniform("m", 0.6, 1.4).value()},
                                      4);
  for (const int rows : {50, 250}) {
    const Estimate estimate = EstimateOf(
        problem, Record([](double t) { return std::cos(std::sqrt(30) * t); }, 0.05, rows, 9));
    EXPECT_THAT(estimate.components, IsEmpty()) << rows;
  }
}

}  // namespace
}  // namespace polyest::internal::mixture
