// Tests trajectories with dry friction, which slide, stick and break loose. The oracles are closed
// forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/unit/core/propagation/switching_equations.h"

namespace polyest::internal {
namespace {

using std::numbers::pi;

Equations DryFriction(int points) {
  Equations equations({.states = {{"x", "v"}, {"v", "u - (k*x + fc*sign(v))"}},
                       .outputs = {{"x", "x"}, {"v", "v"}, {"a", "u - (k*x + fc*sign(v))"}},
                       .parameters = {{"x_0", 1.0}, {"k", 40.0}, {"fc", 1.5}},
                       .inputs = {"u"}},
                      points, {"x", "v", "a"});
  for (int point = 0; point < points; ++point) {
    equations.ensemble.Set("k", point, 30 + 20 * std::fmod(0.618 * point, 1));
    equations.ensemble.Set("fc", point, 0.5 + 2.5 * std::fmod(0.414 * point, 1));
  }
  return equations;
}

struct Motion {
  double x, v, a;
};

// The oscillation with dry friction from x = 1 at rest: half cosines about ±f/k, whose amplitude
// falls by 2 f/k each, until |x| ≤ f/k at the end of one.
Motion Coulomb(double t, double k, double f) {
  const double w = std::sqrt(k);
  const double d = f / k;
  const double halves = std::max(0.0, std::ceil((1 - d) / (2 * d)));
  const double half = std::floor(w * t / pi);
  if (half >= halves) return {(std::fmod(halves, 2) == 0 ? 1 : -1) * (1 - 2 * d * halves), 0, 0};
  const double phase = w * t - half * pi;
  const double side = std::fmod(half, 2) == 0 ? 1 : -1;
  const double amplitude = 1 - d - 2 * d * half;
  return {side * (amplitude * std::cos(phase) + d), -side * amplitude * w * std::sin(phase),
          -side * amplitude * w * w * std::cos(phase)};
}

TEST(SwitchingFriction, HoldsAMassThatDryFrictionStops) {
  const std::vector<double> times_s = TimesUntil(20, 0.05);
  for (const double tolerance : {1e-5, 1e-7, 1e-10}) {
    Equations friction = DryFriction(70);
    friction.ensemble.specification.integration.relative_tolerance = tolerance;
    const Matrix y = friction.ensemble.Propagate(times_s);
    ASSERT_TRUE(friction.ensemble.failures.empty()) << friction.ensemble.failures[0].reason;
    double worst = 0;
    for (Eigen::Index point = 0; point < 70; ++point) {
      for (size_t i = 0; i < times_s.size(); ++i) {
        const Motion exact = Coulomb(times_s[i], friction.At(point, "k"), friction.At(point, "fc"));
        const auto column = static_cast<Eigen::Index>(3 * i);
        worst = std::max(worst, std::abs(y(point, column) - exact.x));
        worst = std::max(worst, std::abs(y(point, column + 1) - exact.v) / 7);
      }
    }
    EXPECT_LT(worst, 300 * tolerance);
  }
}

// Returns the root of an increasing function between two times.
template <class Function>
double Root(double from, double until, const Function& function) {
  for (int i = 0; i < 100; ++i) {
    const double middle = (from + until) / 2;
    (function(middle) < 0 ? from : until) = middle;
  }
  return from;
}

// A mass of 1 on dry friction of 1 under the force F sin 2t, from rest.
class ForcedFriction {
 public:
  explicit ForcedFriction(double force) : force_(force) {}
  // Returns the velocity at t, which must not decrease from call to call.
  double Velocity(double t) {
    while (t > until_) Next();
    return side_ == 0 ? 0 : Sliding(t);
  }
  bool sticks_again() const { return sticks_again_; }

 private:
  static constexpr double kW = 2;
  double Force(double t) const { return force_ * std::sin(kW * t); }
  double Sliding(double t) const {
    return force_ / kW * (std::cos(kW * from_) - std::cos(kW * t)) - side_ * (t - from_);
  }
  // Ends the present phase; a sliding one ends where the velocity has come back to 0.
  void Next() {
    from_ = until_;
    if (side_ == 0 || std::abs(Force(from_)) > 1) {
      side_ = Force(from_) > 0 ? 1 : -1;
      double slow = from_;
      do slow += 1e-3;
      while (side_ * Sliding(slow) > 0);
      until_ = Root(slow - 1e-3, slow, [this](double t) { return -side_ * Sliding(t); });
    } else {
      side_ = 0;
      sticks_again_ = sticks_again_ || from_ > 0;
      double strong = from_;
      do strong += 1e-3;
      while (std::abs(Force(strong)) <= 1);
      until_ = Root(strong - 1e-3, strong, [this](double t) { return std::abs(Force(t)) - 1; });
    }
  }

