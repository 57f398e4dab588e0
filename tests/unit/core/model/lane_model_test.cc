#include "core/model/lane_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "core/common/check.h"
#include "core/model/builtin/bicycle.h"
#include "core/model/builtin/duffing.h"
#include "core/model/builtin/linear_two_state.h"
#include "core/model/builtin/mass_spring_damper.h"
#include "core/model/builtin/mass_spring_frequency.h"
#include "core/model/builtin/pendulum.h"
#include "core/model/builtin/quarter_car.h"
#include "core/model/builtin/roll_plane_2dof.h"
#include "core/model/builtin/roll_plane_4dof.h"

namespace polyest::internal {
namespace {

// Returns positive numbers that differ in every row and column, in (0.5, 2.5).
Eigen::ArrayXXd Varied(Eigen::Index rows, Eigen::Index columns, double phase) {
  return Eigen::ArrayXXd::NullaryExpr(rows, columns, [phase](Eigen::Index i, Eigen::Index j) {
    return 1.5 + std::sin(0.7 * static_cast<double>(i) + 2.3 * static_cast<double>(j) + phase);
  });
}

template <size_t kColumns>
std::array<double, kColumns> Row(const Eigen::ArrayXXd& block, Eigen::Index row) {
  std::array<double, kColumns> values{};
  for (size_t j = 0; j < kColumns; ++j) values[j] = block(row, static_cast<Eigen::Index>(j));
  return values;
}

// Expects the same formula in the same order. Results differ only where the compiler fuses a
// product with a sum: by about a rounding of the largest term, which here is below 100.
template <size_t kColumns>
void ExpectRow(const Eigen::ArrayXXd& block, Eigen::Index row,
               const std::array<double, kColumns>& expected) {
  for (size_t j = 0; j < kColumns; ++j) {
    EXPECT_NEAR(block(row, static_cast<Eigen::Index>(j)), expected[j], 1e-13)
        << "row " << row << ", column " << j;
  }
}

template <class Equations>
class LaneModelOf : public ::testing::Test {
 protected:
  static constexpr Eigen::Index kRows = 3 * kLanes;
  static constexpr double kTime = 0.25;

