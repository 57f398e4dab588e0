// Tests posteriors in several pieces, each with an expansion of its own. The oracle is e^{−J} on a
// fine grid over each piece, with J from the closed form of the model.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "core/model/equations/equation_model.h"
#include "polyest/estimator.h"
#include "tests/testing/oscillator.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/stopping_store.h"

namespace polyest::internal {
namespace {

using testing::Rows;

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kNoise = 0.1;

Problem TextProblem(const char* output, std::vector<UncertainParameter> uncertain, int order) {
  Problem problem;
  EquationSpecification equations;
  equations.outputs = {{"y", output}};
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = std::move(uncertain);
  problem.measured = {{"y", {.absolute = kNoise}}};
  problem.expansion.order = order;
  return problem;
}

Samples Record(const std::function<double(double)>& y, double step_s, int count, uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0, kNoise);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int i = 1; i <= count; ++i) {
    samples.time_s.push_back(i * step_s);
    samples.columns[0].value.push_back(y(i * step_s) + normal(generator));
  }
  return samples;
}

using Output = std::function<double(const Vector& theta, double t)>;
using LogPrior = std::function<double(const Vector& theta)>;

// Returns −log density of θ, up to a constant.
double ExactCost(const Samples& samples, const Output& y, const LogPrior& prior,
                 const Vector& theta) {
  double sum = -prior(theta);
  for (size_t i = 0; i < samples.rows(); ++i) {
    const double e = samples.columns[0].value[i] - y(theta, samples.time_s[i]);
    sum += 0.5 * e * e / (kNoise * kNoise);
  }
  return sum;
}

struct Piece {
  double log_mass = 0;
  Vector mean, std_dev;
};

// Integrates by the midpoint rule with 100 cells an axis over ±6 standard deviations about the
// piece's map. The error is of the order of (0.12)²/24 of a standard deviation.
Piece ByQuadrature(const ComponentEstimate& about,
                   const std::function<double(const Vector&)>& cost) {
  constexpr int kCells = 100;
  const auto n = static_cast<Eigen::Index>(about.parameters.size());
  Vector map(n), width(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    map[i] = about.parameters[static_cast<size_t>(i)].map;
    width[i] = 12 * about.parameters[static_cast<size_t>(i)].std_dev / kCells;
  }
  const double least = cost(map);
  double mass = 0;
  Piece piece{0, Vector::Zero(n), Vector::Zero(n)};
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < (n == 2 ? kCells : 1); ++j) {
      Vector offset(n);
      offset[0] = (i + 0.5 - kCells / 2) * width[0];
      if (n == 2) offset[1] = (j + 0.5 - kCells / 2) * width[1];
      const double density = std::exp(least - cost(map + offset));
      mass += density;
      piece.mean += density * offset;
      piece.std_dev += density * offset.cwiseAbs2();
    }
  }
  piece.mean /= mass;
  piece.std_dev = (piece.std_dev / mass - piece.mean.cwiseAbs2()).cwiseSqrt();
  piece.mean += map;
  piece.log_mass = std::log(mass * width.prod()) - least;
  return piece;
}

