#pragma once

// One trajectory of a model for each point of an ensemble, advanced together from one sample time
// to the next: what is asked of whoever can do it, and the specification of it.

#include <absl/status/status.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/common/stop.h"
#include "core/common/types.h"
#include "core/model/input_signal.h"
#include "core/model/model.h"

namespace polyest {

enum class IntegrationMethod {
  kAuto,      // explicit; blocks that need too many steps change to the stiff method for good
  kExplicit,  // Dormand–Prince 5(4), ERKStep
  kStiff,     // BDF, CVODE, block-diagonal Newton
};

struct IntegrationOptions {
  IntegrationMethod method = IntegrationMethod::kAuto;
  // Estimated local error of each state of each point ≤ relative_tolerance × the largest magnitude
  // that this state has had so far over the block, + 1e-14 in SI units; in fact × that of the point
  // itself, unless that is below a thousandth of the block's (error_scale.h).
  double relative_tolerance = 1e-7;
  // Steps from one sample to the next, at most; past it a point has failed.
  int most_steps = 100'000;
  // ≥ 1. After so many samples of a run, and as many again, …, the integrators start anew from the
  // states there, as a run does from its initial states, so that what goes on from there is a
  // function of plain data (EnsembleState). That changes results, within the tolerance.
  int samples_between_checkpoints = 4096;

  absl::Status Validate() const;
};

// The inputs of one run, in the model's order; shared by all points but for the channels'
// amplitudes, delays and offsets.
using InputSignals = std::vector<InputSignal>;

// A trajectory that could not be integrated; it is left out from then on.
struct PointFailure {
  int point = 0;       // row in the ensemble
  double time_s = 0;   // the last time it was good
  int flag = 0;        // the solver's own return code
  std::string reason;  // that code in words
};

// An ensemble at a checkpoint, apart from its specification: all that its way from there depends
// on.
struct EnsembleState {
  struct OfBlock {
    std::vector<int> source;  // of each row, the block's point that it carries
    std::vector<bool> alive;  // by point
    Eigen::ArrayXXd states;   // rows × states
    bool stiff = false;       // integrated by the stiff method
    double last_break_s = 0;  // of the inputs
    std::vector<PointFailure> failures;
  };

  int64_t samples = 0;  // of the run so far
  double time_s = 0;    // of the last of them
  std::vector<OfBlock> blocks;
};

struct EnsembleSpecification {
  std::shared_ptr<const Model> model;
  Matrix parameters;  // Q × parameters of the model
  // The channels of each point, u_i(t) = amplitude_i · shape_i(t − delay_i) + offset_i and
  // y = gain · h + offset; an empty matrix stands for no delay, offset 0 and gain 1.
  Matrix amplitudes;         // Q × inputs of the model
  Matrix input_delays_s;     // Q × inputs
  Matrix input_offsets;      // Q × inputs
  std::vector<int> outputs;  // columns of the model's outputs to read
  Matrix output_gains;       // Q × outputs read
  Matrix output_offsets;     // Q × outputs read
  IntegrationOptions integration;
  int threads = 1;
};

class TrajectoryEnsemble {
 public:
  virtual ~TrajectoryEnsemble() = default;

  virtual int points() const = 0;

  // Advances to each time in turn (non-decreasing, ≥ the time reached; the first may be 0).
  // outputs is Q × (m · times), the m outputs at the k-th time in columns k·m … k·m + m − 1; rows
  // of failed points are NaN from their failure on. A trajectory that fails is recorded in
  // failures(). Not OK after a stop request, or when the simulation as a whole is lost; then
  // Advance must not be called again.
  virtual absl::Status Advance(std::span<const double> times_s, MatrixRef outputs,
                               const Stop& stop) = 0;

  // Ordered by point.
  virtual const std::vector<PointFailure>& failures() const = 0;

  // Of an ensemble at a checkpoint (IntegrationOptions::samples_between_checkpoints); nothing
  // elsewhere, and of models that simulate themselves.
  virtual std::optional<EnsembleState> State() const { return std::nullopt; }
  // Puts a new ensemble of the same specification there; the inputs' knots up to there, and as many
  // after as smooth inputs need, must be appended before it advances. False, and the ensemble
  // unchanged, when the state cannot be of such an ensemble.
  virtual bool Restore(const EnsembleState& /*state*/) { return false; }
};

// A model that is not known by its equations but simulates itself.
class SelfPropagatingModel : public Model {
 public:
  // The ensemble at t = 0; output_gains and output_offsets are applied by the caller. `inputs` must
  // outlive the ensemble; knots of streamed inputs are appended between calls of its Advance.
  virtual std::unique_ptr<TrajectoryEnsemble> StartEnsemble(EnsembleSpecification specification,
                                                            const InputSignals* inputs) const = 0;
};

}  // namespace polyest
