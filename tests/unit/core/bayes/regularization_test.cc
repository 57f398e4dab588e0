#include "core/bayes/regularization.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/bayes/regularization_bias.h"
#include "core/bayes/regularization_prior.h"
#include "core/chaos/germ.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

UncertainParameter Normal(const char* name) {
  return UncertainParameter::Normal(name, 0, 1).value();
}

// Holds linear data z_i = s_i ξ_i + noise of unit variance, with a residual χ² that no ξ removes,
// as a cost. In Hermite polynomials ξ itself is a basis polynomial. Everything has a closed form:
//   ξ̂_i = s_i z_i/(s_i² + α²),  γ = Σ s_i²/(s_i² + α²),
//   p(z | α²) = ∏ N(z_i; 0, 1 + s_i²/α²) × constant,  θ = ξ.
struct LinearProblem {
  Vector s, z;
  double residual = 0;

  Cost MakeCost(double regularization) const {
    const int n = static_cast<int>(s.size());
    std::vector<UncertainParameter> parameters(static_cast<size_t>(n), Normal("a"));
    for (int i = 0; i < n; ++i) parameters[static_cast<size_t>(i)].name = std::string(1, 'a' + i);
    const Prior prior(parameters);
    const auto basis = std::make_shared<const Basis>(prior.germs(), 1);
    Matrix points = Matrix::Identity(n, n);  // φ(e_i) − φ(0) is the column of ξ_i.
    Vector phi_0(basis->size()), phi(basis->size());
    basis->Evaluate(Vector::Zero(n), phi_0);
    MismatchSums sums(basis->size());
    for (int i = 0; i < n; ++i) {
      basis->Evaluate(points.row(i).transpose(), phi);
      sums.Add(s[i] * (phi - phi_0), z[i], 1);
    }
    sums.Add(Vector::Zero(basis->size()), std::sqrt(residual), 1);
    return Cost(basis, Region::WholePrior(n), Vector::Zero(n), sums, prior, regularization);
  }

  Vector Minimum(double regularization) const {
    return s.cwiseProduct(z).array() / (s.array().square() + regularization);
  }

  MinimumAt At() const {
    return [this](double regularization) {
      return DescribeMinimum(MakeCost(regularization), Minimum(regularization));
    };
  }

  std::vector<RegularizedMinimum> Sweep() const {
    return SweepRegularization(RangeOfChoice(), At());
  }

  double LogEvidence(double regularization) const {
    double sum = -0.5 * residual;
    for (int i = 0; i < s.size(); ++i) {
      const double variance = 1 + s[i] * s[i] / regularization;
      sum -= 0.5 * (std::log(variance) + z[i] * z[i] / variance);
    }
    return sum;
  }

  double Discrepancy(double regularization, double degrees) const {
    double sum = residual - degrees;
    for (int i = 0; i < s.size(); ++i) {
      const double kept = regularization / (s[i] * s[i] + regularization);
      sum += kept * kept * z[i] * z[i] + 1 - kept;
    }
    return sum;
  }
};

LinearProblem Problem(std::initializer_list<double> s, std::initializer_list<double> z,
                      double residual) {
  return {Eigen::Map<const Vector>(s.begin(), static_cast<Eigen::Index>(s.size())),
          Eigen::Map<const Vector>(z.begin(), static_cast<Eigen::Index>(z.size())), residual};
}

// Returns ∫ ρ^{α²} dξ by the trapezoidal rule over `from` … `to`.
double Integral(const Germ& germ, double regularization, double from, double to) {
  constexpr int kSteps = 400'000;
  const double step = (to - from) / kSteps;
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double weight = i == 0 || i == kSteps ? 0.5 : 1;
    sum += weight * std::exp(regularization * germ.LogDensity(from + i * step));
  }
  return sum * step;
}

TEST(RegularizationPrior, IsNormalizedWhateverItsWeight) {
  for (const Germ& germ :
       {Germ::Normal(), Germ::Uniform(), Germ::Beta(2, 2), Germ::Beta(3, 1), Germ::Gamma(1),
        Germ::Gamma(4), Germ::TruncatedNormal(-1, 2), Germ::TruncatedNormal(1, 1e9)}) {
    for (const double regularization : {0.01, 0.3, 1.0, 7.0}) {
      SCOPED_TRACE(testing::Message()
                   << static_cast<int>(germ.family()) << ", α² " << regularization);
      // The density beyond this reach is nowhere above e^−40 of its greatest value.
      const double reach = 40 / regularization + 40;
      // The error of the rule comes from ξ^0.03 at 0, of a gamma density: O(step^1.03).
      EXPECT_NEAR(LogNormalization(germ, regularization),
                  std::log(Integral(germ, regularization, std::max(germ.Lower(), -reach),
                                    std::min(germ.Upper(), reach))),
                  5e-5);
    }
    EXPECT_NEAR(LogNormalization(germ, 1), 0, 1e-12);
  }
}

