#include "core/estimator/problem/drifting_model.h"

#include <absl/strings/str_cat.h>

#include <atomic>
#include <cstdint>
#include <vector>

#include "core/chaos/germ.h"
#include "core/common/check.h"

namespace polyest::internal {

std::string DriftName(const std::string& parameter) { return absl::StrCat(parameter, ".drift"); }

double Drifted(const UncertainParameter& parameter, double theta, double departure) {
  if (departure == 0) return theta;
  const Germ germ(parameter.germ);
  const double score = germ.NormalScore(parameter.ToGerm(theta));
  return parameter.ToParameter(germ.OfNormalScore(score + departure));
}

namespace {

// The normal scores of a parameter's values, which a trajectory needs again and again. The values
// tell whether they are still those of the same block of trajectories.
class ScoreMemory {
 public:
  const Eigen::ArrayXd& ScoresOf(const UncertainParameter& prior, const Eigen::ArrayXd& thetas) {
    const Germ germ(prior.germ);
    if (thetas.size() != thetas_.size() || (thetas != thetas_).any()) {
      thetas_ = thetas;
      scores_ =
          thetas.unaryExpr([&](double theta) { return germ.NormalScore(prior.ToGerm(theta)); });
    }
    return scores_;
  }

 private:
  Eigen::ArrayXd thetas_, scores_;
};

int64_t NextNumber() {
  static std::atomic<int64_t> number = 0;
  return ++number;
}

// Returns the thread's memory for each walk of the model with this number.
std::vector<ScoreMemory>& MemoryOf(int64_t model, size_t walks) {
  thread_local int64_t present = 0;
  thread_local std::vector<ScoreMemory> memory;
  if (present != model) memory.assign(walks, {});
  present = model;
  return memory;
}

}  // namespace

DriftingModel::DriftingModel(const Problem& problem)
    : number_(NextNumber()),
      owner_(problem.model),
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
      const Germ germ(prior.germ);
      const Eigen::ArrayXd& scores = MemoryOf(number_, walks_.size())[j].ScoresOf(prior, theta);
      for (Eigen::Index row = 0; row < theta.size(); ++row) {
        if (departure[row] == 0) continue;
        theta[row] = prior.ToParameter(germ.OfNormalScore(scores[row] + departure[row]));
      }
    }
  }
  return present;
}

}  // namespace polyest::internal
