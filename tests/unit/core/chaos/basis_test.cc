#include "core/chaos/basis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/chaos/collocation_points.h"
#include "core/chaos/gauss_rule.h"

namespace polyest::internal {
namespace {

std::vector<Germ> FourFamilies() {
  return {Germ::Normal(), Germ::Uniform(), Germ::Beta(2, 3.5), Germ::Gamma(1.5)};
}

Vector InsideAllSupports() { return Vector{{0.7, -0.35, 0.2, 1.9}}; }

// Computes f'(x) from five points, exactly for polynomials up to degree 4, whatever the step.
template <typename Function>
auto FivePointDerivative(const Function& f, Vector x, int variable) {
  constexpr double kStep = 0.5;
  const double centre = x[variable];
  const auto at = [&](int steps) {
    x[variable] = centre + steps * kStep;
    return f(x);
  };
  return ((at(-2) - 8 * at(-1) + 8 * at(1) - at(2)) / (12 * kStep)).eval();
}

Vector Values(const Basis& basis, const Vector& xi) {
  Vector phi(basis.size());
  basis.Evaluate(xi, phi);
  return phi;
}

TEST(Basis, TermsAreProductsOfOneDimensionalPolynomials) {
  const std::vector<Germ> germs = FourFamilies();
  const Basis basis(germs, 5);
  const Vector xi = InsideAllSupports();
  const Vector phi = Values(basis, xi);
  ASSERT_EQ(basis.size(), 126);
  for (int s = 0; s < basis.size(); ++s) {
    double product = 1;
    for (int k = 0; k < basis.dimension(); ++k) {
      const Basis single({germs[static_cast<size_t>(k)]}, 5);
      product *= Values(single, xi.segment(k, 1))[basis.indices()(s, k)];
    }
    EXPECT_NEAR(phi[s], product, 1e-14 * (1 + std::abs(product))) << s;
  }
}

TEST(Basis, AHyperbolicBasisHasTheSameTermsWhereItHasThem) {
  const Basis whole(FourFamilies(), 5);
  const Basis hyperbolic(FourFamilies(), Truncation{5, 0.6});
  const Vector xi = InsideAllSupports();
  const Vector all = Values(whole, xi), some = Values(hyperbolic, xi);
  Matrix all_slopes(whole.size(), 4), some_slopes(hyperbolic.size(), 4);
  Vector phi(whole.size()), fewer(hyperbolic.size());
  whole.EvaluateWithGradient(xi, phi, all_slopes);
  hyperbolic.EvaluateWithGradient(xi, fewer, some_slopes);
  ASSERT_LT(hyperbolic.size(), whole.size());
  int s = 0;
  for (int r = 0; r < whole.size() && s < hyperbolic.size(); ++r) {
    if ((whole.indices().row(r) != hyperbolic.indices().row(s)).any()) continue;
    EXPECT_EQ(some[s], all[r]) << r;
    EXPECT_EQ(some_slopes.row(s), all_slopes.row(r)) << r;
    ++s;
  }
  EXPECT_EQ(s, hyperbolic.size());
}

TEST(Basis, IsOrthonormalUnderGaussQuadrature) {
  const std::vector<Germ> germs = {Germ::Normal(), Germ::Beta(2, 2), Germ::Gamma(3)};
  const Basis basis(germs, 3);
  // Four nodes integrate products of two cubics exactly.
  const Matrix points = CollocationPoints(PointSet::kGaussTensor, germs, 3, 0).value();
  std::vector<GaussRule> rules;
  for (const Germ& germ : germs) rules.push_back(MakeGaussRule(germ, 4));
  Vector weights(64);
  for (int q = 0; q < 64; ++q) {
    weights[q] = rules[0].weights[q / 16] * rules[1].weights[q / 4 % 4] * rules[2].weights[q % 4];
  }
  Matrix values;
  basis.EvaluateMany(points, values);
  const Matrix gram = values.transpose() * weights.asDiagonal() * values;
  EXPECT_TRUE(gram.isIdentity(1e-12));
}

TEST(Basis, OfOrderTenIsOrthonormalInOneDimension) {
  for (const Germ& germ : FourFamilies()) {
    const GaussRule rule = MakeGaussRule(germ, 11);
    Matrix values;
    Basis({germ}, 10).EvaluateMany(rule.nodes, values);
    const Matrix gram = values.transpose() * rule.weights.asDiagonal() * values;
    EXPECT_TRUE(gram.isIdentity(1e-11)) << static_cast<int>(germ.family());
  }
}

TEST(Basis, ManyPointsAgreeWithOneAtATime) {
  const Basis basis(FourFamilies(), 4);
  // The counts are below, at and beyond the number of points taken at a time
  for (const int count : {1, 7, 128, 300}) {
    const Matrix points = CollocationPoints(PointSet::kHalton, basis.germs(), 4, count).value();
    Matrix values;
    basis.EvaluateMany(points, values);
    ASSERT_EQ(values.rows(), count);
    ASSERT_EQ(values.cols(), basis.size());
    for (int q = 0; q < count; ++q) {
      const Vector phi = Values(basis, points.row(q).transpose());
      EXPECT_TRUE(values.row(q).transpose().isApprox(phi, 1e-13)) << q;
    }
  }
}

TEST(Basis, GradientIsTheDerivativeOfTheValues) {
  const Basis basis(FourFamilies(), 4);
  const Vector xi = InsideAllSupports();
  Vector phi(basis.size());
  // Evaluation must overwrite these values.
  Matrix gradient = Matrix::Constant(basis.size(), 4, 99);
  basis.EvaluateWithGradient(xi, phi, gradient);
  EXPECT_EQ(phi, Values(basis, xi));
  for (int k = 0; k < 4; ++k) {
    const Vector expected =
        FivePointDerivative([&](const Vector& x) { return Values(basis, x); }, xi, k);
    EXPECT_LT((gradient.col(k) - expected).lpNorm<Eigen::Infinity>(), 1e-12);
  }
}

TEST(Basis, WeightedHessianIsTheDerivativeOfTheWeightedGradient) {
  const Basis basis(FourFamilies(), 4);
  const Vector xi = InsideAllSupports();
  const Vector weights = Vector::LinSpaced(basis.size(), -1, 1.3);
  Vector values(basis.size());
  Matrix slopes(basis.size(), 4);
  basis.EvaluateWithGradient(xi, values, slopes);
  const Matrix hessian = basis.WeightedHessian(xi, values, slopes, weights);
  EXPECT_TRUE(hessian.isApprox(hessian.transpose(), 1e-15));
  const auto weighted_gradient = [&](const Vector& x) -> Vector {
    Vector phi(basis.size());
    Matrix gradient(basis.size(), 4);
    basis.EvaluateWithGradient(x, phi, gradient);
    return gradient.transpose() * weights;
  };
  for (int k = 0; k < 4; ++k) {
    const Vector expected = FivePointDerivative(weighted_gradient, xi, k);
    EXPECT_LT((hessian.col(k) - expected).lpNorm<Eigen::Infinity>(), 1e-10);
  }
}

TEST(Basis, OfOrderZeroIsTheConstant) {
  const Basis basis({Germ::Normal(), Germ::Uniform()}, 0);
  ASSERT_EQ(basis.size(), 1);
  const Vector xi{{0.3, 0.4}};
  Vector phi(1);
  Matrix gradient(1, 2);
  basis.EvaluateWithGradient(xi, phi, gradient);
  EXPECT_EQ(phi[0], 1);
  EXPECT_TRUE(gradient.isZero(0));
  EXPECT_TRUE(basis.WeightedHessian(xi, phi, gradient, Vector::Ones(1)).isZero(0));
  Matrix values;
  basis.EvaluateMany(Matrix::Zero(5, 2), values);
  EXPECT_TRUE((values.array() == 1).all());
}

TEST(Basis, LegendreTermsOfOrderSixtyFourReachTheirValuesAtTheEnd) {
  const Basis basis({Germ::Uniform()}, 64);
  const Vector phi = Values(basis, Vector::Ones(1));
  for (int j = 0; j <= 64; ++j) EXPECT_NEAR(phi[j], std::sqrt(2 * j + 1), 1e-11);
}

}  // namespace
}  // namespace polyest::internal
