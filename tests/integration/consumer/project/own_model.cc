#include "own_model.h"

namespace {

using polyest::Block;
using polyest::ConstBlock;

enum Parameter { kDeceleration, kFirstSpeed };
enum State { kDistance, kSpeed };

class Braked final : public polyest::StateSpaceModel {
 public:
  Braked() {
    description_.name = "braked_mass";
    description_.states = {{"x", "m", "distance"}, {"v", "m/s", "speed"}};
    description_.parameters = {{"a", "m/s^2", "deceleration"}, {"v0", "m/s", "speed at t = 0"}};
    description_.outputs = {{"x", "m", "distance"}};
  }

  const polyest::ModelDescription& description() const override { return description_; }

  void InitialStates(const ConstBlock& parameters, Block states) const override {
    states.col(kDistance).setZero();
    states.col(kSpeed) = parameters.col(kFirstSpeed);
  }

  void Derivatives(double, const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock&, Block derivatives) const override {
    derivatives.col(kDistance) = states.col(kSpeed);
    derivatives.col(kSpeed) = -parameters.col(kDeceleration);
  }

  void Outputs(double, const ConstBlock& states, const ConstBlock&, const ConstBlock&,
               Block outputs) const override {
    outputs.col(0) = states.col(kDistance);
  }

 private:
  polyest::ModelDescription description_;
};

}  // namespace

std::shared_ptr<const polyest::Model> BrakedMass() { return std::make_shared<Braked>(); }
