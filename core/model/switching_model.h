#pragma once

// Models whose equations switch: sign, abs, min, max, comparisons, floor, ceil and mod.
//
// The i-th switch has an argument a_i(t, x, θ, u) and a mode σ_i, which says on which piece the
// argument lies:
//
//   kSign   σ = −1 where a < 0, σ = 1 where a > 0; the pieces meet at a = 0
//   kFloor  σ = n where n ≤ a < n + 1; the pieces meet at the integers
//
// With the modes frozen the right-hand side is smooth, and continues smoothly where an argument
// leaves its piece. That is what an integrator needs to locate the switching. An argument may
// itself depend on the modes of other switches.

#include <span>

#include "core/common/types.h"

namespace polyest::internal {

enum class SwitchKind { kSign, kFloor };

// What the functions below are evaluated at. Each row has a time of its own.
struct SwitchingPoint {
  const ConstBlock& modes;  // rows × (1 + switches): the time in s, then the modes
  const ConstBlock& states;
  const ConstBlock& parameters;
  const ConstBlock& inputs;
};

class SwitchingModel {
 public:
  virtual ~SwitchingModel() = default;

  // The switches that the right-hand side depends on; none for smooth equations, of which no other
  // function may be called.
  virtual std::span<const SwitchKind> switches() const = 0;
  // Whether the right-hand side or an argument changes with the time or an input while the states
  // rest.
  virtual bool changes_at_rest() const = 0;

  // Writes dx/dt: rows × states.
  virtual void FrozenDerivatives(const SwitchingPoint& at, Block derivatives) const = 0;
  // Writes the outputs: rows × outputs.
  virtual void FrozenOutputs(const SwitchingPoint& at, Block outputs) const = 0;
  // Writes the arguments: rows × switches.
  virtual void Arguments(const SwitchingPoint& at, Block arguments) const = 0;
  // Writes ∂a_i/∂z_k into column k · switches + i, where z consists of t, the states and the
  // inputs.
  virtual void ArgumentSlopes(const SwitchingPoint& at, Block slopes) const = 0;
};

}  // namespace polyest::internal
