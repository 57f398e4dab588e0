// Tests trajectories of equations that switch. The oracles are closed forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/unit/core/propagation/switching_equations.h"

namespace polyest::internal {
namespace {

using std::numbers::pi;

TEST(Switching, CrossesTheCornerOfASpringWithTwoStiffnesses) {
  const auto exact = [](double t, double k2) {
    const double w1 = std::sqrt(40.0), w2 = std::sqrt(k2);
    t = std::fmod(t, pi / w1 + pi / w2);
    return t < pi / w1 ? std::sin(w1 * t) / w1 : -std::sin(w2 * (t - pi / w1)) / w2;
  };
  for (const char* spring :
       {"if(x > 0, k1*x, k2*x)", "k1*max(x, 0) + k2*min(x, 0)",
        "(k1 + k2)/2*x + (k1 - k2)/2*abs(x)", "x*((k1 + k2)/2 + (k1 - k2)/2*sign(x))"}) {
    ExpectMotion({.states = {{"x", "v"}, {"v", std::string("-") + "(" + spring + ")"}},
                  .outputs = {{"x", "x"}},
                  .parameters = {{"v_0", 1.0}, {"k1", 40.0}, {"k2", 90.0}}},
                 "k2", Evenly(5, 400, 11), 10, 0.1, kAccumulated, exact);
  }
}

TEST(Switching, FliesFreelyThroughABacklash) {
  constexpr double kStiffness = 50;
  ExpectMotion({.states = {{"x", "v"}, {"v", "-if(x > g, k*(x - g), if(x < -g, k*(x + g), 0))"}},
                .outputs = {{"x", "x"}},
                .parameters = {{"v_0", 1.0}, {"k", kStiffness}, {"g", 0.1}}},
               "g", Evenly(0.01, 0.3, 10), 10, 0.1, kAccumulated, [](double t, double g) {
                 const double w = std::sqrt(kStiffness);
                 const double half = 2 * g + pi / w;  // of a period, which begins at x = −g
                 t = std::fmod(t + g, 2 * half);
                 const double side = t < half ? 1 : -1;
                 if (t >= half) t -= half;
                 return side * (t < 2 * g ? t - g : g + std::sin(w * (t - 2 * g)) / w);
               });
}

TEST(Switching, LeavesASaturation) {
  ExpectMotion({.states = {{"x", "-max(min(k*x, f), -f)"}},
                .outputs = {{"x", "x"}},
                .parameters = {{"x_0", 3.0}, {"k", 2.0}, {"f", 1.0}}},
               "f", Evenly(0.5, 5, 10), 6, 0.1, kAccumulated, [](double t, double f) {
                 const double reached_s = (3 - f / 2) / f;
                 return t < reached_s ? 3 - f * t : f / 2 * std::exp(-2 * (t - reached_s));
               });
}

TEST(Switching, TurnsAgainstADragByTheAbsoluteValue) {
  // Thrown upwards with v = −u tan φ, u² = g/c, it passes v = 0 at t = φ/√(g c).
  ExpectMotion({.states = {{"v", "g - c*v*abs(v)"}},
                .outputs = {{"v", "v"}},
                .parameters = {{"v_0", -20.0}, {"g", 9.81}, {"c", 0.1}}},
               "c", Evenly(0.01, 1, 10), 5, 0.1, 20 * kAccumulated, [](double t, double c) {
                 const double rate = std::sqrt(9.81 * c), limit = std::sqrt(9.81 / c);
                 const double phase = std::atan(20 / limit) - rate * t;
                 return phase > 0 ? -limit * std::tan(phase) : -limit * std::tanh(phase);
               });
}

TEST(Switching, MeetsTimesThatTheEquationsSay) {
  // The system is at rest before, and a sample interval is 20 times the pulse.
  ExpectMotion(
      {.states = {{"x", "if(t > start && t < start + 0.05, 1, 0) - x"}}, .outputs = {{"x", "x"}}},
      "start", Evenly(3, 7.3, 9), 12, 1, kAccumulated, [](double t, double start) {
        if (t < start) return 0.0;
        const double end = std::min(t, start + 0.05);
        return (1 - std::exp(start - end)) * std::exp(end - t);
      });
}

TEST(Switching, FollowsAConditionThatIsPeriodicInTime) {
  // A square wave of 10 Hz, seen once a second, and a saw-tooth by mod.
  ExpectMotion({.states = {{"x", "sign(sin(20*pi*(t - lag)))"}}, .outputs = {{"x", "x"}}}, "lag",
               Evenly(0, 0.04, 5), 3, 0.13, kAccumulated, [](double t, double lag) {
                 const auto integral = [](double s) {  // of the wave, from s = 0
                   const double phase = s * 10 - std::floor(s * 10);
                   return 0.1 * (phase < 0.5 ? phase : 1 - phase);
                 };
                 return integral(t - lag) - integral(-lag);
               });
  ExpectMotion({.states = {{"x", "mod(t, period)"}}, .outputs = {{"x", "x"}}}, "period",
               Evenly(0.1, 0.7, 5), 3, 0.13, kAccumulated, [](double t, double period) {
                 const double whole = std::floor(t / period), rest = t - whole * period;
                 return whole * period * period / 2 + rest * rest / 2;
               });
}

// Where mod wraps, a condition on it jumps across its own surface at the same instant.
TEST(Switching, FollowsASquareWaveByMod) {
  for (const char* wave :
       {"if(mod(t, p) < p/2, 1, -1)", "if(mod(t, p) >= p/2, -1, 1)", "sign(p/2 - mod(t, p))",
        "if(t - p*floor(t/p) < p/2, 1, -1)", "if(floor(4*mod(t, p)/p) < 1.5, 1, -1)",
        "if(mod(t, p) < p/2, 1, if(mod(t, p) < 3/4*p, -1, -1))"}) {
    SCOPED_TRACE(wave);
    ExpectMotion({.states = {{"x", wave}}, .outputs = {{"x", "x"}}}, "p", {0.6, 1, 3.7, 4, pi},
                 12.5, 0.1, kAccumulated, [](double t, double p) {
                   const double rest = t - p * std::floor(t / p);
                   return std::min(rest, p - rest);
                 });
  }
}

TEST(Switching, FollowsCornersOfASawTooth) {
  struct Case {
    const char* rate;
    double (*of_period)(double rest, double p);  // the integral from the beginning of a period
  };
  const auto above = [](double rest, double p) {
    const double beyond = std::max(rest - p / 2, 0.0);
    return beyond * beyond / 2;
  };
  const auto below = [](double rest, double p) {
    const double rising = std::min(rest, p / 4);
    return rising * rising / 2 + p / 4 * (rest - rising);
  };
  const auto folded = [](double rest, double p) {
    const double beyond = rest - p / 2;
    return p * p / 8 + beyond * std::abs(beyond) / 2;
  };
  for (const Case& at : {Case{"max(mod(t, p) - p/2, 0)", above}, Case{"min(mod(t, p), p/4)", below},
                         Case{"abs(mod(t, p) - p/2)", folded}}) {
    SCOPED_TRACE(at.rate);
    ExpectMotion({.states = {{"x", at.rate}}, .outputs = {{"x", "x"}}}, "p", {0.6, 1, 3.7, 4, pi},
                 12.5, 0.1, kAccumulated, [&at](double t, double p) {
                   const double whole = std::floor(t / p);
                   return whole * at.of_period(p, p) + at.of_period(t - whole * p, p);
                 });
  }
}

// A threshold between 2 and 2/3 jumps while x is far from where it goes, or slides on it. x then
// goes there and slides.
TEST(Switching, StaysWhereItIsWhenAThresholdJumps) {
  static constexpr double kLow = 2.0 / 3, kHigh = 2;
  ExpectMotion({.states = {{"x", "if(x*if(t > start, 3, 1) < 2, 1, -1)"}}, .outputs = {{"x", "x"}}},
               "start", {0.33, 0.5, 1, 1.234, 1.9, 3}, 6, 0.1, kAccumulated,
               [](double t, double start) {
                 if (start < kLow) return std::min(t, kLow);
                 const double top = std::min(t, std::min(start, kHigh));
                 return t < start ? top : std::max(top - (t - start), kLow);
               });
  ExpectMotion({.states = {{"x", "if(x*if(t > start, 1, 3) < 2, 1, -1)"}}, .outputs = {{"x", "x"}}},
               "start", {0.33, 0.5, 1, 1.234, 1.9, 3}, 6, 0.1, kAccumulated,
               [](double t, double start) {
                 const double low = std::min(t, std::min(start, kLow));
                 return t < start ? low : std::min(low + (t - start), kHigh);
               });
}

TEST(Switching, EmptiesATankWhoseOutflowEndsAtZero) {
  // √x is undefined beyond.
  ExpectMotion({.states = {{"x", "-c*if(x > 0, sqrt(x), 0)"}},
                .outputs = {{"x", "x"}},
                .parameters = {{"x_0", 1.0}}},
               "c", Evenly(0.5, 2, 5), 6, 0.1, 1e-6, [](double t, double c) {
                 const double root = std::max(0.0, 1 - c * t / 2);
                 return root * root;
               });
}

// At rest on the surface until t = 1, the argument then leaves it as (t − 1)³, upwards or
// downwards.
TEST(Switching, LeavesASurfaceAtWhichItRested) {
  ExpectMotion({.states = {{"a", "s*max(t - 1, 0)"}, {"b", "a"}, {"y", "if(b > 0, 3*b, 2*b)"}},
                .outputs = {{"y", "y"}}},
               "s", {-30, -7, -1, -0.3, -0.01, 0.01, 0.7, 1, 3, 11}, 3, 0.25, 30 * kAccumulated,
               [](double t, double s) {
                 return (s > 0 ? 3 : 2) * s * std::pow(std::max(t - 1, 0.0), 4) / 24;
               });
}

// A car at rest comes to a bump, whose slope jumps at its beginning. With the same coefficient on
// both sides its damper is linear, and the oracle is the linear model.
TEST(Switching, LeavesTheRestOfACarBeforeABump) {
  const auto travel = [](const std::string& damper) {
    const std::string strut = "(ks*(zs - zu) + " + damper + ")";
    EquationSpecification car;
    car.states = {{"zs", "vs"},
                  {"vs", "-" + strut + "/300"},
                  {"zu", "vu"},
                  {"vu", "(" + strut + " + 190000*(road - zu))/40"}};
    car.intermediates = {{"rate", "vs - vu"}, {"road", "0.05*max(min(t - 1, 1.2 - t), 0)"}};
    car.outputs = {{"travel", "zs - zu"}};
    car.parameters = {{"c", 1500}};
    return Propagated(car, "ks", Evenly(12'000, 24'000, 8), TimesUntil(2, 0.05));
  };
  const Matrix switching = travel("if(rate > 0, c*rate, c*rate)"), linear = travel("c*rate");
  EXPECT_LE((switching - linear).cwiseAbs().maxCoeff(),
            kAccumulated * linear.cwiseAbs().maxCoeff());
  EXPECT_GT(linear.cwiseAbs().maxCoeff(), 1e-3);
}

// The half swings of ẍ = −sign x − 0.3 sign ẋ shorten by √(7/13) each, so that there are infinitely
// many before t = (1/0.7 + 1/1.3) √1.4 ÷ (1 − √(7/13)) = 9.7689.
TEST(Switching, NamesAnEndlessSequence) {
  Equations twisting({.states = {{"x", "v"}, {"v", "-sign(x) - c*sign(v)"}},
                      .outputs = {{"x", "x"}},
                      .parameters = {{"x_0", 1.0}, {"c", 0.3}}},
                     20, {"x"});
  for (int point = 0; point < 20; ++point) twisting.ensemble.Set("c", point, 0);
  const std::vector<double> times_s = TimesUntil(12, 0.1);
  const Matrix without = twisting.ensemble.Propagate(times_s);
  EXPECT_TRUE(twisting.ensemble.failures.empty());
  twisting.ensemble.Set("c", 3, 0.3);
  const Matrix y = twisting.ensemble.Propagate(times_s);
  ASSERT_EQ(twisting.ensemble.failures.size(), 1u);
  const PointFailure& failure = twisting.ensemble.failures[0];
  EXPECT_EQ(failure.point, 3);
  EXPECT_EQ(failure.reason, "switchings follow one another without end");
  const double ratio = std::sqrt(7.0 / 13);
  const double end_s = (1 / 0.7 + 1 / 1.3) * std::sqrt(1.4) / (1 - ratio);
  EXPECT_NEAR(failure.time_s, end_s, 0.11);  // the sample before
  EXPECT_LT(failure.time_s, end_s);
  // The restart of the others costs no more than their tolerance.
  EXPECT_NEAR(y(4, y.cols() - 1), without(4, y.cols() - 1), 300 * 1e-7);
}
}  // namespace
}  // namespace polyest::internal
