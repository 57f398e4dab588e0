#pragma once

// The integrator of models whose equations switch (core/model/switching_model.h). It locates each
// point's own switchings, so that every step is smooth, and lets a point slide along a surface as
// switched_rows.h describes.
//
// Each row takes steps of its own with the method of Dormand and Prince. In a step the modes are
// frozen. Where an argument has then left its piece, the step is taken again up to the time at
// which it leaves, which is found by the secant method, and the modes are decided anew there.

#include <vector>

#include "core/common/types.h"
#include "core/model/switching_model.h"
#include "core/propagation/block_inputs.h"
#include "core/propagation/block_integrator.h"
#include "core/propagation/error_scale.h"
#include "core/propagation/row_progress.h"
#include "core/propagation/row_steps.h"
#include "core/propagation/switch_looks.h"
#include "core/propagation/switched_rows.h"

namespace polyest::internal {

class SwitchingIntegrator final : public BlockIntegrator {
 public:
  // Starts at `states` with `modes` (rows × switches): each switch's mode, halfway between its two
  // modes if it slides, or NaN if it follows from the states. The integrator writes the modes of
  // the states that it returns to `modes`. All that is pointed to must outlive it.
  SwitchingIntegrator(const SwitchingModel* model, const Eigen::ArrayXXd* parameters,
                      const BlockInputs* inputs, double relative_tolerance, double time_s,
                      const ConstBlock& states, Eigen::ArrayXXd* modes);

  double time_s() const override { return time_s_; }
  ConstBlock states() const override { return reached_; }
  IntegratorOutcome AdvanceTo(double time_s, double stop_time_s, int max_steps,
                              Block states) override;
  void Restart() override { restart_ = true; }
  bool LooksStiff() override;
  bool Outputs(double time_s, const ConstBlock& states, Block outputs) override;

 private:
  Eigen::Index rows() const { return reached_.rows(); }
  RowProgress& row_of(Eigen::Index row) { return progress_[static_cast<size_t>(row)]; }
  void Begin(double span_s, double stop_s);
  bool ChooseTrials(double time_s, double stop_s);
  void TakeTrials();
  bool IsRounding(Eigen::Index row);
  void JudgeFull(Eigen::Index row);
  void JudgeLocating(Eigen::Index row);
  double ErrorOf(Eigen::Index row);
  void Accept(Eigen::Index row, double length_s, bool hits_stop);
  void Switch(Eigen::Index row);
  bool LeaveAtEdge(Eigen::Index row);
  void SetFloors();
  void RenewFloors();
  void RatesBelow(Eigen::Index row, double time_s, const Eigen::ArrayXXd& states);
  void FirstStep(Eigen::Index row, double span_s);
  void NoteStiffness(Eigen::Index row, double length_s);
  void WriteStates(double time_s, Block states);
  void Fail(Eigen::Index row, const char* reason);
  double Resolution(const RowProgress& row) const;

  // Why a row cannot go on.
  static constexpr const char* kEndless = "switchings follow one another without end";
  static constexpr const char* kContradiction = "the conditions that switch contradict one another";
  static constexpr const char* kTooManySwitchings = "too many switchings between two samples";
  static constexpr const char* kNoStep = "no step size gives an acceptable error";
  static constexpr const char* kTooManySteps = "too many steps between two samples";

  const SwitchingModel* model_;
  double relative_tolerance_;
  SwitchedRows switched_;
  RowSteps steps_;
  SwitchLooks looks_;
  ErrorScale scale_;
  Eigen::ArrayXXd* encoded_modes_;

  double time_s_;                 // of reached_
  double target_s_ = -kInfinity;  // of the last call
  Eigen::ArrayXXd reached_;
  std::vector<RowProgress> progress_;
  Eigen::ArrayXXd begin_;           // states at the beginning of the last steps
  Eigen::ArrayXXd end_;             // states at their ends
  RowSteps::Stages stages_;         // of the last steps
  SwitchedRows::Modes step_modes_;  // in the last steps
  Eigen::ArrayXXd first_rates_;     // of the next steps
  Eigen::ArrayXXd below_;           // rates on the lower side of surfaces
  Eigen::ArrayXXd tolerance_;       // rows × switches: an error of the arguments

  // Work space.
  Eigen::ArrayXd times_s_, lengths_s_;
  Eigen::ArrayXd modes_of_row_;  // encoded

  bool begun_ = false;
  bool restart_ = false;
  double span_s_ = 0;
  double smooth_from_s_;
  double last_stop_s_ = kInfinity;
  double longest_s_ = kInfinity;
  IntegratorOutcome outcome_;
};

}  // namespace polyest::internal
