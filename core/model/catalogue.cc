#include "polyest/catalogue.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <string>

#include "core/model/builtin/bicycle.h"
#include "core/model/builtin/duffing.h"
#include "core/model/builtin/linear_two_state.h"
#include "core/model/builtin/mass_spring_damper.h"
#include "core/model/builtin/mass_spring_frequency.h"
#include "core/model/builtin/pendulum.h"
#include "core/model/builtin/quarter_car.h"
#include "core/model/builtin/roll_plane_2dof.h"
#include "core/model/builtin/roll_plane_4dof.h"
#include "core/model/lane_model.h"

namespace polyest {

using namespace internal;

namespace {

template <class... Equations>
std::vector<std::shared_ptr<const StateSpaceModel>> MakeAll() {
  return {std::make_shared<const LaneModel<Equations>>()...};
}

}  // namespace

const std::vector<std::shared_ptr<const StateSpaceModel>>& BuiltinModels() {
  // The list is never destroyed, so it stays valid during the program's shutdown.
  static const auto& models = *new std::vector<std::shared_ptr<const StateSpaceModel>>(
      MakeAll<builtin::MassSpringDamper, builtin::MassSpringFrequency, builtin::LinearTwoState,
              builtin::RollPlane2Dof, builtin::RollPlane4Dof, builtin::QuarterCar, builtin::Bicycle,
              builtin::Duffing, builtin::Pendulum>());
  return models;
}

absl::StatusOr<std::shared_ptr<const StateSpaceModel>> FindBuiltinModel(std::string_view name) {
  for (const std::shared_ptr<const StateSpaceModel>& model : BuiltinModels()) {
    if (model->description().name == name) return model;
  }
  const auto append_name = [](std::string* text,
                              const std::shared_ptr<const StateSpaceModel>& model) {
    text->append(model->description().name);
  };
  return absl::NotFoundError(absl::StrCat("no built-in model is named \"", std::string(name),
                                          "\"; there are ",
                                          absl::StrJoin(BuiltinModels(), ", ", append_name)));
}

}  // namespace polyest
