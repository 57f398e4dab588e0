#pragma once

// Propagation (9): one trajectory of the model for each point of an ensemble, advanced together
// from one sample time to the next, with the measured outputs read at exactly those times.
//
// The points are dealt into blocks of fixed size, each integrated as one ODE system; blocks are
// independent, so that results are the same bits for any number of threads and for any way of
// cutting the sample times into calls of Advance.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
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

  absl::Status Validate() const;
};

// The inputs of one run, in the model's order; shared by all points but for the amplitudes.
using InputSignals = std::vector<InputSignal>;

// A trajectory that could not be integrated; it is left out from then on.
struct PointFailure {
  int point = 0;       // row in the ensemble
  double time_s = 0;   // the last time it was good
  int flag = 0;        // the solver's own return code
  std::string reason;  // that code in words
};

struct EnsembleSpecification {
  std::shared_ptr<const Model> model;
  Matrix parameters;         // Q × parameters of the model
  Matrix amplitudes;         // Q × inputs of the model
  std::vector<int> outputs;  // columns of the model's outputs to read
  IntegrationOptions integration;
  int threads = 1;
};

class EnsemblePropagator {
 public:
  // The ensemble at t = 0. `inputs` must outlive the propagator; knots of streamed inputs may be
  // appended between calls, never at or before a time already passed.
  EnsemblePropagator(EnsembleSpecification specification, const InputSignals* inputs);
  ~EnsemblePropagator();
  EnsemblePropagator(EnsemblePropagator&&) noexcept;
  EnsemblePropagator& operator=(EnsemblePropagator&&) noexcept;

  int points() const;

  // Advances to each time in turn (non-decreasing, ≥ the time reached; the first may be 0).
  // outputs is Q × (m · times), the m outputs at the k-th time in columns k·m … k·m + m − 1; rows
  // of failed points are NaN from their failure on. Only a stop request makes it not OK: blocks are
  // then left at different times and Advance must not be called again. A trajectory that fails is
  // recorded in failures().
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs, const Stop& stop);

  // Ordered by point.
  const std::vector<PointFailure>& failures() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace polyest