struct Case {
  const char* name;
  Problem problem;
  Samples samples;
  Output output;
  LogPrior log_prior;
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

double LogNormal(double x, double mean, double std_dev) {
  return -0.5 * std::pow((x - mean) / std_dev, 2);
}

// Makes a problem whose frequency tells a² and not its sign; the prior favours one. No single
// polynomial over both signs follows a phase that grows with time.
Case OfASign(const char* name, double prior_mean, int rows) {
  return {name,
          TextProblem("cos((5 + a^2) * t)",
                      {UncertainParameter::Normal("a", prior_mean, 0.7).value()}, 4),
          Record([](double t) { return std::cos(5.64 * t); }, 0.05, rows, 3),
          [](const Vector& theta, double t) { return std::cos((5 + theta[0] * theta[0]) * t); },
          [=](const Vector& theta) { return LogNormal(theta[0], prior_mean, 0.7); }};
}

Case OfASignBesideADamping() {
  return {"besideADamping",
          TextProblem("exp(-c * t) * cos((5 + a^2) * t)",
                      {UncertainParameter::Normal("a", -0.2, 0.7).value(),
                       UncertainParameter::Normal("c", 0.12, 0.03).value()},
                      4),
          Record([](double t) { return std::exp(-0.1 * t) * std::cos(5.64 * t); }, 0.05, 300, 4),
          [](const Vector& theta, double t) {
            return std::exp(-theta[1] * t) * std::cos((5 + theta[0] * theta[0]) * t);
          },
          [](const Vector& theta) {
            return LogNormal(theta[0], -0.2, 0.7) + LogNormal(theta[1], 0.12, 0.03);
          }};
}

// Makes a problem with aliases. When sampled once a second, w is the same as 6π − w with the phase
// of the other sign; only the prior of the phase tells which it is.
Case OfAnAlias() {
  return {"alias",
          TextProblem("cos(w * t + p)",
                      {UncertainParameter::Normal("w", 9.5, 0.6).value(),
                       UncertainParameter::Normal("p", 0.02, 0.1).value()},
                      6),
          Record([](double t) { return std::cos(10.4 * t + 0.05); }, 1, 60, 5),
          [](const Vector& theta, double t) { return std::cos(theta[0] * t + theta[1]); },
          [](const Vector& theta) {
            return LogNormal(theta[0], 9.5, 0.6) + LogNormal(theta[1], 0.02, 0.1);
          }};
}

class MixtureAccuracy : public ::testing::TestWithParam<Case> {};

// The bound covers the weights. Bridge sampling with 8,192 draws beside as many has a relative
// error of about 10⁻², and the errors of the expansions add as much.
TEST_P(MixtureAccuracy, IsThatOfQuadratureOnTheModel) {
  constexpr double kMaxError = 0.03;
  const Case& one = GetParam();
  const Estimate estimate = EstimateOf(one.problem, one.samples);
  ASSERT_THAT(estimate.components, SizeIs(2));
  std::vector<Piece> pieces;
  double all = 0;
  for (const ComponentEstimate& component : estimate.components) {
    pieces.push_back(ByQuadrature(component, [&](const Vector& theta) {
      return ExactCost(one.samples, one.output, one.log_prior, theta);
    }));
    all += std::exp(pieces.back().log_mass - pieces.front().log_mass);
  }
  std::vector<double> weights;
  for (size_t k = 0; k < 2; ++k) {
    const ComponentEstimate& component = estimate.components[k];
    weights.push_back(std::exp(pieces[k].log_mass - pieces.front().log_mass) / all);
    EXPECT_NEAR(component.weight, weights[k], 0.02 * weights[k]);
    for (size_t i = 0; i < component.parameters.size(); ++i) {
      const ParameterEstimate& parameter = component.parameters[i];
      const double std_dev = pieces[k].std_dev[static_cast<Eigen::Index>(i)];
      EXPECT_NEAR(parameter.mean, pieces[k].mean[static_cast<Eigen::Index>(i)],
                  kMaxError * std_dev);
      EXPECT_NEAR(parameter.posterior_std_dev, std_dev, kMaxError * std_dev);
    }
  }
  for (size_t i = 0; i < estimate.parameters.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double mean = weights[0] * pieces[0].mean[at] + weights[1] * pieces[1].mean[at];
    double variance = 0;
    for (size_t k = 0; k < 2; ++k) {
      variance += weights[k] *
                  (std::pow(pieces[k].std_dev[at], 2) + std::pow(pieces[k].mean[at] - mean, 2));
    }
    const ParameterEstimate& parameter = estimate.parameters[i];
    EXPECT_NEAR(parameter.mean, mean, kMaxError * std::sqrt(variance));
    EXPECT_NEAR(parameter.posterior_std_dev, std::sqrt(variance), kMaxError * std::sqrt(variance));
    EXPECT_EQ(parameter.map, estimate.components[0].parameters[i].map);
    EXPECT_EQ(parameter.std_dev, estimate.components[0].parameters[i].std_dev);
  }
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kExpansionInaccurate));
}

INSTANTIATE_TEST_SUITE_P(Pieces, MixtureAccuracy,
                         ::testing::Values(OfASign("equal", 0, 400), OfASign("unequal", 0.15, 100),
                                           OfASign("long", 0.3, 2000), OfASignBesideADamping(),
                                           OfAnAlias()));

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
  // Systematic resampling gives each piece its share to one draw.
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
}  // namespace polyest::internal
