// Tests ensembles restored at a checkpoint. The oracle is the ensemble that was not interrupted.
// The restarts themselves are compared with the closed form.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "polyest/equation_model.h"
#include "tests/unit/core/propagation/ensemble.h"
#include "tests/unit/core/propagation/oscillator.h"

namespace polyest::internal::checkpoint_test {
namespace {

constexpr int kInterval = 10;
// How oscillators are propagated: a linear model is stepped exactly unless a method is asked for.
constexpr IntegrationMethod kExactAndExplicit[] = {IntegrationMethod::kAuto,
                                                   IntegrationMethod::kExplicit};

std::vector<double> Part(const std::vector<double>& times_s, size_t first, size_t end) {
  return {times_s.begin() + static_cast<std::ptrdiff_t>(first),
          times_s.begin() + static_cast<std::ptrdiff_t>(end)};
}

// Propagates to the checkpoint, then both onwards and from the restored state. Returns the state.
EnsembleState ExpectSameBitsAfter(Ensemble ensemble, size_t checkpoint, size_t end,
                                  double step_s = 0.1) {
  ensemble.specification.integration.samples_between_checkpoints = kInterval;
  const std::vector<double> times_s = TimesUntil(static_cast<double>(end) * step_s, step_s);
  EnsemblePropagator undisturbed(ensemble.specification, &ensemble.inputs);
  ensemble.Advance(undisturbed, Part(times_s, 0, checkpoint));
  const std::optional<EnsembleState> state = undisturbed.State();
  EXPECT_TRUE(state.has_value());
  if (!state) return {};
  EXPECT_EQ(state->samples, static_cast<int64_t>(checkpoint));
  EnsemblePropagator restored(ensemble.specification, &ensemble.inputs);
  EXPECT_TRUE(restored.Restore(*state));
  const std::vector<double> rest = Part(times_s, checkpoint, times_s.size());
  const Matrix a = ensemble.Advance(undisturbed, rest);
  const std::vector<PointFailure> failures = ensemble.failures;
  const Matrix b = ensemble.Advance(restored, rest);
  // The NaN of failed points must agree too.
  EXPECT_EQ(a.array().isNaN().cast<int>().matrix(), b.array().isNaN().cast<int>().matrix());
  EXPECT_TRUE(((a.array() == b.array()) || a.array().isNaN()).all());
  EXPECT_EQ(failures.size(), ensemble.failures.size());
  for (size_t i = 0; i < failures.size() && i < ensemble.failures.size(); ++i) {
    EXPECT_EQ(failures[i].point, ensemble.failures[i].point);
    EXPECT_EQ(failures[i].time_s, ensemble.failures[i].time_s);
    EXPECT_EQ(failures[i].reason, ensemble.failures[i].reason);
  }
  return *state;
}

Ensemble Oscillators(int points) {
  Ensemble ensemble("mass_spring_damper", points, {"x", "a"});
  ensemble.Set("m", 1);
  ensemble.Set("x0", 1);
  for (int point = 0; point < points; ++point) ensemble.Set("k", point, 30 + 0.1 * point);
  return ensemble;
}

// Makes springs whose potential has a ridge at x = 1; beyond it the motion reaches infinity.
Ensemble SofteningSprings(int points) {
  Ensemble ensemble("duffing", points, {"x"});
  ensemble.Set("c", 0);
  ensemble.Set("k3", -1);
  for (int point = 0; point < points; ++point) ensemble.Set("x0", point, 0.2 + 0.01 * point);
  return ensemble;
}

// Makes oscillators with x(t) = e^{−k t}, nearly, and a fast mode beside it.
Ensemble StiffOscillators() {
  Ensemble ensemble("duffing", 9, {"x"});
  ensemble.Set("k3", 1e-9);  // A linear model would be stepped exactly.
  ensemble.Set("m", 1e-6);
  ensemble.Set("c", 1);
  ensemble.Set("x0", 1);
  for (int point = 0; point < 9; ++point) ensemble.Set("k", point, 1 + 0.1 * point);
  return ensemble;
}

TEST(Checkpoint, LetsAnEnsembleGoOnToTheSameBits) {
  for (const IntegrationMethod method : kExactAndExplicit) {
    for (const int points : {1, 9, 70}) {
      for (const size_t checkpoint : {10U, 30U}) {
        Ensemble ensemble = Oscillators(points);
        ensemble.specification.integration.method = method;
        ExpectSameBitsAfter(ensemble, checkpoint, 60);
      }
    }
  }
}

TEST(Checkpoint, KeepsTheStiffMethodInUse) {
  Ensemble ensemble = StiffOscillators();
  const EnsembleState state = ExpectSameBitsAfter(ensemble, 20, 60);
  ASSERT_EQ(state.blocks.size(), 1u);
  EXPECT_TRUE(state.blocks[0].stiff);  // The integrator found this out on the way.
  ensemble.specification.integration.method = IntegrationMethod::kStiff;
  ensemble.Drive("force", HalfSineBumpInput{1, 2.5, 1}, 0.5);
  ExpectSameBitsAfter(ensemble, 20, 60);
}

TEST(Checkpoint, KeepsWhichPointsHaveFailed) {
  Ensemble ensemble = SofteningSprings(20);
  ensemble.Set("x0", 0, 2.5);   // fails before the checkpoint
  ensemble.Set("x0", 19, 2.0);  // fails before it too, and the padding copies it
  ensemble.Set("x0", 7, 1.01);  // fails after it
  const EnsembleState state = ExpectSameBitsAfter(ensemble, 20, 60);
  EXPECT_EQ(state.blocks[0].failures.size(), 2u);
  EXPECT_FALSE(state.blocks[0].alive[0]);
  EXPECT_TRUE(state.blocks[0].alive[7]);
  for (int point = 0; point < 20; ++point) ensemble.Set("x0", point, 3.0);
  ExpectSameBitsAfter(ensemble, 20, 60);  // All points fail.
}

TEST(Checkpoint, KeepsWhereTheInputsAre) {
  Ensemble ensemble = Oscillators(9);
  for (const IntegrationMethod method : kExactAndExplicit) {
    ensemble.specification.integration.method = method;
    for (const Interpolation curve : {Interpolation::kHold, Interpolation::kCubic}) {
      ensemble.Drive("force", TableInput{{0.5, 1.5, 2.5, 3.5}, {0, 1, -1, 2}, curve}, 3);
      ExpectSameBitsAfter(ensemble, 20, 60);
    }
  }
  ensemble.specification.input_delays_s.setZero(9, 1);
  for (int point = 0; point < 9; ++point) {
    ensemble.specification.input_delays_s(point, 0) = 0.07 * point;
  }
  ExpectSameBitsAfter(ensemble, 20, 60);
  ensemble.Drive("force", StepInput{1, 1.9}, 3);  // jumps exactly at the checkpoint
  ExpectSameBitsAfter(ensemble, 20, 60);
}

TEST(Checkpoint, KeepsWhichWayTheEquationsHaveSwitched) {
  const auto model = *MakeEquationModel({.states = {{"x", "v"}, {"v", "u - k*x - 3*sign(v)"}},
                                         .outputs = {{"x", "x"}, {"a", "u - k*x - 3*sign(v)"}},
                                         .parameters = {{"x_0", 1.0}, {"k", 20.0}},
                                         .inputs = {"u"}});
  Ensemble ensemble(model, 20, {"x", "a"});
  for (int point = 0; point < 20; ++point) ensemble.Set("k", point, 2 + point);
  EXPECT_EQ(ExpectSameBitsAfter(ensemble, 20, 60).blocks[0].modes.rows(), 24);
  // All stick at the checkpoint, where the velocity says nothing, and break loose later.
  ensemble.Drive("u", StepInput{1, 5}, 30);
  const EnsembleState state = ExpectSameBitsAfter(ensemble, 40, 60);
  EXPECT_TRUE((state.blocks[0].modes == 0).all()) << state.blocks[0].modes;
}

TEST(Checkpoint, IsThereOfModelsWithoutStatesToo) {
  Ensemble ensemble("mass_spring_frequency", 5, {"omega"});
  ExpectSameBitsAfter(ensemble, 20, 60);
}

TEST(Checkpoint, IsWhereTheIntervalSaysWhateverTheCutOfTheTimes) {
  const std::vector<double> times_s = TimesUntil(4, 0.1);
  Ensemble ensemble = Oscillators(9);
  const Matrix without = ensemble.Propagate(times_s);
  ensemble.specification.integration.samples_between_checkpoints = kInterval;
  const Matrix at_once = ensemble.Propagate(times_s);
  EXPECT_NE(at_once, without);
  EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
  EXPECT_FALSE(propagator.State().has_value());
  for (size_t i = 0; i < times_s.size(); ++i) {
    EXPECT_EQ(ensemble.Advance(propagator, {times_s[i]}),
              at_once.middleCols(static_cast<Eigen::Index>(2 * i), 2));
    EXPECT_EQ(propagator.State().has_value(), (i + 1) % kInterval == 0) << i;
  }
}

TEST(Checkpoint, CostsNoAccuracy) {
  const std::vector<double> times_s = TimesUntil(5, 0.05);
  for (const double tolerance : {1e-5, 1e-8}) {
    Ensemble ensemble = Oscillators(3);
    ensemble.specification.integration.method = IntegrationMethod::kExplicit;
    ensemble.specification.integration.relative_tolerance = tolerance;
    ensemble.specification.integration.samples_between_checkpoints = kInterval;
    const Matrix y = ensemble.Propagate(times_s);
    double worst = 0;
    for (size_t i = 0; i < times_s.size(); ++i) {
      const double x = Oscillator{1, 0, 30, 1, 0}.Free(times_s[i]);
      worst = std::max(worst, std::abs(y(0, static_cast<Eigen::Index>(2 * i)) - x));
    }
    // The ten restarts on the way add no more local errors than a run without them (a few hundred).
    EXPECT_LT(worst, 300 * tolerance);
  }
}

TEST(Checkpoint, RefusesWhatCannotBeOfTheEnsemble) {
  Ensemble ensemble = Oscillators(9);
  ensemble.specification.integration.samples_between_checkpoints = kInterval;
  const EnsembleState good = ExpectSameBitsAfter(ensemble, 10, 20);
  const auto refused = [&](const auto& spoil) {
    EnsembleState state = good;
    spoil(state);
    EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
    return !propagator.Restore(state);
  };
  EXPECT_FALSE(refused([](EnsembleState&) {}));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.blocks.clear(); }));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.samples = 11; }));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.time_s = -1; }));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.blocks[0].source[3] = 9; }));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.blocks[0].source[3] = 4; }));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.blocks[0].alive[3] = false; }));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.blocks[0].alive.pop_back(); }));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.blocks[0].states.resize(8, 2); }));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.blocks[0].states(0, 0) = NAN; }));
  EXPECT_TRUE(refused([](EnsembleState& state) { state.blocks[0].modes.setZero(16, 1); }));
  EXPECT_TRUE(refused([](EnsembleState& state) {
    state.blocks[0].failures.push_back({9, 0, 0, ""});
  }));
}

}  // namespace
}  // namespace polyest::internal::checkpoint_test
