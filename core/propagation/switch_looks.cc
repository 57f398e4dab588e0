#include "core/propagation/switch_looks.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {

SwitchLooks::SwitchLooks(SwitchedRows* switched, Eigen::Index rows, Eigen::Index states)
    : switched_(switched),
      largest_(Eigen::ArrayXXd::Zero(rows, switched->switches())),
      states_(rows, states) {
  looks_.fill(largest_);
}

void SwitchLooks::Take(const RowSteps& steps, const Eigen::ArrayXd& times_s,
                       const Eigen::ArrayXd& lengths_s, const Eigen::ArrayXXd& states) {
  looks_[0] = looks_[kEnd];
  for (size_t look = 1; look < looks_.size(); ++look) {
    if (look == kEnd) {
      switched_->Observe(times_s + lengths_s, steps.ends(), looks_[look]);
      continue;
    }
    const std::array<double, RowSteps::kStages> weights = RowSteps::Weights(kTheta[look]);
    for (Eigen::Index s = 0; s < states.cols(); ++s) {
      auto x = states_.col(s);
      x = weights[0] * steps.stages()[0].col(s);
      for (size_t i = 1; i < weights.size(); ++i) x += weights[i] * steps.stages()[i].col(s);
      x = states.col(s) + lengths_s * x;
    }
    switched_->Observe(times_s + kTheta[look] * lengths_s, states_, looks_[look]);
  }
}

double SwitchLooks::Error(Eigen::Index row) {
  constexpr double kAcceptable = 1e-3;
  double worst = 0;
  for (Eigen::Index i = 0; i < largest_.cols(); ++i) {
    if (switched_->IsHeld(row, i)) continue;
    StepSamples samples{};
    for (size_t look = 0; look <= kEnd; ++look) samples[look] = looks_[look](row, i);
    const double difference =
        std::abs(Interpolate(samples, kTheta[kComparison]) - looks_[kComparison](row, i));
    double size = 1;
    if (!switched_->modes().sliding(row, i)) {
      for (const double sample : samples) {
        largest_(row, i) = std::max(largest_(row, i), std::abs(sample));
      }
      size = largest_(row, i);
    }
    if (difference > 0) worst = std::max(worst, difference / (kAcceptable * size));
  }
  return worst;
}

double SwitchLooks::Outside(Eigen::Index row, Eigen::Index which, bool upwards, size_t look) const {
  const SwitchedRows::Interval bounds = switched_->Bounds(row, which);
  const double observed = looks_[look](row, which);
  return upwards ? observed - bounds.upper : bounds.lower - observed;
}

Crossing SwitchLooks::FirstLeft(Eigen::Index row, Eigen::Index& which, bool& upwards) const {
  Crossing first;
  for (Eigen::Index i = 0; i < largest_.cols(); ++i) {
    if (switched_->IsHeld(row, i)) continue;
    const SwitchedRows::Interval bounds = switched_->Bounds(row, i);
    for (const bool up : {false, true}) {
      if (std::isinf(up ? bounds.upper : bounds.lower)) continue;
      StepSamples samples{};
      for (size_t look = 0; look <= kEnd; ++look) samples[look] = Outside(row, i, up, look);
      const Crossing crossing =
          FirstCrossing(samples, switched_->Departing(row, i) == (up ? 1 : -1));
      if (!crossing.found || (first.found && crossing.theta >= first.theta)) continue;
      first = crossing;
      which = i;
      upwards = up;
    }
  }
  return first;
}

}  // namespace polyest::internal
