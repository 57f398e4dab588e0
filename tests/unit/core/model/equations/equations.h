#pragma once

// Helps the tests of equation models.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/model/equations/equation_model.h"

namespace polyest::internal {

inline std::shared_ptr<const StateSpaceModel> MakeOrFail(const EquationSpecification& equations) {
  auto model = MakeEquationModel(equations);
  if (!model.ok()) {
    ADD_FAILURE() << model.status();
    return nullptr;
  }
  return *std::move(model);
}

// Returns everything that is wrong with the equations.
inline std::vector<std::string> Messages(const EquationSpecification& equations) {
  std::vector<std::string> messages;
  for (const absl::Status& problem : CheckEquations(equations)) {
    messages.emplace_back(problem.message());
  }
  return messages;
}

// Returns numbers that differ in every row and column, in (−1, 1).
inline Eigen::ArrayXXd Varied(Eigen::Index rows, Eigen::Index columns, double phase) {
  return Eigen::ArrayXXd::NullaryExpr(rows, columns, [phase](Eigen::Index i, Eigen::Index j) {
    return std::sin(0.7 * static_cast<double>(i) + 2.3 * static_cast<double>(j) + phase);
  });
}

}  // namespace polyest::internal
