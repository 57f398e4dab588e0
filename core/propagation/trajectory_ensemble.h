#pragma once

// The interface and the specification of an ensemble: one trajectory of a model for each point, all
// advanced together from one sample time to the next.

#include <absl/status/status.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/common/types.h"
#include "core/model/input_signal.h"
#include "core/propagation/point_equations.h"
#include "polyest/integration_options.h"
#include "polyest/model.h"
#include "polyest/stop.h"

namespace polyest::internal {

// The inputs of one run, in the model's order. All points share them except for the channels'
// amplitudes, delays and offsets.
using InputSignals = std::vector<InputSignal>;

// The state of an ensemble at a checkpoint: all that its continuation depends on, except for its
// specification.
struct EnsembleState {
  struct OfBlock {
    std::vector<int> source;  // by row: the block's point that it carries
    std::vector<bool> alive;  // by point
    Eigen::ArrayXXd states;   // rows × states
    // rows × switches of the model: the mode of each switch, halfway between its two modes if the
    // row slides along the surface where it switches, NaN if it follows from the states.
    Eigen::ArrayXXd modes;
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
  // y(t) = gain · h(t − delay) + offset; an empty matrix stands for no delay, offset 0 and gain 1.
  Matrix amplitudes;         // Q × inputs of the model
  Matrix input_delays_s;     // Q × inputs
  Matrix input_offsets;      // Q × inputs
  std::vector<int> outputs;  // columns of the model's outputs to read
  Matrix output_gains;       // Q × outputs read
  Matrix output_offsets;     // Q × outputs read
  Matrix output_delays_s;    // Q × outputs read
  // How far beyond a time streamed inputs are settled when Advance is called for it, in s, ≥ 0. No
  // delay of an output may be below its negative if an input is streamed.
  double inputs_ahead_s = 0;
  // Q × states: spectral densities of white process noise, in (unit of the state)²/s. Filters alone
  // use it (filter_bank.h); a trajectory has none. Empty: none.
  Matrix process_noise;
  // Q × outputs read: factors of the noise of samples. Filters alone use it. Empty: 1.
  Matrix noise_factors;
  // By output read: whether the noise of its samples is Student's t (heavy_tail.h). Filters alone
  // use it. Empty: none is.
  std::vector<bool> heavy_tailed;
  IntegrationOptions integration;
  int threads = 1;
};

class TrajectoryEnsemble {
 public:
  virtual ~TrajectoryEnsemble() = default;

  virtual int points() const = 0;

  // Advances to each time in turn (non-decreasing, ≥ the time reached; the first may be 0) and
  // writes the m outputs at the k-th time into columns k·m … k·m + m − 1 of `outputs`, Q × (m ·
  // times). A trajectory that fails is recorded in failures(); its row is NaN from its failure on.
  // Fails on a stop request, or if the simulation as a whole is lost; Advance must not be called
  // again then.
  virtual absl::Status Advance(std::span<const double> times_s, MatrixRef outputs,
                               const Stop& stop) = 0;

  // The failures so far, ordered by point.
  virtual const std::vector<PointFailure>& failures() const = 0;

  // Returns the state at a checkpoint (IntegrationOptions::samples_between_checkpoints); nothing
  // elsewhere, and for models that simulate themselves.
  virtual std::optional<EnsembleState> State() const { return std::nullopt; }
  // Continues a new ensemble of the same specification from `state`. The inputs' knots up to there,
  // and those after that smooth inputs need, must be appended before it advances. Returns false and
  // changes nothing if the state cannot belong to such an ensemble.
  virtual bool Restore(const EnsembleState& /*state*/) { return false; }
};

// A model that simulates itself, because its equations are not known.
class SelfPropagatingModel : public Model {
 public:
  // Starts the ensemble at t = 0; the caller applies the gains, offsets and delays of outputs.
  // `inputs` must outlive the ensemble; knots of streamed inputs are appended between calls of its
  // Advance.
  virtual std::unique_ptr<TrajectoryEnsemble> StartEnsemble(EnsembleSpecification specification,
                                                            const InputSignals* inputs) const = 0;

  // Returns why filters, which set states, cannot use the model: a phrase about it that begins with
  // a verb. Empty if they can. By default, a model tells nothing but its outputs.
  virtual std::string WhyNotFiltered() const { return "tells its outputs only"; }
  // Starts the model's equations for the points of an ensemble; only if WhyNotFiltered is empty. A
  // call evaluates points n·i … n·i + n − 1 at most, with n = `points_together`. `inputs` must
  // outlive them and have their first values at the first evaluation.
  virtual std::shared_ptr<PointEquations> StartEquations(
      const EnsembleSpecification& /*specification*/, const InputSignals* /*inputs*/,
      int /*points_together*/) const {
    return nullptr;
  }
};

}  // namespace polyest::internal
