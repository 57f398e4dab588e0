#include "core/bayes/cost.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "core/bayes/curvature.h"
#include "core/bayes/identifiability.h"
#include "core/bayes/minimizer.h"
#include "tests/unit/core/bayes/frequency_example.h"

namespace polyest::internal {
namespace {

// Holds sums of `count` samples with random coefficients about φ_0, and computes the same mismatch
// term by term.
struct RandomRecord {
  Matrix coefficients;  // one sample a column
  Vector z, variance;

  RandomRecord(int terms, int count, double constant) {
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    coefficients = Matrix::NullaryExpr(terms, count, [&] { return normal(random); });
    coefficients.row(0).array() += constant;
    z = Vector::NullaryExpr(count, [&] { return constant + 3 * normal(random); });
    variance = Vector::NullaryExpr(count, [&] { return 0.5 + std::abs(normal(random)); });
  }

  MismatchSums SumsAbout(const Vector& phi_0) const {
    MismatchSums sums(static_cast<int>(coefficients.rows()));
    for (Eigen::Index k = 0; k < z.size(); ++k) {
      sums.Add(coefficients.col(k), z[k] - coefficients.col(k).dot(phi_0), variance[k]);
    }
    return sums;
  }

  double ChiSquared(const Vector& phi) const {
    long double sum = 0;
    for (Eigen::Index k = 0; k < z.size(); ++k) {
      long double y = 0;
      for (Eigen::Index s = 0; s < phi.size(); ++s) {
        y += static_cast<long double>(coefficients(s, k)) * phi[s];
      }
      sum += (z[k] - y) * (z[k] - y) / variance[k];
    }
    return static_cast<double>(sum);
  }
};

TEST(MismatchSums, EqualTheDirectSum) {
  const RandomRecord record(6, 500, 0);
  const Vector phi_0 = Vector::LinSpaced(6, 1, 0.5);
  const Vector phi = Vector::LinSpaced(6, 1, -2);
  const MismatchSums sums = record.SumsAbout(phi_0);
  EXPECT_EQ(sums.count(), 500);
  const double direct = record.ChiSquared(phi);
  EXPECT_NEAR(sums.ChiSquared(phi - phi_0), direct, 1e-12 * direct);
  EXPECT_TRUE(sums.G().isApprox(sums.G().transpose(), 1e-15));
}

TEST(MismatchSums, KeepTheirDigitsUnderAnOffsetOfAMillionSigma) {
  // The first entry is φ_0 = 1, as in every basis, so that the offset never enters d. About zero, w
  // would be 10¹⁵ and leave no more than three digits to the sum of the residuals.
  const RandomRecord record(6, 1000, 1e6);
  const Vector phi_0 = Vector::LinSpaced(6, 1, 0.5);
  Vector phi = Vector::LinSpaced(6, 1, -2);
  const double direct = record.ChiSquared(phi);
  EXPECT_LT(direct, 1e5);
  // The error e is itself a difference of numbers of 10⁶: 10⁶ ε = 2e-10 a sample.
  EXPECT_NEAR(record.SumsAbout(phi_0).ChiSquared(phi - phi_0), direct, 1e-9 * direct);
}

TEST(MismatchSums, OfPartsAddUpToThoseOfAll) {
  MismatchSums all(2), first(2), second(2);
  const Eigen::Vector2d a(1, 2), b(3, -1);
  all.Add(a, 0.5, 4);
  all.Add(b, -2, 0.25);
  first.Add(a, 0.5, 4);
  second.Add(b, -2, 0.25);
  first.Add(second);
  EXPECT_EQ(first.G(), all.G());
  EXPECT_EQ(first.b(), all.b());
  EXPECT_EQ(first.w(), all.w());
  EXPECT_EQ(first.count(), 2);
  // By hand, χ² at d = 0 is 0.5²/4 + 2²/0.25.
  EXPECT_DOUBLE_EQ(all.ChiSquared(Vector::Zero(2)), 16.0625);
}

TEST(Cost, OfASampledSineHasTheClosedFormOfTheInitialVelocity) {
  // The problem is that of §3.1: x = v0/(2π) sin 2πt, v0 = v0nom (1 + ξ/2), ξ ~ beta(2, 2). With
  // a_k = ½ v0nom/(2π) sin 2πt_k and e_k = z_k − v0nom/(2π) sin 2πt_k the mismatch is least at ξ̂ =
  // Σ e_k a_k/R_k ÷ Σ a_k²/R_k and has the curvature Σ a_k²/R_k. These are (44)–(47), corrected.
  const Prior prior({UncertainParameter::Beta("v0", 2, 2, 0.5, 1.5).value()});
  const auto basis = std::make_shared<const Basis>(prior.germs(), 4);
  const double deviation = 1 / std::sqrt(5.0);  // of the germ: φ_1 = ξ √5
  const Vector reference = Vector::Constant(1, 0.4);
  Vector phi_0(basis->size());
  basis->Evaluate(reference, phi_0);
  MismatchSums sums(basis->size());
  double numerator = 0, denominator = 0;
  for (const double t : {0.1, 0.35, 0.7, 1.2}) {
    const double nominal = std::sin(2 * M_PI * t) / (2 * M_PI);
    const double z = 1.115 * nominal + 0.002 * std::cos(40 * t);
    const double variance = std::pow(0.01 * z + 0.0016, 2);
    Vector c = Vector::Zero(basis->size());
    c[0] = nominal;
    c[1] = 0.5 * nominal * deviation;
    sums.Add(c, z - c.dot(phi_0), variance);
    numerator += (z - nominal) * 0.5 * nominal / variance;
    denominator += 0.25 * nominal * nominal / variance;
  }
  const Cost cost(basis, Region::WholePrior(1), reference, sums, prior, 0);
  const Vector best = Vector::Constant(1, numerator / denominator);
  Vector gradient(1);
  cost.EvaluateWithGradient(best, gradient);
  EXPECT_NEAR(gradient[0], 0, 1e-11 * denominator);
  EXPECT_NEAR(cost.Hessian(best)(0, 0), denominator, 1e-11 * denominator);
  EXPECT_GT(std::abs(best[0] - 0.23), 1e-4);  // the disturbance is seen
}

// Makes a cost in which every term matters: a nonlinear expansion in a moved, skewed region.
Cost SkewedCost(double regularization, int order = 4) {
  const Prior prior({UncertainParameter::Normal("a", 1, 2).value(),
                     UncertainParameter::Beta("b", 2, 3, 0, 1).value(),
                     UncertainParameter::Gamma("c", 3, 0.5, 0).value()});
  const auto basis = std::make_shared<const Basis>(std::vector<Germ>(3, Germ::Uniform()), order);
  Matrix axes(3, 3);
  axes << 0.5, 0.1, 0, -0.1, 0.3, 0.05, 0.2, 0, 0.8;
  const Eigen::Vector3d reference(0.1, -0.2, 0.3);
  Vector phi_0(basis->size());
  basis->Evaluate(reference, phi_0);
  return Cost(basis, Region(Eigen::Vector3d(0.5, 0.1, 2), axes), reference,
              RandomRecord(basis->size(), 200, 0).SumsAbout(phi_0), prior, regularization);
}

TEST(Cost, GradientAndHessianAreThoseOfCentralDifferences) {
  const Cost cost = SkewedCost(2.5);
  const Eigen::Vector3d eta(0.3, -0.4, 0.2);
  // Central differences have the error h²/6 J‴ + ε J/h. The polynomials are of degree 8 and J is
  // 10⁴.
  const double h = 1e-5;
  Vector gradient(3), forward(3), backward(3);
  const CostValue value = cost.EvaluateWithGradient(eta, gradient);
  EXPECT_DOUBLE_EQ(value.total, cost.Evaluate(eta).total);
  EXPECT_DOUBLE_EQ(value.total, value.mismatch + 2.5 * value.prior);
  const Matrix hessian = cost.Hessian(eta);
  for (int i = 0; i < 3; ++i) {
    const Vector up = eta + h * Vector::Unit(3, i);
    const Vector down = eta - h * Vector::Unit(3, i);
    const double slope = (cost.EvaluateWithGradient(up, forward).total -
                          cost.EvaluateWithGradient(down, backward).total) /
                         (2 * h);
    EXPECT_NEAR(gradient[i], slope, 1e-6 * gradient.norm());
    EXPECT_LT((hessian.col(i) - (forward - backward) / (2 * h)).norm(), 1e-6 * hessian.norm());
  }
  EXPECT_EQ(hessian, Matrix(hessian.transpose()));
}

TEST(Cost, OfManyPointsIsThatOfEach) {
  const Cost cost = SkewedCost(1.5);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-4, 4);
  // The points fill more than one block, with a remainder, and many lie outside Ω.
  const Matrix etas = Matrix::NullaryExpr(333, 3, [&] { return uniform(random); });
  Vector totals;
  cost.EvaluateMany(etas, totals);
  ASSERT_EQ(totals.size(), 333);
  int outside = 0;
  for (int i = 0; i < 333; ++i) {
    const double expected = cost.Evaluate(etas.row(i).transpose()).total;
    if (std::isinf(expected)) {
      ++outside;
      EXPECT_EQ(totals[i], kInfinity);
    } else {
      EXPECT_NEAR(totals[i], expected, 1e-11 * expected);
    }
  }
  EXPECT_GT(outside, 30);
  EXPECT_LT(outside, 300);
}

TEST(Cost, IsInfiniteOutsideTheSupportWhateverTheWeight) {
  for (const double regularization : {0.0, 1.0}) {
    const Cost cost = SkewedCost(regularization);
    const Vector outside = cost.region().ToLocal(Eigen::Vector3d(0, 1.0001, 2));
    Vector gradient(3);
    EXPECT_EQ(cost.Evaluate(outside).total, kInfinity);
    EXPECT_EQ(cost.EvaluateWithGradient(outside, gradient).total, kInfinity);
    EXPECT_TRUE(gradient.allFinite());
  }
}

TEST(Cost, WithoutWeightIgnoresAPriorThatIsZeroAtItsBound) {
  const Prior prior({UncertainParameter::Beta("b", 2, 2, 0, 1).value()});
  const auto basis = std::make_shared<const Basis>(prior.germs(), 2);
  MismatchSums sums(3);
  sums.Add(Eigen::Vector3d(0, 1, 0), 0.3, 1);
  const Cost cost(basis, Region::WholePrior(1), Vector::Zero(1), sums, prior, 0);
  const Vector bound = Vector::Ones(1);
  const CostValue value = cost.Evaluate(bound);
  EXPECT_EQ(value.prior, kInfinity);
  EXPECT_EQ(value.total, value.mismatch);
  Vector totals;
  cost.EvaluateMany(bound.transpose(), totals);
  EXPECT_TRUE(std::isfinite(totals[0]));
}

// The problem is that of §3.4 on an expansion. The numbers come from Newton's method on (55) itself
// and agree with the printed (0.09, −0.40).
TEST(Cost, OfTheFrequencyExampleHasItsMinimumInTheValley) {
  struct Case {
    double noise;
    Eigen::Vector2d minimum;
    double information;
  };
  for (const Case& expected : {Case{0.0628, {0.0950760, -0.4031802}, 49.4552},
                               {0.3938, {0.0550121, -0.2273410}, 1.22012}}) {
    const Cost cost = FrequencyCost(expected.noise, 1);
    const Minimum minimum = FrequencyMinimum(cost);
    EXPECT_TRUE(minimum.converged);
    EXPECT_LT((minimum.point - expected.minimum).cwiseAbs().maxCoeff(), 2e-6) << minimum.point;
    const std::vector<Direction> directions =
        Directions(cost.MismatchHessian(minimum.point), cost.prior());
    EXPECT_NEAR(directions[0].information, expected.information, 1e-4 * expected.information);
    EXPECT_LT(directions[1].information, 1e-3);
    EXPECT_EQ(directions[1].verdict, Verdict::kNotIdentified);
    // The mass m and the stiffness k rise together along the valley.
    EXPECT_GT(directions[1].coefficients.minCoeff(), 0.2);
  }
}

TEST(Cost, OfTheFrequencyExampleLeavesTheMassAtItsPrior) {
  const Cost cost = FrequencyCost(0.0628, 1);
  const Minimum minimum = FrequencyMinimum(cost);
  const Curvature curvature =
      CovarianceFromCurvature(cost.Hessian(minimum.point), cost.prior(), minimum.point);
  // The expected values are those of the inverse Hessian of (55) at its minimum.
  EXPECT_NEAR(curvature.standard_deviation[0] / 6.667, 0.973781, 1e-5);
  EXPECT_NEAR(curvature.standard_deviation[1] / 1052.8, 0.267533, 1e-5);
  const std::vector<Direction> directions =
      Directions(cost.MismatchHessian(minimum.point), cost.prior());
  EXPECT_EQ(directions[0].verdict, Verdict::kIdentified);
  EXPECT_NEAR(directions[0].coefficients[0], -0.229783, 1e-4);
  EXPECT_NEAR(directions[0].coefficients[1], 0.973242, 1e-4);
}

TEST(Cost, OfTheFrequencyExampleTendsToTheMinimumNormPointOfTheValley) {
  const Minimum minimum = FrequencyMinimum(FrequencyCost(0.0628, 1e-4));
  EXPECT_LT((minimum.point - Eigen::Vector2d(0.0969, -0.4114)).cwiseAbs().maxCoeff(), 6e-5);
}

}  // namespace
}  // namespace polyest::internal