TEST(RegularizationPrior, OfAGreatWeightIsTheNormalAboutTheMode) {
  // Laplace's method gives ∫ ρ^r → ρ(mode)^r √(2π/(−r (log ρ)″)), exact to O(1/r).
  const double r = 1e6;
  for (const Germ& germ : {Germ::Beta(2, 2), Germ::Beta(3, 2), Germ::Gamma(4)}) {
    const double mode = germ.Mode();
    EXPECT_NEAR(LogNormalization(germ, r) - r * germ.LogDensity(mode),
                0.5 * std::log(-2 * M_PI / (r * germ.LogDensitySecondDerivative(mode))), 1e-5);
  }
}

TEST(RegularizationPrior, OfATailIsAnExponentialEvenWhereItsProbabilityUnderflows) {
  // The integral is ∫_a^∞ e^{−r ξ²/2} = e^{−r a²/2}/(r a) (1 − 1/(r a²) + …) with r a² = 16·10⁶.
  const double r = 1e6, a = 4;
  const Germ germ = Germ::TruncatedNormal(a, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(LogNormalization(germ, r) - r * germ.LogDensity(a), -std::log(r * a), 1e-6);
  const Germ mirror = Germ::TruncatedNormal(-std::numeric_limits<double>::infinity(), -a);
  EXPECT_NEAR(LogNormalization(mirror, r), LogNormalization(germ, r), 1e-6);
}

TEST(RegularizationPrior, HasTheVarianceOfItsFamily) {
  EXPECT_DOUBLE_EQ(WeightedVariance(Germ::Normal(), 4), 0.25);
  EXPECT_DOUBLE_EQ(WeightedVariance(Germ::Uniform(), 4), 1.0 / 3);
  EXPECT_DOUBLE_EQ(WeightedVariance(Germ::Gamma(3), 2), 5.0 / 4);  // gamma(5) ÷ 2
  EXPECT_DOUBLE_EQ(WeightedVariance(Germ::Beta(2, 2), 1), 0.2);
  EXPECT_NEAR(WeightedVariance(Germ::Beta(2, 2), 1e-9), 1.0 / 3, 1e-8);
}

TEST(RegularizedMinimum, OfALinearProblemHasItsEvidenceAndEffectiveParameters) {
  const LinearProblem problem = Problem({3, 0.5}, {4, -1}, 10);
  const double at_one = DescribeMinimum(problem.MakeCost(1), problem.Minimum(1))->log_evidence;
  for (const double regularization : {1e-4, 0.2, 1.0, 30.0}) {
    const RegularizedMinimum minimum = *problem.At()(regularization);
    EXPECT_NEAR(minimum.log_evidence - at_one,
                problem.LogEvidence(regularization) - problem.LogEvidence(1), 1e-10);
    EXPECT_NEAR(minimum.effective_parameters,
                9 / (9 + regularization) + 0.25 / (0.25 + regularization), 1e-12);
  }
}

// Makes a cost of two parameters. The data z = ξ_1, with unit noise ÷ s, inform the first only.
Cost FirstOfTwo(const UncertainParameter& second, double s, double z, double regularization) {
  const Prior prior({Normal("a"), second});
  const auto basis = std::make_shared<const Basis>(prior.germs(), 1);
  Vector phi_0(3), phi(3);
  basis->Evaluate(Vector::Zero(2), phi_0);
  basis->Evaluate(Vector::Unit(2, 0), phi);
  MismatchSums sums(3);
  sums.Add(s * (phi - phi_0), s * z, 1);
  return Cost(basis, Region::WholePrior(2), Vector::Zero(2), sums, prior, regularization);
}

TEST(RegularizedMinimum, HasNoEvidenceFromAParameterThatTheDataLeaveToThePrior) {
  const double s = 10, z = 1.5;
  for (const UncertainParameter& second :
       {Normal("b"), UncertainParameter::Uniform("b", 0, 1).value(),
        UncertainParameter::Beta("b", 2, 2, 0, 1).value(),
        UncertainParameter::Gamma("b", 4, 1, 0).value(),
        UncertainParameter::Gamma("b", 1, 1, 0).value(),
        UncertainParameter::Beta("b", 3, 1, 0, 1).value(),
        UncertainParameter::TruncatedNormal("b", 0, 1, -1, 3).value()}) {
    const auto log_evidence = [&](double r) {
      // The point stays off the bounds, as a minimizer does.
      const double mode = std::clamp(Germ(second.germ).Mode(), Germ(second.germ).Lower() + 1e-9,
                                     Germ(second.germ).Upper() - 1e-9);
      const Vector at = Eigen::Vector2d(s * s * z / (s * s + r), mode);
      return DescribeMinimum(FirstOfTwo(second, s, z, r), at)->log_evidence;
    };
    const auto of_first = [&](double r) {
      const double variance = 1 / (s * s) + 1 / r;
      return -0.5 * (std::log(variance) + z * z / variance);
    };
    for (const double r : {0.01, 0.3, 20.0}) {
      EXPECT_NEAR(log_evidence(r) - log_evidence(1), of_first(r) - of_first(1), 1e-5)
          << static_cast<int>(second.germ.family) << ", α² " << r;
    }
  }
}

TEST(Evidence, OfOneParameterIsGreatestWhereThePriorIsAsWideAsWhatIsSeen) {
  // The evidence N(z; 0, 1 + s²/α²) is greatest for z² = 1 + s²/α².
  const LinearProblem problem = Problem({10}, {30}, 5);
  const RegularizationChoice choice = ChooseByEvidence(problem.Sweep(), problem.At());
  EXPECT_TRUE(choice.determined);
  EXPECT_NEAR(choice.regularization, 100.0 / 899, 1e-4 * choice.regularization);
}

TEST(Evidence, OfAnIllPosedProblemIsThatOfTheClosedForm) {
  const LinearProblem problem = Problem({100, 20, 3}, {250, -30, 2}, 40);
  const RegularizationChoice choice = ChooseByEvidence(problem.Sweep(), problem.At());
  ASSERT_TRUE(choice.determined);
  // The oracle is the maximum of the closed form, found by a fine scan.
  double best = 1;
  for (double tau = std::log(1e-3); tau < std::log(1e3); tau += 1e-4) {
    if (problem.LogEvidence(std::exp(tau)) > problem.LogEvidence(best)) best = std::exp(tau);
  }
  EXPECT_NEAR(std::log(choice.regularization), std::log(best), 2e-4);
}

TEST(Evidence, DoesNotChooseWhereThePriorsMostLikelyValueIsTheBest) {
  // The datum has z² < 1, so that the evidence is greatest for a prior as narrow as can be.
  const LinearProblem problem = Problem({10}, {0.2}, 5);
  const RegularizationChoice choice = ChooseByEvidence(problem.Sweep(), problem.At());
  EXPECT_FALSE(choice.determined);
  EXPECT_EQ(choice.regularization, 1);
  EXPECT_THAT(choice.reason, HasSubstr("α² = 1e+04"));
}

TEST(Evidence, DoesNotChooseWithoutInformation) {
  const LinearProblem problem = Problem({0, 0}, {0, 0}, 5);
  EXPECT_FALSE(ChooseByEvidence(problem.Sweep(), problem.At()).determined);
  EXPECT_FALSE(ChooseByEvidence({}, problem.At()).determined);
}

TEST(Discrepancy, IsMetAtTheRootOfTheClosedForm) {
  const LinearProblem problem = Problem({100, 20, 3}, {250, -30, 2}, 15);
  const double degrees = 20;
  const RegularizationChoice choice = ChooseByDiscrepancy(problem.Sweep(), problem.At(), degrees);
  ASSERT_TRUE(choice.determined);
  EXPECT_NEAR(problem.Discrepancy(choice.regularization, degrees), 0, 2e-3);
  EXPECT_LE(problem.Discrepancy(choice.regularization, degrees), 1e-9);
  EXPECT_GT(problem.Discrepancy(1.001 * choice.regularization, degrees), 0);
}

TEST(Discrepancy, OfOneDatumIsWhatThePriorLeaves) {
  // The condition (α²/(s² + α²))² z² = 1 − s²/(s² + α²) gives α² = s²/(z² − 1).
  const LinearProblem problem = Problem({10}, {4}, 0);
  const RegularizationChoice choice = ChooseByDiscrepancy(problem.Sweep(), problem.At(), 1);
  EXPECT_TRUE(choice.determined);
  EXPECT_NEAR(choice.regularization, 100.0 / 15, 2e-4 * choice.regularization);
}

TEST(Discrepancy, DoesNotChooseWhereItIsNeverOrAlwaysMet) {
  const LinearProblem misfit = Problem({10}, {4}, 30);
  RegularizationChoice choice = ChooseByDiscrepancy(misfit.Sweep(), misfit.At(), 10);
  EXPECT_FALSE(choice.determined);
  EXPECT_EQ(choice.regularization, 1);
  EXPECT_THAT(choice.reason, HasSubstr("larger than the noise explains even with α² = 0.0001"));
  choice = ChooseByDiscrepancy(misfit.Sweep(), misfit.At(), 100);
  EXPECT_FALSE(choice.determined);
  EXPECT_EQ(choice.regularization, 1);
  EXPECT_THAT(choice.reason, HasSubstr("up to α² = 1e+04"));
}

TEST(RegularizationBias, OfALinearProblemIsTheShiftFromBayesRule) {
  const LinearProblem problem = Problem({3, 0.5, 0}, {4, -1, 0}, 10);
  for (const double regularization : {0.0, 0.01, 1.0, 50.0}) {
    Vector at = problem.Minimum(regularization);
    at[2] = 0;  // The data do not inform it.
    const Vector bias = RegularizationBias(problem.MakeCost(regularization), at, {});
    const Vector expected = at - problem.Minimum(1);
    EXPECT_LT((bias - expected).norm(), 1e-6) << regularization;
    EXPECT_EQ(bias[2], 0);
  }
  EXPECT_EQ(RegularizationBias(problem.MakeCost(1), problem.Minimum(1), {}).norm(), 0);
}

// Makes the cost of one datum z of a parameter, with unit noise in the germ, in the germ's own
// linear polynomial.
Cost OneParameter(const UncertainParameter& parameter, double z, double regularization) {
  const Prior prior({parameter});
  const auto basis = std::make_shared<const Basis>(prior.germs(), 1);
  Vector phi_0(2), phi_1(2);
  basis->Evaluate(Vector::Zero(1), phi_0);
  basis->Evaluate(Vector::Ones(1), phi_1);
  // The vector c satisfies cᵀ(φ(ξ) − φ(0)) = ξ.
  Vector c = Vector::Zero(2);
  c[1] = 1 / (phi_1[1] - phi_0[1]);
  MismatchSums sums(2);
  sums.Add(c, z, 0.01);
  return Cost(basis, Region::WholePrior(1), Vector::Zero(1), sums, prior, regularization);
}

// The oracle is quadrature of ∫ e^{−J_mismatch} ρ^{α²} ÷ Z. The error of Laplace's method is O(the
// posterior's variance × the prior term's third and fourth derivatives): here 0.01 α².
TEST(Evidence, OfASkewedPriorIsThatOfQuadrature) {
  const auto log_evidence = [](const UncertainParameter& parameter, double z, double r) {
    const Germ germ(parameter.germ);
    const double top = std::min(germ.Upper(), 200.0);
    double sum = 0, weight = 0, best = 1e300, at = 0;
    constexpr int kSteps = 200'000;
    for (int i = 0; i < kSteps; ++i) {
      const double xi = germ.Lower() + (top - germ.Lower()) * (i + 0.5) / kSteps;
      const double prior = r * germ.LogDensity(xi), mismatch = 50 * (xi - z) * (xi - z);
      weight += std::exp(prior);
      sum += std::exp(prior - mismatch);
      if (mismatch - prior < best) best = mismatch - prior, at = xi;
    }
    const auto minimum = DescribeMinimum(OneParameter(parameter, z, r), Vector::Constant(1, at));
    return std::pair(minimum->log_evidence, std::log(sum / weight));
  };
  for (const UncertainParameter& parameter : {UncertainParameter::Beta("a", 2, 2, 0, 1).value(),
                                              UncertainParameter::Gamma("a", 4, 1, 0).value()}) {
    const double z = Germ(parameter.germ).Upper() == 1 ? 0.4 : 2;
    for (const double r : {0.1, 1.0, 3.0}) {
      const auto [laplace, exact] = log_evidence(parameter, z, r);
      EXPECT_NEAR(laplace, exact, 0.01 * std::max(r, 1.0) + 0.02);
    }
  }
}

TEST(RegularizationBias, OfAUniformPriorIsNone) {
  const auto uniform = UncertainParameter::Uniform("a", 0, 10).value();
  const Vector at = Vector::Constant(1, 0.4);
  EXPECT_EQ(RegularizationBias(OneParameter(uniform, 0.4, 100), at, {})[0], 0);
  // The bias is also zero at the bound, beyond which the data ask to go.
  const Vector bound = Vector::Constant(1, 1 - 1e-9);
  EXPECT_NEAR(RegularizationBias(OneParameter(uniform, 1.4, 100), bound, {})[0], 0, 1e-7);
}

TEST(RegularizationBias, TakesASkewedPriorAsItIs) {
  // The cost is J = 50 (ξ − z)² + α² (ξ − (s − 1) log ξ). Its minimum is the root of the quadratic
  // 100 (ξ − z) + α² (1 − (s − 1)/ξ) = 0, and θ = 5 ξ.
  const auto gamma = UncertainParameter::Gamma("a", 4, 5, 0).value();
  const double z = 2;
  const auto root = [&](double r) {
    const double b = r - 100 * z;
    return (-b + std::sqrt(b * b + 400 * 3 * r)) / 200;
  };
  for (const double regularization : {0.1, 40.0}) {
    const Vector at = Vector::Constant(1, root(regularization));
    EXPECT_NEAR(RegularizationBias(OneParameter(gamma, z, regularization), at, {})[0],
                5 * (root(regularization) - root(1)), 1e-6);
  }
}

}  // namespace
}  // namespace polyest::internal
