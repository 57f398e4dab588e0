#include "core/estimator/problem/drifting_model.h"

#include <absl/strings/str_cat.h>

#include <cmath>

#include "core/chaos/germ.h"
#include "core/common/check.h"

namespace polyest::internal {

std::string DriftName(const std::string& parameter) { return absl::StrCat(parameter, ".drift"); }

double Drifted(const UncertainParameter& parameter, double theta, double departure) {
  if (departure == 0) return theta;
  const double xi = parameter.ToGerm(theta);
  if (parameter.germ.family == GermFamily::kNormal) return parameter.ToParameter(xi + departure);
  const Germ germ(parameter.germ);
  return parameter.ToParameter(germ.OfNormalScore(germ.NormalScore(xi) + departure));
}

DriftingModel::DriftingModel(const Problem& problem)
    : owner_(problem.model),
      model_(dynamic_cast<const StateSpaceModel*>(owner_.get())),
      description_(owner_->description()) {
  POLYEST_CHECK(model_ != nullptr);
  for (const UncertainParameter& parameter : problem.uncertain) {
    if (!parameter.drift) continue;
    const auto column = description_.FindParameter(parameter.name);
    POLYEST_CHECK(column.has_value());
    const bool read = !description_.FindOutput(parameter.name);
    walks_.push_back({*column, parameter, read});
    if (read) {
      const Quantity& shown = description_.parameters[static_cast<size_t>(*column)];
      description_.outputs.push_back(
          {shown.name, shown.unit, absl::StrCat("present value of ", shown.name)});
    }
    description_.states.push_back(
        {DriftName(parameter.name), "1", absl::StrCat("departure of ", parameter.name), 0, true});
  }
}

void DriftingModel::InitialStates(const ConstBlock& parameters, Block states) const {
  const auto own = states.cols() - std::ssize(walks_);
  model_->InitialStates(parameters, states.leftCols(own));
  states.rightCols(std::ssize(walks_)).setZero();
}

void DriftingModel::Derivatives(double time_s, const ConstBlock& states,
                                const ConstBlock& parameters, const ConstBlock& inputs,
                                Block derivatives) const {
  const auto own = states.cols() - std::ssize(walks_);
  model_->Derivatives(time_s, states.leftCols(own), Present(states, parameters), inputs,
                      derivatives.leftCols(own));
  derivatives.rightCols(std::ssize(walks_)).setZero();
}

void DriftingModel::Outputs(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                            const ConstBlock& inputs, Block outputs) const {
  const auto own = states.cols() - std::ssize(walks_);
  auto column = std::ssize(model_->description().outputs);
  const Eigen::ArrayXXd& present = Present(states, parameters);
  model_->Outputs(time_s, states.leftCols(own), present, inputs, outputs.leftCols(column));
  for (const Walk& walk : walks_) {
    if (walk.read) outputs.col(column++) = present.col(walk.column);
  }
}

const Eigen::ArrayXXd& DriftingModel::Present(const ConstBlock& states,
                                              const ConstBlock& parameters) const {
  // Blocks have few sizes, so that this memory is hardly ever allocated again.
  thread_local Eigen::ArrayXXd present;
  present = parameters;
  const auto own = states.cols() - std::ssize(walks_);
  for (size_t j = 0; j < walks_.size(); ++j) {
    const Walk& walk = walks_[j];
    auto theta = present.col(walk.column);
    const auto departure = states.col(own + static_cast<Eigen::Index>(j));
    const UncertainParameter& prior = walk.prior;
    if (prior.germ.family == GermFamily::kNormal && prior.map == ParameterMap::kAffine) {
      theta += prior.scale * departure;
    } else if (prior.germ.family == GermFamily::kNormal) {
      theta *= (prior.scale * departure).exp();
    } else {
      for (Eigen::Index row = 0; row < theta.size(); ++row) {
        theta[row] = Drifted(prior, theta[row], departure[row]);
      }
    }
  }
  return present;
}

}  // namespace polyest::internal
