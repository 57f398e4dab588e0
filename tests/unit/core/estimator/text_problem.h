#pragma once

// Makes problems whose one output is an expression of the parameters, constant in time. With linear
// expressions everything has a closed form.

#include <string>
#include <utility>
#include <vector>

#include "core/model/equations/equation_model.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {

inline Problem TextProblem(const std::string& output, std::vector<UncertainParameter> uncertain,
                           double noise) {
  EquationSpecification equations;
  equations.outputs = {{"y", output}};
  Problem problem;
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = std::move(uncertain);
  problem.measured = {{"y", {.absolute = noise}}};
  return problem;
}

// Returns an estimator that has processed the values.
inline std::unique_ptr<Estimator> Processed(const Problem& problem,
                                            const std::vector<double>& values) {
  Samples samples;
  samples.columns = {{"y", values, {}}};
  for (size_t i = 0; i < values.size(); ++i) samples.time_s.push_back(static_cast<double>(i + 1));
  auto estimator = MakeEstimator(problem);
  EXPECT_TRUE(estimator->Append(samples).ok());
  EXPECT_TRUE(estimator->Process().ok());
  return estimator;
}

}  // namespace polyest::internal
