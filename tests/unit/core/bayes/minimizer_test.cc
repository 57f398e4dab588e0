#include "core/bayes/minimizer.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <limits>
#include <random>

namespace polyest::internal {
namespace {

MinimizationProblem InBox(Vector lower, Vector upper,
                          std::function<double(const Vector&, Vector*)> function) {
  MinimizationProblem problem;
  problem.function = std::move(function);
  problem.constraint.resize(0, lower.size());
  problem.lower = std::move(lower);
  problem.upper = std::move(upper);
  return problem;
}

MinimizationProblem InCube(int n, double half, std::function<double(const Vector&, Vector*)> f) {
  return InBox(Vector::Constant(n, -half), Vector::Constant(n, half), std::move(f));
}

Matrix Row(std::initializer_list<double> values) {
  Matrix row(1, static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), row.data());
  return row;
}

// Returns ½ (x − centre)ᵀ H (x − centre) + offset as a function.
std::function<double(const Vector&, Vector*)> Quadratic(Matrix hessian, Vector centre,
                                                        double offset = 0) {
  return [=](const Vector& x, Vector* gradient) {
    const Vector slope = hessian * (x - centre);
    if (gradient != nullptr) *gradient = slope;
    return 0.5 * slope.dot(x - centre) + offset;
  };
}

Matrix IllConditioned(int n, double condition) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const Matrix any = Matrix::NullaryExpr(n, n, [&] { return normal(random); });
  const Matrix q = Eigen::HouseholderQR<Matrix>(any).householderQ();
  Vector eigenvalues(n);
  for (int i = 0; i < n; ++i) eigenvalues[i] = std::pow(condition, i / (n - 1.0));
  return q * eigenvalues.asDiagonal() * q.transpose();
}

double Error(const Minimum& minimum, const Vector& expected) {
  return (minimum.point - expected).cwiseAbs().maxCoeff();
}

TEST(Minimizer, SolvesAnIllConditionedQuadratic) {
  for (const int n : {2, 5, 12}) {
    const Vector centre = Vector::LinSpaced(n, -0.6, 0.5);
    const auto minima = FindMinima(InCube(n, 1, Quadratic(IllConditioned(n, 1e8), centre, 1000)),
                                   Matrix::Constant(1, n, 0.9), {}, {});
    EXPECT_TRUE(minima[0].converged) << n << " " << minima[0].reason;
    // The bound is the gradient's rounding ε·10⁸ over the least curvature 1.
    EXPECT_LT(Error(minima[0], centre), 1e-7) << n;
    EXPECT_NEAR(minima[0].value, 1000, 1e-9);
  }
}

TEST(Minimizer, IsExactToTheStepAskedForWhereRoundingAllows) {
  const Vector centre = Eigen::Vector3d(0.1, -0.2, 0.3);
  const auto minima = FindMinima(InCube(3, 1, Quadratic(IllConditioned(3, 100), centre, 1e6)),
                                 Matrix::Constant(1, 3, -0.9), {}, {});
  EXPECT_TRUE(minima[0].converged);
  EXPECT_LT(Error(minima[0], centre), 2e-10);
}

TEST(Minimizer, SolvesRosenbrock) {
  const auto rosenbrock = [](const Vector& x, Vector* gradient) {
    const double a = 1 - x[0], b = x[1] - x[0] * x[0];
    if (gradient != nullptr) {
      (*gradient)[0] = -2 * a - 400 * b * x[0];
      (*gradient)[1] = 200 * b;
    }
    return a * a + 100 * b * b;
  };
  const auto minima = FindMinima(InCube(2, 2, rosenbrock), Row({-1.2, 1}), {}, {});
  ASSERT_EQ(minima.size(), 1u);
  EXPECT_TRUE(minima[0].converged);
  EXPECT_LT(Error(minima[0], Eigen::Vector2d(1, 1)), 1e-9);
  EXPECT_LE(minima[0].evaluations, 500);
}

TEST(Minimizer, DoesNotMindTheScalesOfFunctionAndVariables) {
  for (const double function_scale : {1e-12, 1.0, 1e12}) {
    // The range of x_0 is 10⁶, that of x_1 is 10⁻⁶.
    const Vector centre = Eigen::Vector2d(3e5, -2e-7);
    const Matrix hessian =
        function_scale * Eigen::Vector2d(1e-12, 1e12).asDiagonal().toDenseMatrix();
    const auto minima = FindMinima(
        InBox(Eigen::Vector2d(-1e6, -1e-6), Eigen::Vector2d(1e6, 1e-6), Quadratic(hessian, centre)),
        Row({-9e5, 9e-7}), {}, {});
    EXPECT_TRUE(minima[0].converged);
    EXPECT_NEAR(minima[0].point[0], 3e5, 2e-4);
    EXPECT_NEAR(minima[0].point[1], -2e-7, 2e-16);
  }
}

