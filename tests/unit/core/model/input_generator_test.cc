// Tests that input signals solve their linear systems. The oracle is the signal's own shape.

#include "core/model/input_generator.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

namespace polyest::internal {
namespace {

const std::vector<double> kTimes = {0.3, 0.5, 0.9, 1.0, 1.6, 2.2};
const std::vector<double> kValues = {1, -2, 0.5, 3, 3, -1};

std::vector<InputSpecification> Signals() {
  std::vector<InputSpecification> signals = {ConstantInput{2}, StepInput{1, 0.7},
                                             SinusoidInput{1, 1.3, 0.4},
                                             HalfSineBumpInput{1, 0.6, 0.9}};
  for (const Interpolation curve : {Interpolation::kHold, Interpolation::kLinear,
                                    Interpolation::kCubic, Interpolation::kShapePreserving}) {
    signals.push_back(TableInput{kTimes, kValues, curve});
  }
  return signals;
}

// Returns w_0(τ) of w' = J w by Taylor's series, whose terms are negligible after 30 for |J τ| ≤ 2.
double Follow(const Matrix& J, Vector w, double tau) {
  double value = w[0];
  for (int j = 1; j <= 30; ++j) {
    w = tau / j * (J * w);
    value += w[0];
  }
  return value;
}

TEST(InputGenerator, FollowsTheShapeUpToTheNextKnot) {
  for (const InputSpecification& specification : Signals()) {
    const InputSignal signal = *InputSignal::Make(specification);
    const Matrix J = GeneratorMatrix(signal);
    Vector w(GeneratorSize(signal));
    ASSERT_GT(w.size(), 0);
    for (double start_s = 0; start_s < 2.5; start_s += 0.1) {
      GeneratorState(signal, start_s, {w.data(), static_cast<size_t>(w.size())});
      EXPECT_NEAR(w[0], signal.Shape(start_s), 1e-14);
      const double end_s = std::min(signal.NextKnot(start_s), start_s + 0.2);
      if (end_s - start_s < 1e-9) continue;  // a knot that only the rounding of start_s misses
      for (const double share : {0.1, 0.6, 0.99}) {
        const double tau = share * (end_s - start_s);
        EXPECT_NEAR(Follow(J, w, tau), signal.Shape(start_s + tau), 1e-13)
            << specification.index() << " " << start_s << " " << tau;
      }
    }
  }
}

TEST(InputGenerator, IsThatOnTheRightOfAKnot) {
  const InputSignal held = *InputSignal::Make(TableInput{kTimes, kValues, Interpolation::kHold});
  const InputSignal line = *InputSignal::Make(TableInput{kTimes, kValues, Interpolation::kLinear});
  std::array<double, 2> w{};
  GeneratorState(held, 0.5, {w.data(), 1});
  EXPECT_EQ(w[0], -2);
  GeneratorState(line, 0.5, w);
  EXPECT_EQ(w[0], -2);
  EXPECT_NEAR(w[1], 2.5 / 0.4, 1e-14);
  GeneratorState(line, 2.2, w);
  EXPECT_EQ(w[0], -1);
  EXPECT_EQ(w[1], 0);
}

TEST(InputGenerator, DoesNotExistForAChirp) {
  EXPECT_EQ(GeneratorSize(*InputSignal::Make(ChirpInput{})), 0);
}

TEST(InputSignalKnots, IncludeThoseOfSmoothCurves) {
  const InputSignal cubic = *InputSignal::Make(TableInput{kTimes, kValues, Interpolation::kCubic});
  EXPECT_EQ(cubic.NextKnot(0), 0.3);
  EXPECT_EQ(cubic.NextKnot(0.3), 0.5);
  EXPECT_EQ(cubic.NextBreak(0.3), 2.2);
  EXPECT_EQ(cubic.NextKnot(2.2), kInfinity);
  const InputSignal bump = *InputSignal::Make(HalfSineBumpInput{1, 0.5, 0.25});
  EXPECT_EQ(bump.NextKnot(0), 0.5);
  EXPECT_EQ(bump.NextKnot(0.5), 0.75);
}

}  // namespace
}  // namespace polyest::internal
