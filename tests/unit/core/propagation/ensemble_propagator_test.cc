#include "core/propagation/ensemble_propagator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stop_token>
#include <vector>

#include "tests/unit/core/propagation/ensemble.h"
#include "tests/unit/core/propagation/oscillator.h"

namespace polyest::internal {
namespace {

// The bound on the global error relative to the amplitude, in tolerances. A step adds at most the
// tolerance, relative to each state's own amplitude, to displacement and velocity. The free motion
// does not magnify it, and no test here takes more than 500 steps.
constexpr double kMaxErrorsInTolerances = 1000;

// Makes oscillators of 0.8 to 1 Hz, lightly damped; every third one starts at x = 0.
Oscillator Slow(int point) {
  return {1 + 0.003 * point, 0.1 + 0.002 * point, 30.0 + 0.1 * point, point % 3 == 0 ? 0.0 : 1.0,
          1.0};
}

void Set(Ensemble& ensemble, int point, const Oscillator& oscillator) {
  ensemble.Set("m", point, oscillator.m);
  ensemble.Set("c", point, oscillator.c);
  ensemble.Set("k", point, oscillator.k);
  ensemble.Set("x0", point, oscillator.x0);
  ensemble.Set("v0", point, oscillator.v0);
}

Ensemble SlowOscillators(int points, double tolerance) {
  Ensemble ensemble("mass_spring_damper", points, {"x"});
  for (int point = 0; point < points; ++point) Set(ensemble, point, Slow(point));
  ensemble.specification.integration.relative_tolerance = tolerance;
  // Linear models are stepped exactly otherwise (exact_stepping_test.cc).
  ensemble.specification.integration.method = IntegrationMethod::kExplicit;
  return ensemble;
}

double ErrorOfSlowPoint(const Matrix& x, int point, const std::vector<double>& times_s) {
  double worst = 0;
  for (size_t i = 0; i < times_s.size(); ++i) {
    worst = std::max(worst, std::abs(x(point, i) - Slow(point).Free(times_s[i])));
  }
  return worst;
}

double WorstErrorOfSlow(const Matrix& x, const std::vector<double>& times_s) {
  double worst = 0;
  for (int point = 0; point < x.rows(); ++point) {
    worst = std::max(worst, ErrorOfSlowPoint(x, point, times_s));
  }
  return worst;
}

TEST(EnsemblePropagator, FollowsTheClosedFormOfDampedOscillatorsWithinItsTolerance) {
  const std::vector<double> times_s = TimesUntil(5, 0.05);
  for (const double tolerance : {1e-4, 1e-7, 1e-10}) {
    Ensemble ensemble = SlowOscillators(20, tolerance);
    const double error = WorstErrorOfSlow(ensemble.Propagate(times_s), times_s);
    EXPECT_LT(error, kMaxErrorsInTolerances * tolerance);
    EXPECT_GT(error, 0);
  }
}

TEST(EnsemblePropagator, GainsAccuracyInProportionToTheTolerance) {
  const std::vector<double> times_s = TimesUntil(5, 0.05);
  const auto error = [&](double tolerance) {
    Ensemble ensemble = SlowOscillators(8, tolerance);
    return WorstErrorOfSlow(ensemble.Propagate(times_s), times_s);
  };
  // The local errors are proportional to the tolerance, the steps to its fifth root.
  EXPECT_LT(error(1e-8), 1e-2 * error(1e-5));
  EXPECT_LT(error(1e-11), 1e-2 * error(1e-8));
}

TEST(EnsemblePropagator, TreatsEachPointOfAnyNumberAlike) {
  const std::vector<double> times_s = TimesUntil(2, 0.1);
  for (const int points : {1, 7, 8, 9, 64, 65}) {
    Ensemble ensemble = SlowOscillators(points, 1e-8);
    EXPECT_LT(WorstErrorOfSlow(ensemble.Propagate(times_s), times_s), kMaxErrorsInTolerances * 1e-8)
        << points;
  }
}

TEST(EnsemblePropagator, GivesTheSameBitsForAnyCutOfTheTimes) {
  const std::vector<double> times_s = TimesUntil(3, 0.07);
  Ensemble ensemble = SlowOscillators(20, 1e-7);
  ensemble.Drive("force", StepInput{1, 1.0}, 3.0);
  const Matrix at_once = ensemble.Propagate(times_s);
  EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
  Matrix in_pieces(20, 0);
  for (size_t first = 0, count = 1; first < times_s.size(); first += count, ++count) {
    const size_t end = std::min(first + count, times_s.size());
    const Matrix piece =
        ensemble.Advance(propagator, {times_s.begin() + first, times_s.begin() + end});
    in_pieces.conservativeResize(20, in_pieces.cols() + piece.cols());
    in_pieces.rightCols(piece.cols()) = piece;
    count = end - first;
  }
  EXPECT_EQ(at_once, in_pieces);
}

TEST(EnsemblePropagator, GivesTheSameBitsForAnyNumberOfThreads) {
  const std::vector<double> times_s = TimesUntil(1, 0.05);
  Ensemble ensemble = SlowOscillators(150, 1e-7);
  const Matrix alone = ensemble.Propagate(times_s);
  for (const int threads : {2, 3}) {
    ensemble.specification.threads = threads;
    EXPECT_EQ(ensemble.Propagate(times_s), alone) << threads;
  }
}

TEST(EnsemblePropagator, ReadsTheInitialStateAtTimeZero) {
  Ensemble ensemble = SlowOscillators(9, 1e-7);
  const Matrix x = ensemble.Propagate({0, 0, 0});
  for (int point = 0; point < 9; ++point) {
    for (int i = 0; i < 3; ++i) EXPECT_EQ(x(point, i), Slow(point).x0);
  }
}

TEST(EnsemblePropagator, IntegratesUpToAJumpWithTheLeftAndFromItWithTheRightValue) {
  const Oscillator oscillator{2, 0, 50, 0, 0};
  const double w = std::sqrt(oscillator.k / oscillator.m);
  const double jump_s = 0.73;
  const double force_n = 10;
  for (const IntegrationMethod method : {IntegrationMethod::kExplicit, IntegrationMethod::kStiff}) {
    Ensemble ensemble("mass_spring_damper", 3, {"x", "a"});
    for (int point = 0; point < 3; ++point) Set(ensemble, point, oscillator);
    ensemble.Drive("force", StepInput{1, jump_s}, force_n);
    ensemble.specification.integration.relative_tolerance = 1e-9;
    ensemble.specification.integration.method = method;
    const std::vector<double> times_s{0.5, std::nextafter(jump_s, 0.0), jump_s, 0.9, 2.5};
    const Matrix y = ensemble.Propagate(times_s);
    EXPECT_TRUE(ensemble.failures.empty());
    for (size_t i = 0; i < times_s.size(); ++i) {
      // The response from t* on is x = F/k (1 − cos ω(t − t*)), ẍ = F/m cos ω(t − t*).
      const double tau = times_s[i] - jump_s;
      const double x = tau < 0 ? 0 : force_n / oscillator.k * (1 - std::cos(w * tau));
      const double a = tau < 0 ? 0 : force_n / oscillator.m * std::cos(w * tau);
      // A wrong input over part of the one step at the jump would show as 1e-3.
      EXPECT_NEAR(y(1, 2 * i), x, 1e-6) << times_s[i];
      EXPECT_NEAR(y(1, 2 * i + 1), a, 2e-5) << times_s[i];
    }
  }
}

TEST(EnsemblePropagator, SeesABumpFromRestHoweverFewTheSamples) {
  const Oscillator oscillator{2, 0, 50, 0, 0};
  const double w = std::sqrt(oscillator.k / oscillator.m);
  const double big_w = std::numbers::pi / 0.2;
  // The response under the bump is x = F (sin Ωτ − Ω/ω sin ωτ)/(m (ω² − Ω²)). After it, the
  // responses that start at both ends add.
  const auto response = [&](double tau) {
    return tau < 0 ? 0
                   : 10 * (std::sin(big_w * tau) - big_w / w * std::sin(w * tau)) /
                         (oscillator.m * (w * w - big_w * big_w));
  };
  for (const IntegrationMethod method : {IntegrationMethod::kExplicit, IntegrationMethod::kStiff}) {
    for (const double step_s : {0.02, 0.7, 1.4}) {
      Ensemble ensemble("mass_spring_damper", 1, {"x"});
      Set(ensemble, 0, oscillator);
      ensemble.Drive("force", HalfSineBumpInput{1, 0.5, 0.2}, 10);
      ensemble.specification.integration.relative_tolerance = 1e-8;
      ensemble.specification.integration.method = method;
      const std::vector<double> times_s = TimesUntil(1.4, step_s);
      const Matrix x = ensemble.Propagate(times_s);
      for (size_t i = 0; i < times_s.size(); ++i) {
        // A half sine is a sine from its beginning plus the same sine from its end.
        const double tau = times_s[i] - 0.5;
        const double exact = tau <= 0.2 ? response(tau) : response(tau) + response(tau - 0.2);
        EXPECT_NEAR(x(0, i), exact, 1e-6) << times_s[i];
      }
    }
  }
}

class StreamedForce : public ::testing::TestWithParam<bool> {
 protected:
  StreamedForce() : ensemble_("mass_spring_damper", 10, {"x"}) {
    for (int i = 0; i <= 60; ++i) {
      time_s_.push_back(0.05 * i + 0.01 * (i % 3));
      value_.push_back(std::sin(1.7 * i) * 20);
    }
    time_s_[0] = 0;
    for (int point = 0; point < 10; ++point) Set(ensemble_, point, oscillator_);
    ensemble_.Drive(
        "force", StreamedInput{GetParam() ? Interpolation::kHold : Interpolation::kLinear, 1}, 1.0);
    ensemble_.specification.integration.relative_tolerance = 1e-9;
    ensemble_.specification.integration.method = IntegrationMethod::kExplicit;
  }
  Matrix KnotByKnot() {
    EnsemblePropagator propagator(ensemble_.specification, &ensemble_.inputs);
    Matrix x(10, time_s_.size());
    for (size_t i = 0; i < time_s_.size(); ++i) {
      ensemble_.inputs[0].Append(time_s_[i], value_[i]);
      x.col(i) = ensemble_.Advance(propagator, {time_s_[i]});
    }
    return x;
  }