  LaneModel<Equations> model_;
  Eigen::ArrayXXd parameters_ = Varied(kRows, Equations::kParameters, 0);
  Eigen::ArrayXXd states_ = Varied(kRows, Equations::kStates, 1) - 1.5;
  // The inputs are positive, because a bicycle rolls forwards.
  Eigen::ArrayXXd inputs_ = Varied(kRows, Equations::kInputs, 2);
};

using AllEquations =
    ::testing::Types<builtin::MassSpringDamper, builtin::MassSpringFrequency,
                     builtin::LinearTwoState, builtin::RollPlane2Dof, builtin::RollPlane4Dof,
                     builtin::QuarterCar, builtin::Bicycle, builtin::Duffing, builtin::Pendulum>;

struct EquationsName {
  template <class Equations>
  static std::string GetName(int) {
    return Equations::Describe().name;
  }
};
TYPED_TEST_SUITE(LaneModelOf, AllEquations, EquationsName);

TYPED_TEST(LaneModelOf, StartsEveryPointAtItsOwnInitialStates) {
  Eigen::ArrayXXd states(this->kRows, TypeParam::kStates);
  this->model_.InitialStates(this->parameters_, states);
  if constexpr (TypeParam::kStates > 0) {
    for (Eigen::Index row = 0; row < this->kRows; ++row) {
      std::array<double, TypeParam::kStates> expected;
      TypeParam::Initial(Row<TypeParam::kParameters>(this->parameters_, row), expected);
      ExpectRow(states, row, expected);
    }
  }
}

TYPED_TEST(LaneModelOf, GivesEveryPointTheDerivativesOfASinglePoint) {
  Eigen::ArrayXXd derivatives(this->kRows, TypeParam::kStates);
  this->model_.Derivatives(this->kTime, this->states_, this->parameters_, this->inputs_,
                           derivatives);
  if constexpr (TypeParam::kStates > 0) {
    for (Eigen::Index row = 0; row < this->kRows; ++row) {
      std::array<double, TypeParam::kStates> expected;
      TypeParam::Derivatives(this->kTime, Row<TypeParam::kStates>(this->states_, row),
                             Row<TypeParam::kParameters>(this->parameters_, row),
                             Row<TypeParam::kInputs>(this->inputs_, row), expected);
      ExpectRow(derivatives, row, expected);
    }
  }
}

TYPED_TEST(LaneModelOf, GivesEveryPointTheOutputsOfASinglePoint) {
  Eigen::ArrayXXd outputs(this->kRows, TypeParam::kOutputs);
  this->model_.Outputs(this->kTime, this->states_, this->parameters_, this->inputs_, outputs);
  for (Eigen::Index row = 0; row < this->kRows; ++row) {
    std::array<double, TypeParam::kOutputs> expected;
    TypeParam::Outputs(this->kTime, Row<TypeParam::kStates>(this->states_, row),
                       Row<TypeParam::kParameters>(this->parameters_, row),
                       Row<TypeParam::kInputs>(this->inputs_, row), expected);
    ExpectRow(outputs, row, expected);
  }
}

// The block is a part of the rows of a larger array. Its columns are further apart than its number
// of rows, and its first row need not be aligned for vectors.
TYPED_TEST(LaneModelOf, WorksOnPartOfALargerBlockAndWritesNothingElse) {
  constexpr Eigen::Index kFirst = 3, kMore = 8;
  const Eigen::Index rows = this->kRows, larger = rows + kMore;
  Eigen::ArrayXXd parameters = Eigen::ArrayXXd::Zero(larger, TypeParam::kParameters);
  Eigen::ArrayXXd states = Eigen::ArrayXXd::Zero(larger, TypeParam::kStates);
  Eigen::ArrayXXd inputs = Eigen::ArrayXXd::Zero(larger, TypeParam::kInputs);
  parameters.middleRows(kFirst, rows) = this->parameters_;
  states.middleRows(kFirst, rows) = this->states_;
  inputs.middleRows(kFirst, rows) = this->inputs_;
  Eigen::ArrayXXd outputs = Eigen::ArrayXXd::Constant(larger, TypeParam::kOutputs, -99);
  this->model_.Outputs(this->kTime, states.middleRows(kFirst, rows),
                       parameters.middleRows(kFirst, rows), inputs.middleRows(kFirst, rows),
                       outputs.middleRows(kFirst, rows));

  Eigen::ArrayXXd expected(rows, TypeParam::kOutputs);
  this->model_.Outputs(this->kTime, this->states_, this->parameters_, this->inputs_, expected);
  EXPECT_TRUE((outputs.middleRows(kFirst, rows) == expected).all());
  EXPECT_TRUE((outputs.topRows(kFirst) == -99).all());
  EXPECT_TRUE((outputs.bottomRows(kMore - kFirst) == -99).all());
}

TYPED_TEST(LaneModelOf, GivesAPointTheSameBitsInAnyLane) {
  Eigen::ArrayXXd derivatives(this->kRows, TypeParam::kStates);
  Eigen::ArrayXXd outputs(this->kRows, TypeParam::kOutputs);
  const Eigen::ArrayXXd states = this->states_.row(0).replicate(this->kRows, 1);
  const Eigen::ArrayXXd parameters = this->parameters_.row(0).replicate(this->kRows, 1);
  const Eigen::ArrayXXd inputs = this->inputs_.row(0).replicate(this->kRows, 1);
  this->model_.Derivatives(this->kTime, states, parameters, inputs, derivatives);
  this->model_.Outputs(this->kTime, states, parameters, inputs, outputs);
  for (Eigen::Index row = 1; row < this->kRows; ++row) {
    EXPECT_TRUE((derivatives.row(row) == derivatives.row(0)).all());
    EXPECT_TRUE((outputs.row(row) == outputs.row(0)).all());
  }
}

TEST(LaneModelCheck, RefusesBlocksOfTheWrongShape) {
  const LaneModel<builtin::Pendulum> model;
  const Eigen::ArrayXXd odd = Eigen::ArrayXXd::Ones(kLanes + 1, 5);
  const Eigen::ArrayXXd narrow = Eigen::ArrayXXd::Ones(kLanes, 4);
  Eigen::ArrayXXd states(kLanes + 1, 2);
  EXPECT_THROW(model.InitialStates(odd, states), CheckFailure);
  EXPECT_THROW(model.InitialStates(narrow, states), CheckFailure);
  EXPECT_THROW(model.InitialStates(Eigen::ArrayXXd::Ones(kLanes, 5), states), CheckFailure);
}

}  // namespace
}  // namespace polyest::internal
