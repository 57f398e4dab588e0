// Tests inputs of FMUs: streamed knots, delays and offsets, and how a Co-Simulation holds them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/fmu/fmu_ensemble.h"

namespace polyest::internal::input_fmu_test {
namespace {

FmuEnsemble Oscillator(std::shared_ptr<const Model> model) {
  FmuEnsemble ensemble(std::move(model), 2, {"x", "v"});
  ensemble.Set("m", 1);
  ensemble.Set("k", 0, 20);
  ensemble.Set("k", 1, 30);
  return ensemble;
}
// As oscillator_me3, whose derivatives do not depend on the time.
FmuEnsemble BuiltIn() {
  FmuEnsemble ensemble = Oscillator(std::make_shared<UnknownEquations>(
      *FindBuiltinModel("mass_spring_damper"), /*uses_time=*/false));
  ensemble.specification.integration.method = IntegrationMethod::kExplicit;
  return ensemble;
}
FmuEnsemble Fmu(const char* name) { return Oscillator(*TestFmus().Find(name)); }

// Appends knots between calls, as data come in.
Matrix Stream(FmuEnsemble& ensemble, Interpolation interpolation) {
  ensemble.Drive("force", StreamedInput{.interpolation = interpolation}, 3);
  EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
  const std::vector<double> times_s = TimesUntil(2, 0.1);
  Matrix outputs(ensemble.points(), 2 * std::ssize(times_s));
  const size_t ahead = static_cast<size_t>(ensemble.inputs[0].knots_ahead());
  for (size_t knot = 0; knot < times_s.size() + ahead; ++knot) {
    if (knot < times_s.size()) {
      ensemble.inputs[0].Append(times_s[knot], std::sin(4 * times_s[knot]));
    } else if (knot == times_s.size()) {
      ensemble.inputs[0].Finish();
    }
    if (knot < ahead) continue;
    const size_t k = knot - ahead;
    const absl::Status status = propagator.Advance(
        std::span(&times_s[k], 1), outputs.middleCols(static_cast<Eigen::Index>(2 * k), 2), Stop());
    EXPECT_TRUE(status.ok()) << status;
  }
  return outputs;
}

TEST(FmuInputs, StreamAsThoseOfTheBuiltIn) {
  for (const Interpolation interpolation :
       {Interpolation::kHold, Interpolation::kLinear, Interpolation::kCubic}) {
    FmuEnsemble fmu = Fmu("oscillator_me2");
    FmuEnsemble built_in = BuiltIn();
    const Matrix difference = Stream(fmu, interpolation) - Stream(built_in, interpolation);
    // The steps are the same, except for rounding.
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(FmuInputs, AreDelayedAndOffsetPointByPoint) {
  FmuEnsemble fmu = Fmu("oscillator_me3");
  FmuEnsemble built_in = BuiltIn();
  for (FmuEnsemble* ensemble : {&fmu, &built_in}) {
    ensemble->Drive("force", HalfSineBumpInput{.start_s = 0.2, .duration_s = 0.4}, 10);
    ensemble->specification.input_delays_s = Vector{{0.0, 0.13}};
    ensemble->specification.input_offsets = Vector{{0.5, -0.25}};
  }
  const std::vector<double> times_s = TimesUntil(1, 0.1);
  const Matrix difference = fmu.Propagate(times_s) - built_in.Propagate(times_s);
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-12);
}

class CoSimulationInputs : public testing::TestWithParam<const char*> {};

TEST_P(CoSimulationInputs, AreHeldAtTheMiddleOfEachStep) {
  FmuEnsemble fmu = Fmu(GetParam());
  FmuEnsemble built_in = BuiltIn();
  built_in.specification.integration.relative_tolerance = 1e-11;
  for (FmuEnsemble* ensemble : {&fmu, &built_in}) {
    ensemble->Drive("force", SinusoidInput{.frequency_hz = 0.5}, 3);
  }
  const std::vector<double> times_s = TimesUntil(2, 0.1);
  const Matrix difference = fmu.Propagate(times_s) - built_in.Propagate(times_s);
  // A force held at u(t + h/2) instead of u(t) is wrong by −u'(t + h/2) s at t + h/2 + s. The
  // impulse of this error over a step of h is 0, and its moment is |u'| h³/12. As a displacement of
  // the force's impulse in time, the error leaves |u'| h²/12 a second in v, with |u'| = 3 · 2π ·
  // 0.5, over 2 s. A force held at u(t) would leave |u'| h/2, 6000 times as much.
  const double h = 1e-3;
  const double slope = 3 * 2 * M_PI * 0.5;
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 10 * slope * h * h / 12 * 2);
}

TEST_P(CoSimulationInputs, JumpBetweenTheSteps) {
  FmuEnsemble fmu = Fmu(GetParam());
  FmuEnsemble built_in = BuiltIn();
  built_in.specification.integration.relative_tolerance = 1e-11;
  for (FmuEnsemble* ensemble : {&fmu, &built_in}) {
    ensemble->Drive("force", StepInput{.time_s = 0.33333}, 3);
  }
  const Matrix difference = fmu.Propagate({0.3, 0.5, 1}) - built_in.Propagate({0.3, 0.5, 1});
  // A communication point at the jump leaves only the error of the FMU's own steps.
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Versions, CoSimulationInputs,
                         testing::Values("oscillator_cs2", "oscillator_cs3"));

}  // namespace
}  // namespace polyest::internal::input_fmu_test