TEST(Minimizer, StopsAtABound) {
  Matrix hessian(2, 2);
  hessian << 2, 1, 1, 4;
  const auto minima =
      FindMinima(InCube(2, 1, Quadratic(hessian, Eigen::Vector2d(3, 0.2))), Row({0, 0}), {}, {});
  // The minimum on x_0 = 1 satisfies 4 (x_1 − 0.2) + (1 − 3) = 0.
  EXPECT_TRUE(minima[0].converged);
  EXPECT_EQ(minima[0].point[0], 1);
  EXPECT_NEAR(minima[0].point[1], 0.7, 1e-10);
}

TEST(Minimizer, StopsAtACorner) {
  const auto minima = FindMinima(
      InCube(2, 1, Quadratic(Matrix::Identity(2, 2), Eigen::Vector2d(3, -5))), Row({0, 0}), {}, {});
  EXPECT_TRUE(minima[0].converged);
  EXPECT_EQ(minima[0].point, Vector(Eigen::Vector2d(1, -1)));
}

TEST(Minimizer, StopsAtAnObliqueConstraint) {
  auto problem = InCube(3, 5, Quadratic(Matrix::Identity(3, 3), Eigen::Vector3d(2, 1, 3)));
  problem.constraint.resize(2, 3);
  problem.constraint << 1, 2, 2, 0, 0, -1;  // The second is never active.
  problem.bound = Eigen::Vector2d(1, 4);
  const auto minima = FindMinima(problem, Row({-4, -4, 0}), {}, {});
  // The minimum is the nearest point of the plane, an excess of (2 + 2 + 6 − 1)/9 = 1 along (1, 2,
  // 2).
  EXPECT_TRUE(minima[0].converged);
  EXPECT_LT(Error(minima[0], Eigen::Vector3d(1, -1, 1)), 1e-9);
  EXPECT_LE((problem.constraint * minima[0].point - problem.bound).maxCoeff(), 1e-12);
}

TEST(Minimizer, LeavesAConstraintThatItStartsOn) {
  const auto minima =
      FindMinima(InCube(2, 1, Quadratic(IllConditioned(2, 10), Eigen::Vector2d(0.2, 0.1))),
                 Row({1, 1}), {}, {});
  EXPECT_TRUE(minima[0].converged);
  EXPECT_LT(Error(minima[0], Eigen::Vector2d(0.2, 0.1)), 1e-9);
}

TEST(Minimizer, MovesStartsInside) {
  auto problem = InCube(2, 1, Quadratic(Matrix::Identity(2, 2), Eigen::Vector2d(0, 0.5)));
  problem.constraint = Row({1, 1});
  problem.bound = Vector::Constant(1, 0.2);
  problem.function = [inner = problem.function](const Vector& x, Vector* gradient) {
    EXPECT_LE(x.cwiseAbs().maxCoeff(), 1);
    return inner(x, gradient);
  };
  const auto minima = FindMinima(problem, Row({50, 70}), {}, {});
  EXPECT_TRUE(minima[0].converged);
  EXPECT_LT(Error(minima[0], Eigen::Vector2d(-0.15, 0.35)), 1e-9);
}

// Returns (x² − 1)² + x/10, which has minima near ±1 and a maximum near 0.
double DoubleWell(const Vector& x, Vector* gradient) {
  const double a = x[0] * x[0] - 1;
  if (gradient != nullptr) (*gradient)[0] = 4 * x[0] * a + 0.1;
  return a * a + 0.1 * x[0];
}

TEST(Minimizer, TellsDistinctMinimaLowestFirst) {
  Matrix starts(4, 1);
  starts << 1.4, -0.3, 0.9, -1.5;
  const auto minima = FindMinima(InCube(1, 2, DoubleWell), starts, {}, {});
  ASSERT_EQ(minima.size(), 2u);
  Vector slope(1);
  for (const Minimum& minimum : minima) {
    EXPECT_TRUE(minimum.converged);
    DoubleWell(minimum.point, &slope);
    EXPECT_NEAR(slope[0], 0, 1e-8);
  }
  EXPECT_NEAR(minima[0].point[0], -1.0121, 1e-3);
  EXPECT_NEAR(minima[1].point[0], 0.9872, 1e-3);
  EXPECT_LT(minima[0].value, minima[1].value);
}

