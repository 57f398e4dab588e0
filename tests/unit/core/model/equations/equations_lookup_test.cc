// Compares lookup tables with closed forms.

#include <gtest/gtest.h>

#include <functional>

#include "core/model/equations/lookup.h"
#include "tests/unit/core/model/equations/equations.h"

namespace polyest::internal::equations_lookup_test {
namespace {

using equations::Lookup;

LookupTable Sample(const std::vector<double>& x, const std::function<double(double)>& f,
                   bool spline) {
  LookupTable table{x, {}, {}, spline};
  for (const double xi : x) table.value.push_back(f(xi));
  return table;
}

LookupTable Sample(const std::vector<double>& x, const std::vector<double>& y,
                   const std::function<double(double, double)>& f, bool spline) {
  LookupTable table{x, y, {}, spline};
  for (const double xi : x) {
    for (const double yj : y) table.value.push_back(f(xi, yj));
  }
  return table;
}

const std::vector<double> kUneven = {-1, -0.4, 0, 0.7, 1.1, 2};

TEST(LinearTable, IsExactOnLinesAndGoesThroughItsValues) {
  const Lookup line(Sample(
      kUneven, [](double x) { return 3 - 2 * x; }, false));
  const Lookup bent(Sample(
      kUneven, [](double x) { return x * x; }, false));
  for (double x = -1; x < 2; x += 0.013) {
    EXPECT_NEAR(line.Value(x, 0), 3 - 2 * x, 1e-14);
    EXPECT_NEAR(line.SlopeX(x, 0), -2, 1e-13);
  }
  for (const double x : kUneven) EXPECT_NEAR(bent.Value(x, 0), x * x, 1e-15);
  EXPECT_NEAR(bent.Value(0.35, 0), 0.35 * 0.7, 1e-15);
  // The slope at a knot is the one to its right, (1.21 − 0.49)/0.4.
  EXPECT_NEAR(bent.SlopeX(0.7, 0), 1.8, 1e-13);
}

TEST(AnyTable, KeepsItsEndValuesOutside) {
  for (const bool spline : {false, true}) {
    const Lookup table(Sample(
        kUneven, [](double x) { return std::exp(x); }, spline));
    for (const double beyond : {2.001, 10.0, 1e300}) {
      EXPECT_EQ(table.Value(beyond, 0), std::exp(2.0));
      EXPECT_EQ(table.SlopeX(beyond, 0), 0);
      EXPECT_EQ(table.Value(-beyond, 0), std::exp(-1.0));
      EXPECT_EQ(table.SlopeX(-beyond, 0), 0);
    }
    EXPECT_TRUE(std::isnan(table.Value(NAN, 0)));
  }
}

// A function that is a natural spline on the knots of the table is its own interpolant.
TEST(SplineTable, IsExactOnTheSplinesOfItsOwnKnots) {
  // The second derivative s'' is piecewise linear with 0 at the ends. It is the hat at 0.5 on the
  // knots 0, 0.5, 1; integrated twice it gives x³/3 up to 0.5, then (1 − x)³/3 + x/2 − 1/4.
  const auto hat = [](double x) {
    return x < 0.5 ? x * x * x / 3 : (1 - x) * (1 - x) * (1 - x) / 3 + x / 2 - 0.25;
  };
  const auto slope = [](double x) { return x < 0.5 ? x * x : 0.5 - (1 - x) * (1 - x); };
  const Lookup spline(Sample({0, 0.5, 1}, hat, true));
  for (double x = 0; x <= 1; x += 1.0 / 64) {
    EXPECT_NEAR(spline.Value(x, 0), hat(x), 1e-15) << x;
    EXPECT_NEAR(spline.SlopeX(x, 0), slope(x), 4e-15) << x;
  }
}

// The error of the complete spline is |f − s| ≤ 5/384 h⁴ max|f⁗| inside. The natural spline is as
// good where f'' vanishes at the ends, as it does for the sine on [0, π].
TEST(SplineTable, ConvergesWithTheFourthPowerOfTheStep) {
  double last = 0;
  for (const int cells : {8, 16, 32}) {
    std::vector<double> x;
    for (int i = 0; i <= cells; ++i) x.push_back(M_PI * i / cells);
    const Lookup spline(Sample(
        x, [](double a) { return std::sin(a); }, true));
    double error = 0, slope_error = 0;
    for (double a = 0; a < M_PI; a += 0.01) {
      error = std::max(error, std::abs(spline.Value(a, 0) - std::sin(a)));
      slope_error = std::max(slope_error, std::abs(spline.SlopeX(a, 0) - std::cos(a)));
    }
    const double h = M_PI / cells;
    EXPECT_LT(error, 5.0 / 384 * h * h * h * h);
    EXPECT_LT(slope_error, h * h * h / 24 * 1.01);
    if (last > 0) {
      EXPECT_NEAR(last / error, 16, 1.5);
    }
    last = error;
  }
}

TEST(TableOfTwoArguments, IsExactOnBilinearFunctions) {
  const auto f = [](double x, double y) { return 1 + 2 * x - 3 * y + 0.5 * x * y; };
  for (const bool spline : {false, true}) {
    const Lookup table(Sample(kUneven, {0, 0.3, 2}, f, spline));
    for (double x = -1; x < 2; x += 0.1) {
      for (double y = 0; y < 2; y += 0.1) {
        EXPECT_NEAR(table.Value(x, y), f(x, y), 1e-14);
        EXPECT_NEAR(table.SlopeX(x, y), 2 + 0.5 * y, 1e-13);
        EXPECT_NEAR(table.SlopeY(x, y), -3 + 0.5 * x, 1e-13);
      }
    }
    EXPECT_NEAR(table.Value(5, -5), f(2, 0), 1e-14);
    EXPECT_EQ(table.SlopeX(5, 1), 0);
    EXPECT_NEAR(table.SlopeY(5, 1), -3 + 0.5 * 2, 1e-13);
    EXPECT_TRUE(std::isnan(table.Value(0, NAN)));
  }
}

// The spline of a product is the product of the splines.
TEST(TableOfTwoArguments, IsTheProductOfSplines) {
  const auto f = [](double x) { return std::sin(x) + x * x; };
  const auto g = [](double y) { return std::exp(-y); };
  const std::vector<double> ys = {0, 0.3, 0.9, 1.5, 2};
  const Lookup fx(Sample(kUneven, f, true)), gy(Sample(ys, g, true));
  const Lookup both(Sample(
      kUneven, ys, [&](double x, double y) { return f(x) * g(y); }, true));
  for (double x = -1; x < 2; x += 0.07) {
    for (double y = 0; y < 2; y += 0.07) {
      EXPECT_NEAR(both.Value(x, y), fx.Value(x, 0) * gy.Value(y, 0), 2e-14);
      EXPECT_NEAR(both.SlopeX(x, y), fx.SlopeX(x, 0) * gy.Value(y, 0), 1e-13);
      EXPECT_NEAR(both.SlopeY(x, y), fx.Value(x, 0) * gy.SlopeX(y, 0), 1e-13);
    }
  }
}

TEST(Tables, AreCalledByTheirNamesAndDifferentiated) {
  const auto model = MakeOrFail(
      {.states = {{"x", "f(2*x) + g(x, y)"}, {"y", "f(0.5)"}},
       .outputs = {{"z", "f(x)*2"}},
       .tables = {{"f", Sample(
                            {0, 1, 2}, [](double x) { return 3 * x; }, false)},
                  {"g", Sample(
                            {0, 4}, {0, 4}, [](double x, double y) { return x * y; }, false)}}});
  ASSERT_NE(model, nullptr);
  Eigen::ArrayXXd states(kLanes, 2), rates(kLanes, 2), outputs(kLanes, 1), jacobian(kLanes, 4);
  states.col(0).setLinSpaced(0.05, 0.9);
  states.col(1).setLinSpaced(1, 3);
  const Eigen::ArrayXXd parameters = Eigen::ArrayXXd::Zero(kLanes, 2), none(kLanes, 0);
  const Eigen::ArrayXd x = states.col(0), y = states.col(1);
  model->Derivatives(0, states, parameters, none, rates);
  EXPECT_LT((rates.col(0) - (6 * x + x * y)).abs().maxCoeff(), 1e-14);
  EXPECT_TRUE((rates.col(1) == 1.5).all());
  model->Outputs(0, states, parameters, none, outputs);
  EXPECT_LT((outputs.col(0) - 6 * x).abs().maxCoeff(), 1e-14);
  model->StateJacobian(0, states, parameters, none, jacobian);
  EXPECT_LT((jacobian.col(0) - (6 + y)).abs().maxCoeff(), 1e-13);
  EXPECT_LT((jacobian.col(2) - x).abs().maxCoeff(), 1e-13);
  EXPECT_TRUE((jacobian.col(1) == 0).all() && (jacobian.col(3) == 0).all());
}

}  // namespace
}  // namespace polyest::internal::equations_lookup_test