  double force_;
  double side_ = 1;
  double from_ = 0, until_ = 0;
  bool sticks_again_ = false;
};

TEST(SwitchingFriction, BreaksLooseWhereTheForceExceedsTheFriction) {
  const std::vector<double> forces = Evenly(1.05, 3, 12);
  for (const double sample_s : {0.1, 2.0}) {
    const std::vector<double> sampled_s = TimesUntil(20, sample_s);
    const Matrix v =
        Propagated({.states = {{"v", "f*sin(2*t) - sign(v)"}}, .outputs = {{"v", "v"}}}, "f",
                   forces, sampled_s);
    int sticking = 0;
    for (Eigen::Index point = 0; point < v.rows(); ++point) {
      ForcedFriction exact(forces[static_cast<size_t>(point)]);
      for (Eigen::Index i = 0; i < v.cols(); ++i) {
        const double t = sampled_s[static_cast<size_t>(i)];
        ASSERT_NEAR(v(point, i), exact.Velocity(t), kAccumulated) << t << " point " << point;
      }
      sticking += exact.sticks_again() ? 1 : 0;
    }
    EXPECT_GT(sticking, 2);
    EXPECT_LT(sticking, 12);
  }
}

TEST(SwitchingFriction, RidesOnABeltWhoseSpeedIsMeasured) {
  Equations belt({.states = {{"x", "v"}, {"v", "-k*x - fc*sign(v - belt)"}},
                  .outputs = {{"x", "x"}, {"v", "v"}, {"a", "-k*x - fc*sign(v - belt)"}},
                  .parameters = {{"k", 4.0}, {"fc", 1.0}},
                  .inputs = {"belt"}},
                 3, {"x", "v", "a"});
  belt.ensemble.Drive("belt", TableInput{{0, 10}, {0, 2}, Interpolation::kLinear}, 1);
  belt.ensemble.specification.integration.relative_tolerance = 1e-9;
  const std::vector<double> times_s = TimesUntil(2.4, 0.1);
  const Matrix y = belt.ensemble.Propagate(times_s);
  ASSERT_TRUE(belt.ensemble.failures.empty()) << belt.ensemble.failures[0].reason;
  // At first the belt is slower than friction accelerates the mass, which is carried along from the
  // beginning: x = 0.1 t² until the friction k x + 0.2 reaches 1, then it swings about x = ¼.
  const double loose_s = std::sqrt(0.8 / 4 / 0.1);
  for (size_t i = 0; i < times_s.size(); ++i) {
    const double t = times_s[i];
    const double s = t - loose_s;
    const double u = 0.2 * loose_s;
    const bool carried = t < loose_s;
    const double x =
        carried ? 0.1 * t * t : 0.25 - 0.05 * std::cos(2 * s) + u / 2 * std::sin(2 * s);
    const double v = carried ? 0.2 * t : 0.1 * std::sin(2 * s) + u * std::cos(2 * s);
    const double a = carried ? 0.2 : 0.2 * std::cos(2 * s) - 2 * u * std::sin(2 * s);
    const auto column = static_cast<Eigen::Index>(3 * i);
    EXPECT_NEAR(y(0, column), x, kAccumulated) << t;
    EXPECT_NEAR(y(0, column + 1), v, kAccumulated) << t;
    EXPECT_NEAR(y(0, column + 2), a, 10 * kAccumulated) << t;
  }
}

// A block of mass 1 lies on another of mass 2 that lies on the ground and is pulled with u = t.
// Both rest until t = f; then they go together until friction g can no longer carry the upper one,
// at (t − f)/3 = g.
TEST(SwitchingFriction, HoldsSeveralBlocksAtOnce) {
  Equations blocks({.states = {{"x1", "v1"},
                               {"v1", "(u - f*sign(v1) - g*sign(v1 - v2))/2"},
                               {"x2", "v2"},
                               {"v2", "g*sign(v1 - v2)"}},
                    .outputs = {{"x1", "x1"}, {"x2", "x2"}},
                    .parameters = {{"f", 1.0}, {"g", 0.5}},
                    .inputs = {"u"}},
                   9, {"x1", "x2"});
  for (int point = 0; point < 9; ++point) {
    blocks.ensemble.Set("f", point, 0.5 + 0.1 * point);
    blocks.ensemble.Set("g", point, 1 - 0.08 * point);
  }
  blocks.ensemble.Drive("u", TableInput{{0, 10}, {0, 10}, Interpolation::kLinear}, 1);
  blocks.ensemble.specification.integration.relative_tolerance = 1e-9;
  const std::vector<double> times_s = TimesUntil(6, 0.1);
  const Matrix y = blocks.ensemble.Propagate(times_s);
  ASSERT_TRUE(blocks.ensemble.failures.empty()) << blocks.ensemble.failures[0].reason;
  for (Eigen::Index point = 0; point < 9; ++point) {
    const double f = blocks.At(point, "f"), g = blocks.At(point, "g");
    for (size_t i = 0; i < times_s.size(); ++i) {
      const double s = std::max(0.0, times_s[i] - f);
      const double p = std::min(s, 3 * g), r = s - p;
      const double speed = p * p / 6, together = p * p * p / 18;
      // Afterwards the accelerations are (s − g)/2 below and g above.
      const double x1 = together + speed * r + (p - g) * r * r / 4 + r * r * r / 12;
      const double x2 = together + speed * r + g * r * r / 2;
      const auto column = static_cast<Eigen::Index>(2 * i);
      EXPECT_NEAR(y(point, column), x1, 10 * kAccumulated) << times_s[i];
      EXPECT_NEAR(y(point, column + 1), x2, 10 * kAccumulated) << times_s[i];
    }
  }
}

// Two blocks with friction on the ground and between them. The three frictions hold two velocities,
// so that it is open how they share the load, but the motion is not.
TEST(SwitchingFriction, RestsWhereMoreFrictionsHoldThanThereAreMasses) {
  Equations blocks({.states = {{"x1", "v1"},
                               {"v1", "-k*(x1 - x2) - f*sign(v1) - g*sign(v1 - v2)"},
                               {"x2", "v2"},
                               {"v2", "k*(x1 - x2) - f*sign(v2) + g*sign(v1 - v2)"}},
                    .outputs = {{"x1", "x1"},
                                {"x2", "x2"},
                                {"a1", "-k*(x1 - x2) - f*sign(v1) - g*sign(v1 - v2)"}},
                    .parameters = {{"k", 10.0}, {"f", 1.0}, {"g", 0.5}, {"x1_0", 0.1}}},
                   8, {"x1", "x2", "a1"});
  for (int point = 0; point < 8; ++point) blocks.ensemble.Set("x1_0", point, 0.05 + 0.05 * point);
  blocks.ensemble.specification.integration.relative_tolerance = 1e-9;
  const std::vector<double> times_s = TimesUntil(3, 0.1);
  const Matrix y = blocks.ensemble.Propagate(times_s);
  ASSERT_TRUE(blocks.ensemble.failures.empty()) << blocks.ensemble.failures[0].reason;
  for (Eigen::Index point = 0; point < 8; ++point) {
    // The blocks move towards each other by symmetry: d = x1 − x2 obeys d̈ = −2 k d + 2 f + 2 g in
    // the first half swing and then rests, as k |d| ≤ f + g for all that start at d ≤ 0.4.
    const double start = blocks.At(point, "x1_0");
    const double centre = (1 + 0.5) / 10;
    const double w = std::sqrt(20.0);
    for (size_t i = 0; i < times_s.size(); ++i) {
      const double t = std::min(times_s[i], pi / w);
      const bool moves = start > centre;
      const double d = moves ? centre + (start - centre) * std::cos(w * t) : start;
      const double a = moves && times_s[i] < pi / w ? -10 * (d - centre) : 0;
      const auto column = static_cast<Eigen::Index>(3 * i);
      EXPECT_NEAR(y(point, column), (start + d) / 2, kAccumulated) << times_s[i];
      EXPECT_NEAR(y(point, column + 1), (start - d) / 2, kAccumulated) << times_s[i];
      EXPECT_NEAR(y(point, column + 2), a, 100 * kAccumulated) << times_s[i];
    }
  }
}

TEST(SwitchingFriction, GivesTheSameBitsForAnyThreadsAndCutOfTheTimes) {
  const std::vector<double> times_s = TimesUntil(8, 0.1);
  Equations friction = DryFriction(150);
  friction.ensemble.Drive("u", SinusoidInput{1, 0.7, 0.3}, 2);
  const Matrix one = friction.ensemble.Propagate(times_s);
  friction.ensemble.specification.threads = 3;
  EXPECT_EQ(friction.ensemble.Propagate(times_s), one);
  EnsemblePropagator propagator(friction.ensemble.specification, &friction.ensemble.inputs);
  for (size_t i = 0; i < times_s.size(); ++i) {
    EXPECT_EQ(friction.ensemble.Advance(propagator, {times_s[i]}),
              one.middleCols(static_cast<Eigen::Index>(3 * i), 3));
  }
}
}  // namespace
}  // namespace polyest::internal