TEST(Minimizer, LeavesASaddlePoint) {
  const auto saddle = [](const Vector& x, Vector* gradient) {
    const double a = x[0] * x[0] - 0.25;
    if (gradient != nullptr) *gradient = Eigen::Vector2d(4 * x[0] * a, 2 * x[1]);
    return a * a + x[1] * x[1];
  };
  const auto minima = FindMinima(InCube(2, 1, saddle), Row({0, 0.7}), {}, {});
  EXPECT_TRUE(minima[0].converged);
  EXPECT_NEAR(std::abs(minima[0].point[0]), 0.5, 1e-9);
}

TEST(Minimizer, BacksOffFromAnInfiniteRegion) {
  // The barrier −log(0.3 − x) + … is infinite from 0.3 on and has its minimum close before.
  const auto barrier = [](const Vector& x, Vector* gradient) {
    const double room = 0.3 - x[0];
    if (!(room > 0)) return kInfinity;
    if (gradient != nullptr) (*gradient)[0] = 1e-3 / room - 1;
    return -1e-3 * std::log(room) - x[0];
  };
  for (const double start : {-0.9, 0.9}) {
    const auto minima = FindMinima(InCube(1, 1, barrier), Row({start}), {}, {});
    EXPECT_TRUE(minima[0].converged) << start;
    EXPECT_NEAR(minima[0].point[0], 0.299, 1e-8) << start;
  }
}

TEST(Minimizer, NeverAnswersNotANumber) {
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), kInfinity}) {
    const auto minima = FindMinima(InCube(1, 1,
                                          [=](const Vector&, Vector* gradient) {
                                            if (gradient != nullptr) (*gradient)[0] = value;
                                            return value;
                                          }),
                                   Row({0.5}), {}, {});
    ASSERT_EQ(minima.size(), 1u);
    EXPECT_FALSE(minima[0].converged);
    EXPECT_EQ(minima[0].value, kInfinity);
    EXPECT_TRUE(minima[0].point.allFinite());
    EXPECT_FALSE(minima[0].reason.empty());
  }
}

TEST(Minimizer, AcceptsAFlatFunction) {
  const auto minima = FindMinima(InCube(2, 1,
                                        [](const Vector&, Vector* gradient) {
                                          if (gradient != nullptr) gradient->setZero();
                                          return 4.0;
                                        }),
                                 Row({0.25, -0.5}), {}, {});
  EXPECT_TRUE(minima[0].converged);
  EXPECT_EQ(minima[0].value, 4);
}

TEST(Minimizer, DescendsNearAMinimum) {
  const Vector centre{{0.3, -0.4}};
  const MinimizationProblem problem = InCube(2, 1, Quadratic(IllConditioned(2, 100), centre));
  const Vector end = DescendFrom(problem, Vector{{5, 1}}, {.relative_step = 1e-3}, Stop());
  EXPECT_LT((end - centre).cwiseAbs().maxCoeff(), 0.05);
  MinimizationProblem held = problem;
  held.upper[0] = 0.1;
  EXPECT_EQ(DescendFrom(held, Vector{{-0.5, 0.5}}, {.relative_step = 1e-3}, Stop())[0], 0.1);
}

TEST(Minimizer, GivesUpAfterTheMostEvaluations) {
  MinimizerOptions options;
  options.max_evaluations = 3;
  const auto minima =
      FindMinima(InCube(5, 1, Quadratic(IllConditioned(5, 1e8), Vector::Constant(5, 0.3))),
                 Matrix::Constant(1, 5, 0.9), options, {});
  EXPECT_TRUE(minima[0].point.allFinite());
  EXPECT_TRUE(std::isfinite(minima[0].value));
}

TEST(Minimizer, ReturnsWhatItHasOnAStopRequest) {
  std::stop_source source;
  int calls = 0;
  const auto minima =
      FindMinima(InCube(2, 1,
                        [&](const Vector& x, Vector* gradient) {
                          if (++calls == 5) source.request_stop();
                          return Quadratic(IllConditioned(2, 1e6), Vector::Zero(2))(x, gradient);
                        }),
                 Matrix::Constant(3, 2, 0.7), {}, Stop(source.get_token()));
  ASSERT_EQ(minima.size(), 1u);
  EXPECT_FALSE(minima[0].converged);
  EXPECT_TRUE(minima[0].point.allFinite());
  EXPECT_LE(calls, 12);
}

TEST(Minimizer, IsDeterministic) {
  const auto run = [] {
    return FindMinima(InCube(5, 1, Quadratic(IllConditioned(5, 1e8), Vector::Constant(5, 0.3))),
                      Matrix::Constant(1, 5, 0.9), {}, {})[0];
  };
  EXPECT_EQ(run().point, run().point);
}

}  // namespace
}  // namespace polyest::internal
