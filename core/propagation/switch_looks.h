#pragma once

// Watches the switches of rows during a step and finds the first one that leaves its bounds.

#include <array>

#include "core/common/types.h"
#include "core/propagation/crossing.h"
#include "core/propagation/row_steps.h"
#include "core/propagation/switched_rows.h"

namespace polyest::internal {

class SwitchLooks {
 public:
  // `switched` must outlive the object.
  SwitchLooks(SwitchedRows* switched, Eigen::Index rows, Eigen::Index states);

  // Looks at the switches during steps of these lengths from these times and states. What was seen
  // at the ends of the steps before is what is seen at the beginnings.
  void Take(const RowSteps& steps, const Eigen::ArrayXd& times_s, const Eigen::ArrayXd& lengths_s,
            const Eigen::ArrayXXd& states);
  // Goes back to the beginning of the row's step.
  void Undo(Eigen::Index row) { looks_[kEnd].row(row) = looks_[0].row(row); }
  // Looks at the row where its next step begins.
  void Begin(Eigen::Index row, double time_s, const Eigen::ArrayXXd& states) {
    switched_->ObserveRow(row, time_s, states, looks_[kEnd]);
  }

  // Returns how badly the polynomials through the looks follow the switches: acceptable up to 1. A
  // step across several periods of a condition on the time would show no error of the states.
  double Error(Eigen::Index row);
  // Finds the switch that is the first to leave its bounds in the row's step, and how.
  Crossing FirstLeft(Eigen::Index row, Eigen::Index& which, bool& upwards) const;
  // Returns by how much a switch is outside of its bounds at the end of the row's step.
  double OutsideAtEnd(Eigen::Index row, Eigen::Index which, bool upwards) const {
    return Outside(row, which, upwards, kEnd);
  }

 private:
  // Times in a step: those of StepSamples, and one more at which the polynomial through the others
  // is compared.
  static constexpr std::array<double, 6> kTheta = {0, 0.25, 0.5, 0.75, 1, 0.875};
  static constexpr size_t kEnd = 4;
  static constexpr size_t kComparison = 5;

  double Outside(Eigen::Index row, Eigen::Index which, bool upwards, size_t look) const;

  SwitchedRows* const switched_;
  std::array<Eigen::ArrayXXd, kTheta.size()> looks_;  // each rows × switches
  Eigen::ArrayXXd largest_;  // rows × switches: the largest magnitude of an argument so far
  Eigen::ArrayXXd states_;
};

}  // namespace polyest::internal
