#pragma once

// The right-hand side of rows whose equations switch, with the modes of each row frozen.
//
// A row crosses the surface where the argument a_i of a switch leaves its piece, or it slides along
// it: if the fields on both sides point at the surface it stays on it, as a mass does that dry
// friction holds. With the modes of all sliding switches at their lower values the rates are f, and
// raising the mode of switch j alone changes them by Δ_j. Then (A. F. Filippov, Differential
// Equations with Discontinuous Righthand Sides, 1988, section 4)
//
//   ẋ = f + Σ_j λ_j Δ_j,  where the λ_j keep ȧ_i = 0:  Σ_j (∇a_i · Δ_j) λ_j = −(∂a_i/∂t + ∇a_i · f)
//
// for all sliding switches i and j. For one switch this is the convex combination of the fields of
// both sides. Sliding ends where a λ_j leaves [0, 1]. If several switches slide at once their
// effects add, as those of independent friction forces do. What the equations leave open, such as
// how several friction forces share the load of masses that all stick, is taken with λ = ½ as far
// as that goes; a switch beyond its limits then keeps one of its modes, and the others hold it.
//
// An argument that depends on the mode of another switch may jump when that mode changes. Its
// switch then takes the mode of the new argument at the same instant.

#include <Eigen/Core>
#include <vector>

#include "core/common/types.h"
#include "core/model/switching_model.h"
#include "core/propagation/block_inputs.h"
#include "core/propagation/row_steps.h"
#include "core/propagation/row_variants.h"

namespace polyest::internal {

class SwitchedRows final : public RowSystem {
 public:
  // The modes of each row.
  struct Modes {
    Eigen::ArrayXXd
        values;  // rows × (1 + switches): a time, the modes (the lower one if it slides)
    Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> sliding;  // rows × switches
  };
  struct Interval {
    double lower, upper;
  };

  // All that is pointed to must outlive the object. The model must have switches.
  SwitchedRows(const SwitchingModel* model, const Eigen::ArrayXXd* parameters,
               const BlockInputs* inputs, Eigen::Index states);

  Eigen::Index switches() const { return modes_.sliding.cols(); }
  const Modes& modes() const { return modes_; }
  bool IsSliding(Eigen::Index row) const { return modes_.sliding.row(row).any(); }

  // A mode as one number: halfway between its two modes for a switch that slides, NaN if it is not
  // known yet.
  double Encoded(const Modes& modes, Eigen::Index row, Eigen::Index which) const;
  void Decode(Eigen::Index row, Eigen::Index which, double encoded);

  // The inputs are smooth from the first time to the second.
  void SetSmoothSpan(double from_s, double until_s, double difference_s);

  // Whether nobody asks for what Rates and Observe write for the row.
  void SetResting(Eigen::Index row, bool rests) { resting_[static_cast<size_t>(row)] = rests; }

  void Rates(const Eigen::ArrayXd& times_s, const Eigen::ArrayXXd& states,
             Eigen::ArrayXXd& rates) override;
  void RatesOfRow(Eigen::Index row, double time_s, const ConstBlock& states,
                  Eigen::ArrayXXd& rates);
  // Writes for each switch what must stay within its Bounds: the argument, or λ if it slides.
  void Observe(const Eigen::ArrayXd& times_s, const Eigen::ArrayXXd& states,
               Eigen::ArrayXXd& observed);
  void ObserveRow(Eigen::Index row, double time_s, const ConstBlock& states,
                  Eigen::ArrayXXd& observed);
  Interval Bounds(Eigen::Index row, Eigen::Index which) const;
  // Writes the outputs at one time, with these modes.
  void Outputs(double time_s, const ConstBlock& states, const Modes& modes, Block outputs);

  // Takes the modes that belong to the states, which may have any relation to the present ones. A
  // switch goes on sliding if its argument is within its `tolerance` (rows × switches). Returns
  // false if there are none.
  bool Settle(Eigen::Index row, double time_s, const ConstBlock& states,
              const Eigen::ArrayXXd& tolerance);
  // Takes the modes after what is observed of a switch has left its bounds, upwards or downwards.
  // Returns false if there are none.
  bool Leave(Eigen::Index row, double time_s, const ConstBlock& states, Eigen::Index which,
             bool upwards, const Eigen::ArrayXXd& tolerance);
  // Returns the bound at which the switch was left by the last Settle or Leave: −1 the lower one, 1
  // the upper one, 0 neither.
  int Departing(Eigen::Index row, Eigen::Index which) const { return departing_(row, which); }
  // Whether the switches that slide hold this one's argument at its surface as well, although it
  // does not slide itself.
  bool IsHeld(Eigen::Index row, Eigen::Index which) const { return held_(row, which); }
  void ForgetDeparture(Eigen::Index row) { departing_.row(row).setZero(); }

