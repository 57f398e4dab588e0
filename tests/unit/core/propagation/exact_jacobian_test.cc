// Compares the stiff integrator with the exact derivatives of the equations to one with
// differences.

#include <gtest/gtest.h>

#include <atomic>
#include <memory>

#include "core/model/equations/equation_model.h"
#include "core/propagation/ensemble_propagator.h"

namespace polyest::internal {
namespace {

// Wraps another model, with or without its derivatives, and counts how often each is asked for.
class Counted final : public StateSpaceModel {
 public:
  Counted(std::shared_ptr<const StateSpaceModel> model, bool exact)
      : model_(std::move(model)), exact_(exact) {}

  const ModelDescription& description() const override { return model_->description(); }
  void InitialStates(const ConstBlock& parameters, Block states) const override {
    model_->InitialStates(parameters, states);
  }
  void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock& inputs, Block derivatives) const override {
    ++derivatives_;
    model_->Derivatives(time_s, states, parameters, inputs, derivatives);
  }
  void Outputs(double time_s, const ConstBlock& states, const ConstBlock& parameters,
               const ConstBlock& inputs, Block outputs) const override {
    model_->Outputs(time_s, states, parameters, inputs, outputs);
  }
  bool has_state_jacobian() const override { return exact_; }
  void StateJacobian(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                     const ConstBlock& inputs, Block jacobian) const override {
    ++jacobians_;
    model_->StateJacobian(time_s, states, parameters, inputs, jacobian);
  }

  int derivatives() const { return derivatives_; }
  int jacobians() const { return jacobians_; }

 private:
  const std::shared_ptr<const StateSpaceModel> model_;
  const bool exact_;
  mutable std::atomic<int> derivatives_{0}, jacobians_{0};
};

Matrix Propagate(const std::shared_ptr<const Counted>& model) {
  EnsembleSpecification specification;
  specification.model = model;
  // The columns are mu, v_0, x_0.
  specification.parameters.resize(3, 3);
  specification.parameters << 100, 0, 2, 300, 0, 2, 1000, 0, 1.5;
  specification.outputs = {0};
  specification.integration.method = IntegrationMethod::kStiff;
  specification.integration.relative_tolerance = 1e-8;
  specification.amplitudes.resize(3, 0);
  const InputSignals inputs;
  EnsemblePropagator propagator(specification, &inputs);
  const std::vector<double> times_s = {1, 10, 100};
  Matrix outputs(3, 3);
  EXPECT_TRUE(propagator.Advance(times_s, outputs, Stop()).ok());
  EXPECT_TRUE(propagator.failures().empty());
  return outputs;
}

TEST(ExactJacobian, GivesTheSameForTheVanDerPolOscillatorWithFewerEvaluations) {
  const auto equations = MakeEquationModel(
      {.states = {{"x", "v"}, {"v", "mu*(1 - x^2)*v - x"}}, .outputs = {{"x", "x"}}});
  ASSERT_TRUE(equations.ok()) << equations.status();
  const auto exact = std::make_shared<Counted>(*equations, true);
  const auto differences = std::make_shared<Counted>(*equations, false);
  const Matrix with = Propagate(exact);
  const Matrix without = Propagate(differences);
  // Both solve the same equation of the corrector. The remaining error differs within the tolerance
  // of each step, and there are hundreds of steps.
  EXPECT_LT((with - without).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_GT(exact->jacobians(), 0);
  EXPECT_EQ(differences->jacobians(), 0);
  // Each difference costs states + 1 evaluations.
  EXPECT_LT(exact->derivatives() + 2 * exact->jacobians(), differences->derivatives());
  RecordProperty("evaluations_exact", exact->derivatives());
  RecordProperty("evaluations_differences", differences->derivatives());
}

TEST(ExactJacobian, FallsBackToDifferencesWhereADerivativeIsInfinite) {
  // The solution of ẋ = −√x stays at 0, where the derivative of the right-hand side is −∞.
  const auto equations = MakeEquationModel(
      {.states = {{"x", "-sqrt(x)"}, {"y", "-rate*(y - 1)"}}, .outputs = {{"x", "x"}}});
  ASSERT_TRUE(equations.ok()) << equations.status();
  const auto model = std::make_shared<Counted>(*equations, true);
  EnsembleSpecification specification;
  specification.model = model;
  specification.parameters.resize(1, 3);  // The columns are rate, x_0, y_0.
  specification.parameters << 1e4, 0, 0;
  specification.outputs = {0};
  specification.integration.method = IntegrationMethod::kStiff;
  specification.amplitudes.resize(1, 0);
  const InputSignals inputs;
  EnsemblePropagator propagator(specification, &inputs);
  const std::vector<double> times_s = {1e-9};
  Matrix outputs(1, 1);
  EXPECT_TRUE(propagator.Advance(times_s, outputs, Stop()).ok());
  EXPECT_GT(model->jacobians(), 0);
  EXPECT_TRUE(propagator.failures().empty());
  EXPECT_EQ(outputs(0, 0), 0);
}

}  // namespace
}  // namespace polyest::internal
