#include "proto/wire/convert/model.h"

#include <absl/strings/str_cat.h>

#include "core/fmu/fmu_model.h"
#include "core/umbridge/umbridge_model.h"

namespace polyest::internal {
namespace {

void AddQuantities(const std::vector<Quantity>& quantities,
                   google::protobuf::RepeatedPtrField<v1::Model::Quantity>& added) {
  for (const Quantity& quantity : quantities) {
    v1::Model::Quantity& proto = *added.Add();
    proto.set_name(quantity.name);
    proto.set_unit(quantity.unit);
    proto.set_meaning(quantity.meaning);
  }
}

void AddParameters(const std::vector<Quantity>& parameters,
                   google::protobuf::RepeatedPtrField<v1::Model::Quantity>& added) {
  AddQuantities(parameters, added);
  for (size_t i = 0; i < parameters.size(); ++i) {
    if (!parameters[i].has_default) continue;
    added[static_cast<int>(i)].set_default_value(parameters[i].default_value);
  }
}

std::string KindOf(const Model& model) {
  if (const auto* fmu = dynamic_cast<const FmuModel*>(&model)) return KindInWords(fmu->interface());
  return dynamic_cast<const UmBridgeModel*>(&model) == nullptr ? "built-in" : "UM-Bridge";
}

}  // namespace

v1::Model ToProto(const Model& model) {
  const ModelDescription& description = model.description();
  v1::Model proto;
  proto.set_name(absl::StrCat("models/", description.name));
  proto.set_kind(KindOf(model));
  proto.set_summary(description.summary);
  proto.set_equations(description.equations);
  proto.set_source(description.source);
  AddQuantities(description.states, *proto.mutable_states());
  AddParameters(description.parameters, *proto.mutable_parameters());
  AddQuantities(description.inputs, *proto.mutable_inputs());
  AddQuantities(description.outputs, *proto.mutable_outputs());
  return proto;
}

}  // namespace polyest::internal