  // Writes |∂a_i/∂x| · (relative · |x| + 1/w) of each switch, an error of its argument.
  void ArgumentErrors(Eigen::Index row, double time_s, const ConstBlock& states, double relative,
                      const Eigen::ArrayXXd& weights, Eigen::ArrayXXd& errors);
  // Moves a row by as little as possible, in units of 1/w, onto the surfaces it slides on, and onto
  // that of a switch which it has just left.
  void Project(Eigen::Index row, double time_s, const Eigen::ArrayXXd& weights,
               Eigen::ArrayXXd& states, Eigen::Index left = -1);

 private:
  bool Rests(Eigen::Index row) const { return resting_[static_cast<size_t>(row)]; }
  // Where a switch at its surface goes.
  enum class Status { kLow, kSlides, kHigh };
  struct AtSurface {
    Eigen::Index which;
    double low, high;  // its two modes there
    Status status;
  };

  // Sets inputs_ to those of each row at its own time.
  void ReadInputs(const Eigen::Ref<const Eigen::ArrayXd>& times_s);
  void GatherSliding(const Modes& modes, Eigen::Index row);
  void Gather(Eigen::Index which, double mode, double argument, double tolerance);
  void Analyse(Eigen::Index row, double time_s, const ConstBlock& states, const Modes& modes);
  void Differentiate(Eigen::Index row, double time_s);
  void SolveSliding();
  bool ResolveAll(Eigen::Index row, double time_s, const ConstBlock& states,
                  const Eigen::ArrayXXd& tolerance);
  bool Resolve(Eigen::Index row, double time_s, const ConstBlock& states);
  bool TakeJumps(Eigen::Index row, double time_s, const ConstBlock& states,
                 const Eigen::ArrayXXd& tolerance);
  bool Correct();
  void Accept(Eigen::Index row);
  bool IsDependent(size_t surface);
  double Product(Eigen::Index i, Eigen::Index j) const;
  void GatherOthers(Eigen::Index row, double time_s, const ConstBlock& states, Eigen::Index except,
                    const Eigen::ArrayXXd& tolerance);
  bool TakeNaturalModes(Eigen::Index row, double time_s, const ConstBlock& states,
                        const Eigen::ArrayXXd& tolerance);
  // Returns half the distance between two modes of the switch.
  double HalfStep(Eigen::Index which) const {
    return model_->switches()[static_cast<size_t>(which)] == SwitchKind::kSign ? 1 : 0.5;
  }
  double Slope(Eigen::Index which, Eigen::Index variable) const {
    return (*slopes_)(0, variable * switches() + which);
  }

  const SwitchingModel* model_;
  const Eigen::ArrayXXd* parameters_;
  const BlockInputs* inputs_of_rows_;
  Modes modes_;
  Eigen::ArrayXXi departing_;
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> held_;
  std::vector<bool> resting_;
  double smooth_from_s_ = 0;
  double smooth_until_s_ = 0;
  double difference_s_ = 0;
  Eigen::ArrayXXd inputs_;
  Eigen::ArrayXXd output_modes_;
  RowVariants variants_;

  // What was found about the row that was analysed last.
  std::vector<AtSurface> surfaces_;
  const Eigen::ArrayXXd* slopes_ = nullptr;
  Eigen::ArrayXd before_;     // switches: arguments before the modes changed
  Eigen::ArrayXXd changes_;   // surfaces × states: Δ_j
  Eigen::ArrayXXd effects_;   // surfaces²: ∇a_i · Δ_j
  Eigen::ArrayXd drift_;      // surfaces: ȧ_i without what slides
  Eigen::ArrayXd approach_;   // surfaces: ȧ_i
  Eigen::ArrayXd rounding_;   // surfaces: below which ȧ_i is 0
  Eigen::ArrayXd lambda_;     // surfaces
  Eigen::ArrayXd row_rates_;  // states
  Eigen::ArrayXXd matrix_;    // of the linear system
  Eigen::ArrayXd right_side_;
  Eigen::ArrayXd solution_;
  std::vector<Eigen::Index> columns_, columns_of_sliding_;
};

// Solves A x = b for the first n rows and columns by elimination with complete pivoting. Unknowns
// that the equations leave open become `open`. A and b are overwritten; `order` is a work space.
void SolveSmall(Eigen::Index n, double open, Eigen::ArrayXXd& A, Eigen::ArrayXd& b,
                Eigen::ArrayXd& x, std::vector<Eigen::Index>& order);

}  // namespace polyest::internal
