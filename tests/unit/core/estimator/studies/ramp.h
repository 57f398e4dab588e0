#pragma once

// A model whose studies have closed forms, and problems with it.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "polyest/model.h"
#include "tests/unit/core/estimator/studies/resolve.h"

namespace polyest::internal::ramp {

// The model dx/dt = a + u, x(0) = x0, with outputs x and 2x, has closed forms for everything. If a
// passes `limit`, the derivative gains 1000 x² at t = 1, so that x is infinite within a
// millisecond.
class Ramp : public StateSpaceModel {
 public:
  Ramp() {
    description_.name = "ramp";
    description_.states = {{"x", "m", "", 0}};
    description_.parameters = {{"a", "m/s", "", 1}, {"x0", "m", "", 0}, {"limit", "m/s", "", 1e9}};
    description_.inputs = {{"u", "m/s", "", 0}};
    description_.outputs = {{"x", "m", "", 0}, {"twice", "m", "", 0}};
  }
  const ModelDescription& description() const override { return description_; }
  void InitialStates(const ConstBlock& parameters, Block states) const override {
    states.col(0) = parameters.col(1);
  }
  void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock& inputs, Block derivatives) const override {
    for (Eigen::Index i = 0; i < derivatives.rows(); ++i) {
      const bool fails = time_s > 1 && parameters(i, 0) > parameters(i, 2);
      derivatives(i, 0) = parameters(i, 0) + inputs(i, 0);
      if (fails) derivatives(i, 0) += 1000 * states(i, 0) * states(i, 0);
    }
  }
  void Outputs(double, const ConstBlock& states, const ConstBlock&, const ConstBlock&,
               Block outputs) const override {
    outputs.col(0) = states.col(0);
    outputs.col(1) = 2 * states.col(0);
  }

 private:
  ModelDescription description_;
};

// Makes the problem with a uniform on [1, 3] and x measured with σ = 0.5.
inline Problem RampProblem() {
  Problem problem;
  problem.model = std::make_shared<Ramp>();
  problem.uncertain = {UncertainParameter::Uniform("a", 1, 3).value()};
  problem.measured = {{"x", {.absolute = 0.5}}};
  problem.expansion.order = 2;
  problem.expansion.points_per_term = 4;
  return problem;
}

template <class Result>
std::string Refusal(const absl::StatusOr<Result>& result, absl::StatusCode code) {
  EXPECT_EQ(result.status().code(), code) << result.status();
  return std::string(result.status().message());
}

}  // namespace polyest::internal::ramp
