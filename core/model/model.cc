#include "polyest/model.h"

#include "core/common/check.h"

namespace polyest {

namespace {

std::optional<int> Find(const std::vector<Quantity>& quantities, std::string_view name) {
  for (size_t i = 0; i < quantities.size(); ++i) {
    if (quantities[i].name == name) return static_cast<int>(i);
  }
  return std::nullopt;
}

}  // namespace

std::optional<int> ModelDescription::FindParameter(std::string_view parameter) const {
  return Find(parameters, parameter);
}

std::optional<int> ModelDescription::FindInput(std::string_view input) const {
  return Find(inputs, input);
}

std::optional<int> ModelDescription::FindOutput(std::string_view output) const {
  return Find(outputs, output);
}

void StateSpaceModel::StateJacobian(double, const ConstBlock&, const ConstBlock&, const ConstBlock&,
                                    Block) const {
  POLYEST_CHECK(has_state_jacobian());
}

}  // namespace polyest
