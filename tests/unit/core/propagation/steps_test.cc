// Tests that the integrators' steps miss nothing and do not depend on units.

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "core/model/equations/equation_model.h"
#include "tests/unit/core/propagation/ensemble.h"

namespace polyest::internal {
namespace {

class Steps : public ::testing::TestWithParam<IntegrationMethod> {
 protected:
  // Propagates a model from text with one point; parameters that are not named have their default.
  Matrix Propagate(const EquationSpecification& equations,
                   const std::map<std::string, double>& parameters,
                   const std::vector<double>& times_s, int max_steps = 100'000) {
    const auto model = MakeEquationModel(equations);
    EXPECT_TRUE(model.ok()) << model.status();
    EnsembleSpecification specification;
    specification.model = *model;
    const ModelDescription& description = (*model)->description();
    specification.parameters.resize(1, std::ssize(description.parameters));
    for (Eigen::Index j = 0; j < specification.parameters.cols(); ++j) {
      const Quantity& parameter = description.parameters[static_cast<size_t>(j)];
      const auto given = parameters.find(parameter.name);
      specification.parameters(0, j) =
          given == parameters.end() ? parameter.default_value : given->second;
    }
    specification.amplitudes.resize(1, 0);
    specification.outputs = {0};
    specification.integration.method = GetParam();
    specification.integration.max_steps = max_steps;
    const InputSignals inputs;
    EnsemblePropagator propagator(specification, &inputs);
    Matrix outputs(1, std::ssize(times_s));
    EXPECT_TRUE(propagator.Advance(times_s, outputs, Stop()).ok());
    EXPECT_TRUE(propagator.failures().empty());
    return outputs;
  }
};

TEST_P(Steps, GiveTheSameBitsInUnitsThatDifferByAPowerOfTwo) {
  // A capacitor is charged over a resistor: q and V of 1, or of 2⁻⁶⁰ ≈ 1e-18.
  const EquationSpecification circuit{.states = {{"q", "(V - q)/R + i"}, {"i", "-i^2/I"}},
                                      .outputs = {{"q", "q"}}};
  const std::vector<double> times_s = TimesUntil(5, 0.1);
  const double unit = 0x1p-60;
  const Matrix q = Propagate(circuit, {{"V", 1}, {"R", 1.3}, {"I", 1}, {"i_0", 0.5}}, times_s);
  const Matrix small =
      Propagate(circuit, {{"V", unit}, {"R", 1.3}, {"I", unit}, {"i_0", 0.5 * unit}}, times_s);
  EXPECT_EQ(small, unit * q);
}

TEST_P(Steps, DoNotResolveTheRoundingErrorsOfWhatCancels) {
  // The states a and b are the same but for rounding errors, and d' = 1e6 (a − b) is nothing but
  // these. Resolved relative to d itself they would take steps without end.
  const EquationSpecification model{
      .states = {{"a", "cos(3*a) - 0.1*a"}, {"b", "cos(3*b) - 0.3*b/3"}, {"d", "1e6*(a - b)"}},
      .outputs = {{"a", "a"}}};
  Propagate(model, {{"a_0", 0.1}, {"b_0", 0.1}}, TimesUntil(20, 0.5), /*max_steps=*/500);
}

TEST_P(Steps, SeeAPulseInTheEquationsOwnTimeFromRest) {
  const EquationSpecification model{
      .states = {{"x", "v"}, {"v", "-(40*x + 0.5*v) + A*exp(-((t - 20)/0.05)^2)"}},
      .outputs = {{"x", "x"}}};
  const std::vector<double> times_s = TimesUntil(25, 0.1);
  const Matrix x = Propagate(model, {{"A", 10}}, times_s);
  EXPECT_LT(std::abs(x(0, 100)), 1e-300);  // The exponential ends at the smallest numbers.
  // With the width σ and the eigenvalue λ = −d + i ω, x = A σ √π/ω · Im exp(λ τ + λ² σ²/4) once the
  // pulse is over. The integrator adds 1e-7 of x a step, in some hundred steps.
  const double d = 0.25, w = std::sqrt(40 - d * d), sigma = 0.05;
  const std::complex<double> lambda(-d, w);
  for (const Eigen::Index i : {205, 225, 250}) {
    const double tau = times_s[static_cast<size_t>(i)] - 20;
    const double exact = 10 * sigma * std::sqrt(std::numbers::pi) / w *
                         std::exp(lambda * tau + lambda * lambda * sigma * sigma / 4.0).imag();
    EXPECT_NEAR(x(0, i), exact, 2e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, Steps,
                         ::testing::Values(IntegrationMethod::kExplicit,
                                           IntegrationMethod::kStiff));

// Makes two oscillators at rest, which a smooth table or a bump drives for a short time.
class ShortForce : public ::testing::TestWithParam<IntegrationMethod> {
 protected:
  static Matrix Response(const InputSpecification& force, double delay_s, double other_delay_s,
                         double tolerance, IntegrationMethod method) {
    Ensemble ensemble("duffing", 2, {"x"});
    ensemble.Set("k", 40);
    ensemble.Set("m", 1);
    ensemble.Drive("force", force, 10);
    ensemble.specification.input_delays_s.resize(2, 1);
    ensemble.specification.input_delays_s << delay_s, other_delay_s;
    ensemble.specification.integration.relative_tolerance = tolerance;
    ensemble.specification.integration.method = method;
    const Matrix x = ensemble.Propagate({0, 20, 60});
    EXPECT_TRUE(ensemble.failures.empty());
    return x;
  }
};

TEST_P(ShortForce, IsSeenFromRestWhateverItsShapeAndDelays) {
  for (const InputSpecification& force : std::vector<InputSpecification>{
           TableInput{{49.96, 49.98, 50, 50.02, 50.04, 50.06, 50.08},
                      {0, 0, 0, 1, 0, 0, 0},
                      Interpolation::kCubic},
           TableInput{{0, 50, 50.02, 50.04, 100}, {0, 0, 1, 0, 0}, Interpolation::kShapePreserving},
           TableInput{{0, 50, 50.02, 50.04, 100}, {0, 0, 1, 0, 0}},
           HalfSineBumpInput{1, 50, 0.05}}) {
    for (const double other_delay_s : {0.5, 0.7}) {
      const Matrix x = Response(force, 0.5, other_delay_s, 1e-6, GetParam());
      // Each point alone meets the force at the same time as a single point does.
      const Matrix tight = Response(force, 0.5, 0.5, 1e-11, IntegrationMethod::kExplicit);
      EXPECT_GT(std::abs(tight(0, 2)), 1e-4);
      // Hundreds of steps of 1e-6 of the largest displacement, about 0.04.
      EXPECT_NEAR(x(0, 2), tight(0, 2), 2e-5) << force.index() << " " << other_delay_s;
      EXPECT_NE(x(1, 2), 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, ShortForce,
                         ::testing::Values(IntegrationMethod::kExplicit,
                                           IntegrationMethod::kStiff));

}  // namespace
}  // namespace polyest::internal
