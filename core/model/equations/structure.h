#pragma once

// What the graph of a model's right-hand sides shows without evaluating it: whether they use the
// time, and whether they are linear in the states and the inputs.
//
// Each node is given a form, operands first. Zero times anything is zero; a sum has the highest
// form of its terms; a product has the higher form of its factors if the other one is fixed; a
// quotient that of its numerator if the denominator is fixed; a choice by a fixed condition the
// highest form of its values. Any other operation on fixed operands is fixed, on others kOther. A
// form that is too high is possible (x²/x is kOther), one that is too low is not.

#include <vector>

#include "core/model/equations/graph.h"

namespace polyest::internal::equations {

enum class Form {
  kZero,    // 0
  kFixed,   // does not depend on time, states or varying inputs
  kLinear,  // a sum of fixed nodes, and of states and varying inputs times fixed nodes
  kOther,
};

class Structure {
 public:
  Structure() = default;
  // Keeps the part of the graph that the roots depend on.
  Structure(const Graph& graph, const std::vector<NodeId>& roots);

  // Returns the highest form of the roots, given those of the variables by their index.
  Form Highest(const std::vector<Form>& variables) const;
  // Whether a root depends on the variable.
  bool Uses(int variable) const;

 private:
  std::vector<Node> nodes_;  // operands are indices into this list
  std::vector<NodeId> roots_;
};

}  // namespace polyest::internal::equations
