#include "server/convert/model.h"

#include <absl/strings/str_cat.h>

namespace polyest {
namespace {

void AddQuantities(const std::vector<Quantity>& quantities,
                   google::protobuf::RepeatedPtrField<v1::Model::Quantity>& added) {
  for (const Quantity& quantity : quantities) {
    v1::Model::Quantity& proto = *added.Add();
    proto.set_name(quantity.name);
    proto.set_unit(quantity.unit);
    proto.set_meaning(quantity.meaning);
    proto.set_default_value(quantity.default_value);
  }
}

}  // namespace

v1::Model ToProto(const ModelDescription& description) {
  v1::Model model;
  model.set_name(absl::StrCat("models/", description.name));
  model.set_summary(description.summary);
  model.set_equations(description.equations);
  model.set_source(description.source);
  AddQuantities(description.states, *model.mutable_states());
  AddQuantities(description.parameters, *model.mutable_parameters());
  AddQuantities(description.inputs, *model.mutable_inputs());
  AddQuantities(description.outputs, *model.mutable_outputs());
  return model;
}

}  // namespace polyest
