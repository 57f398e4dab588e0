#pragma once

// A model as its user writes it: equations as text. README.md describes the language.

#include <map>
#include <string>
#include <vector>

#include "core/model/equations/lookup.h"

namespace polyest {

// A name in the equations that none of these members defines is a parameter without a default. The
// initial value of a state x is the parameter x_0, which is 0 unless `parameters` says otherwise.
struct EquationSpecification {
  std::map<std::string, std::string> states = {};   // name -> right-hand side of dx/dt
  std::map<std::string, std::string> outputs = {};  // name -> expression; at least one
  std::map<std::string, std::string> intermediates =
      {};                                         // may refer to each other, without a cycle
  std::map<std::string, double> parameters = {};  // defaults; may include <state>_0
  std::vector<std::string> inputs = {};
  std::map<std::string, std::string> units = {};  // of any name; x_0 has that of x
  std::map<std::string, LookupTable> tables = {};
};

}  // namespace polyest