  const Oscillator oscillator_{1, 0, 40, 0.1, 0.5};
  std::vector<double> time_s_;
  std::vector<double> value_;
  Ensemble ensemble_;
};

TEST_P(StreamedForce, GivesTheClosedFormThroughItsKnots) {
  const Matrix x = KnotByKnot();
  const std::vector<double> exact = oscillator_.ThroughKnots(time_s_, value_, GetParam());
  for (size_t i = 0; i < time_s_.size(); ++i) EXPECT_NEAR(x(3, i), exact[i], 1e-6) << i;
}

TEST_P(StreamedForce, GivesTheSameBitsWhenAllKnotsAreKnownBefore) {
  const Matrix knot_by_knot = KnotByKnot();
  ensemble_.inputs[0].Clear();
  for (size_t i = 0; i < time_s_.size(); ++i) ensemble_.inputs[0].Append(time_s_[i], value_[i]);
  EXPECT_EQ(ensemble_.Propagate(time_s_), knot_by_knot);
}

INSTANTIATE_TEST_SUITE_P(LinearAndHeld, StreamedForce, ::testing::Bool());

TEST(EnsemblePropagator, KeepsTheAccuracyOfOneFastPointAmongManySlowOnes) {
  const Oscillator fast{1, 0, 3600, 1, 0};
  const std::vector<double> times_s = TimesUntil(1, 0.05);
  for (const double tolerance : {1e-6, 1e-9}) {
    Ensemble ensemble = SlowOscillators(64, tolerance);
    Set(ensemble, 40, fast);
    const Matrix x = ensemble.Propagate(times_s);
    for (size_t i = 0; i < times_s.size(); ++i) {
      EXPECT_NEAR(x(40, i), fast.Free(times_s[i]), kMaxErrorsInTolerances * tolerance);
    }
  }
}

TEST(EnsemblePropagator, KeepsThePointsOfSmallAmplitudeAsAccurateAsTheOthers) {
  // The amplitude is a hundredth of the others'. If all points shared one largest magnitude, errors
  // a hundred times as large in proportion would pass.
  Ensemble ensemble = SlowOscillators(8, 1e-6);
  const Oscillator small{1, 0, 400, 0.01, 0};
  Set(ensemble, 5, small);
  const std::vector<double> times_s = TimesUntil(5, 0.05);
  const Matrix x = ensemble.Propagate(times_s);
  for (size_t i = 0; i < times_s.size(); ++i) {
    EXPECT_NEAR(x(5, i), small.Free(times_s[i]), 0.01 * kMaxErrorsInTolerances * 1e-6);
  }
}

// Tests a stiff oscillator: the fast mode decays in a microsecond, the slow one as e^{−t}.
class StiffOscillators : public ::testing::TestWithParam<IntegrationMethod> {};

TEST_P(StiffOscillators, AreFollowedInFewSteps) {
  // A spring that is not linear by 1e-12 of its force is integrated and not stepped exactly.
  Ensemble ensemble("duffing", 12, {"x"});
  ensemble.Set("k3", 1e-6);
  std::vector<Oscillator> oscillators;
  for (int point = 0; point < 12; ++point) {
    oscillators.push_back({1, 1e6 * (1 + point), 1e6 * (1 + 1.1 * point), 1, 0});
    Set(ensemble, point, oscillators.back());
  }
  ensemble.specification.integration.method = GetParam();
  // An explicit method needs t c/(3.3 m) ≈ 18 million steps.
  ensemble.specification.integration.max_steps = 5000;
  const std::vector<double> times_s = TimesUntil(5, 0.5);
  const Matrix x = ensemble.Propagate(times_s);
  EXPECT_TRUE(ensemble.failures.empty());
  for (int point = 0; point < 12; ++point) {
    for (size_t i = 0; i < times_s.size(); ++i) {
      EXPECT_NEAR(x(point, i), oscillators[point].Free(times_s[i]), kMaxErrorsInTolerances * 1e-7);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(StiffAndAuto, StiffOscillators,
                         ::testing::Values(IntegrationMethod::kStiff, IntegrationMethod::kAuto));

TEST(EnsemblePropagator, FollowsTheClosedFormWithTheStiffMethodToo) {
  const std::vector<double> times_s = TimesUntil(5, 0.05);
  Ensemble ensemble = SlowOscillators(20, 1e-8);
  ensemble.specification.integration.method = IntegrationMethod::kStiff;
  EXPECT_LT(WorstErrorOfSlow(ensemble.Propagate(times_s), times_s), kMaxErrorsInTolerances * 1e-8);
}

TEST(EnsemblePropagator, EvaluatesAnAlgebraicModel) {
  Ensemble ensemble("mass_spring_frequency", 3, {"omega"});
  ensemble.Set("k", 1, 800.0);
  ensemble.Set("m", 1, 2.0);
  const Matrix omega = ensemble.Propagate({0, 1.5});
  EXPECT_DOUBLE_EQ(omega(1, 0), 20);
  EXPECT_DOUBLE_EQ(omega(1, 1), 20);
  EXPECT_DOUBLE_EQ(omega(2, 0), 2 * std::numbers::pi);
}

TEST(EnsemblePropagator, StopsOnRequest) {
  Ensemble ensemble = SlowOscillators(8, 1e-7);
  EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
  std::stop_source source;
  source.request_stop();
  Matrix x(8, 1);
  const std::vector<double> times_s{1.0};
  EXPECT_EQ(propagator.Advance(times_s, x, Stop(source.get_token())).code(),
            absl::StatusCode::kCancelled);
}

TEST(IntegrationOptions, NameTheValueThatIsWrong) {
  IntegrationOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.relative_tolerance = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(options.Validate().message(), ::testing::HasSubstr("relative_tolerance: nan"));
  options = {};
  options.max_steps = 0;
  EXPECT_THAT(options.Validate().message(), ::testing::HasSubstr("max_steps: 0"));
}

}  // namespace
}  // namespace polyest::internal
