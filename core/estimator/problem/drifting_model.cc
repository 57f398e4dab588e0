#include "core/estimator/problem/drifting_model.h"

#include <absl/strings/str_cat.h>

#include <atomic>
#include <cstdint>
#include <cstring>
#include <map>
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

using ConstColumn = Eigen::Ref<const Eigen::ArrayXd>;

bool HaveSameBits(const ConstColumn& a, const Eigen::ArrayXd& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<size_t>(a.size())) == 0;
}

// What a drifting parameter's values in a block of trajectories are. A walk stands still between
// two instants of process noise, so that an integrator asks for the same values at all its stages;
// the values and departures tell whether they are still those of the same block and the same
// instant.
class PresentMemory {
 public:
  // Returns θ(t) where the walk has departed by `departures` from the values `thetas`.
  const Eigen::ArrayXd& Values(const UncertainParameter& prior, const ConstColumn& thetas,
                               const ConstColumn& departures) {
    const bool same_thetas = HaveSameBits(thetas, thetas_);
    if (same_thetas && HaveSameBits(departures, departures_)) return values_;
    departures_ = departures;
    if (!same_thetas) thetas_ = thetas;
    if (prior.germ.family == GermFamily::kNormal) {
      values_ = thetas_ * (prior.scale * departures_).exp();
    } else {
      SetByScores(prior, !same_thetas);
    }
    return values_;
  }

 private:
  // Sets the values by F of the prior. The score of each θ is computed once for a block.
  void SetByScores(const UncertainParameter& prior, bool new_thetas) {
    const Germ germ(prior.germ);
    if (new_thetas) {
      scores_ =
          thetas_.unaryExpr([&](double theta) { return germ.NormalScore(prior.ToGerm(theta)); });
    }
    values_ = thetas_;
    for (Eigen::Index row = 0; row < values_.size(); ++row) {
      if (departures_[row] == 0) continue;
      values_[row] = prior.ToParameter(germ.OfNormalScore(scores_[row] + departures_[row]));
    }
  }

  Eigen::ArrayXd thetas_, departures_, scores_, values_;
};

int64_t NextNumber() {
  static std::atomic<int64_t> number = 0;
  return ++number;
}

// Returns the thread's memory for each walk of the model with this number, of blocks of so many
// rows.
std::vector<PresentMemory>& MemoryOf(int64_t model, Eigen::Index rows, size_t walks) {
  thread_local int64_t present = 0;
  thread_local std::map<Eigen::Index, std::vector<PresentMemory>> memory;
  if (present != model) memory.clear();
  present = model;
  std::vector<PresentMemory>& of_rows = memory[rows];
  of_rows.resize(walks);
  return of_rows;
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
    } else {
      theta = MemoryOf(number_, theta.size(), walks_.size())[j].Values(prior, theta, departure);
    }
  }
  return present;
}

}  // namespace polyest::internal
