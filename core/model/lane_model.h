#pragma once

// A model whose equations are written once for a scalar type Real and evaluated for kLanes points
// at a time, with all quantities of the chunk in registers.
//
// `Equations` provides
//
//   static constexpr int kStates, kParameters, kInputs, kOutputs;
//   static ModelDescription Describe();          // sizes as above, same order
//   template <class Real> static void
//     Initial(const std::array<Real, kParameters>&, std::array<Real, kStates>& states);
//   template <class Real> static void
//     Derivatives(double time_s, const std::array<Real, kStates>&,
//                 const std::array<Real, kParameters>&, const std::array<Real, kInputs>&,
//                 std::array<Real, kStates>& derivatives);
//   template <class Real> static void
//     Outputs(double time_s, …the same…, std::array<Real, kOutputs>& outputs);
//
// and may provide
//
//   static constexpr bool kUsesTime = false;     // Derivatives ignores time_s
//   static constexpr std::array<int, …> kNonlinear;  // Derivatives is linear in states and inputs
//                                                // (StateSpaceModel::IsLinear) if these parameters
//                                                // are 0; an empty array: always
//
// Real is Lane here; with double the equations give the value at a single point. An algebraic model
// (kStates = 0) omits Initial and Derivatives. Declare locals `const Real`, never `auto`, which
// would keep an unevaluated Eigen expression. Each column of a block is contiguous in memory.

#include <algorithm>
#include <array>
#include <vector>

#include "core/common/check.h"
#include "core/common/types.h"
#include "core/model/lane.h"
#include "polyest/model.h"

namespace polyest::internal {

template <class Equations>
class LaneModel final : public StateSpaceModel {
 public:
  LaneModel() : description_(Equations::Describe()) {
    POLYEST_CHECK(description_.states.size() == Equations::kStates);
    POLYEST_CHECK(description_.parameters.size() == Equations::kParameters);
    POLYEST_CHECK(description_.inputs.size() == Equations::kInputs);
    POLYEST_CHECK(description_.outputs.size() == Equations::kOutputs);
  }

  const ModelDescription& description() const override { return description_; }

  void InitialStates(const ConstBlock& parameters, Block states) const override {
    CheckParameters(parameters);
    if constexpr (Equations::kStates > 0) {
      CheckShape(states, parameters.rows(), Equations::kStates);
      for (Eigen::Index row = 0; row < parameters.rows(); row += kLanes) {
        std::array<Lane, Equations::kStates> x;
        Equations::Initial(Load<Equations::kParameters>(parameters, row), x);
        Store(x, row, states);
      }
    }
  }

  // The equations are inlined (`flatten`): a call would pass all quantities through memory.
  [[gnu::flatten]] void Derivatives(double time_s, const ConstBlock& states,
                                    const ConstBlock& parameters, const ConstBlock& inputs,
                                    Block derivatives) const override {
    CheckParameters(parameters);
    if constexpr (Equations::kStates > 0) {
      CheckShape(states, parameters.rows(), Equations::kStates);
      CheckShape(inputs, parameters.rows(), Equations::kInputs);
      CheckShape(derivatives, parameters.rows(), Equations::kStates);
      for (Eigen::Index row = 0; row < parameters.rows(); row += kLanes) {
        std::array<Lane, Equations::kStates> dx;
        Equations::Derivatives(time_s, Load<Equations::kStates>(states, row),
                               Load<Equations::kParameters>(parameters, row),
                               Load<Equations::kInputs>(inputs, row), dx);
        Store(dx, row, derivatives);
      }
    }
  }

  [[gnu::flatten]] void Outputs(double time_s, const ConstBlock& states,
                                const ConstBlock& parameters, const ConstBlock& inputs,
                                Block outputs) const override {
    CheckParameters(parameters);
    CheckShape(states, parameters.rows(), Equations::kStates);
    CheckShape(inputs, parameters.rows(), Equations::kInputs);
    CheckShape(outputs, parameters.rows(), Equations::kOutputs);
    for (Eigen::Index row = 0; row < parameters.rows(); row += kLanes) {
      std::array<Lane, Equations::kOutputs> y;
      Equations::Outputs(time_s, Load<Equations::kStates>(states, row),
                         Load<Equations::kParameters>(parameters, row),
                         Load<Equations::kInputs>(inputs, row), y);
      Store(y, row, outputs);
    }
  }

  bool uses_time() const override {
    if constexpr (requires { Equations::kUsesTime; }) return Equations::kUsesTime;
    return true;
  }

  bool IsLinear(const std::vector<bool>& zero_parameters, const std::vector<bool>&) const override {
    if constexpr (requires { Equations::kNonlinear; }) {
      return std::ranges::all_of(Equations::kNonlinear, [&](int parameter) {
        return zero_parameters[static_cast<size_t>(parameter)];
      });
    }
    return false;
  }

 private:
  static void CheckParameters(const ConstBlock& parameters) {
    POLYEST_CHECK(parameters.cols() == Equations::kParameters);
    POLYEST_CHECK(parameters.rows() % kLanes == 0);
  }

  // A block without columns may have any number of rows, since none of it is read.
  template <class AnyBlock>
  static void CheckShape(const AnyBlock& block, Eigen::Index rows, int columns) {
    POLYEST_CHECK(block.cols() == columns && (columns == 0 || block.rows() == rows));
  }

  template <int kColumns>
  static std::array<Lane, kColumns> Load(const ConstBlock& block, Eigen::Index row) {
    std::array<Lane, kColumns> lanes;
    for (int j = 0; j < kColumns; ++j) {
      lanes[j] = Eigen::Map<const Lane>(block.data() + j * block.outerStride() + row);
    }
    return lanes;
  }

  template <size_t kColumns>
  static void Store(const std::array<Lane, kColumns>& lanes, Eigen::Index row, Block& block) {
    for (size_t j = 0; j < kColumns; ++j) {
      const auto column = static_cast<Eigen::Index>(j);
      Eigen::Map<Lane>(block.data() + column * block.outerStride() + row) = lanes[j];
    }
  }

  ModelDescription description_;
};

}  // namespace polyest::internal
