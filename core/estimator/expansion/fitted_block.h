#pragma once

// A block of rows with the outputs of an expansion's trajectories in them, and their fit.

#include "core/common/types.h"
#include "polyest/samples.h"

namespace polyest::internal {

// With m channels, S terms, and Q collocation, C check and K control points. Channel c of row k is
// column k·m + c.
struct FittedBlock {
  // The rows. Samples of channels with correlated noise are whitened (record/whitening.h), and the
  // noise is as it has been learned.
  RowBlock rows;
  Matrix outputs;            // (Q + C + K) × columns, whitened as the samples are
  Matrix coefficients;       // S × columns: c = A⁺ Y (10)
  Vector residual_variance;  // ρ of the fit, one for each column
  Matrix check_predictions;  // the expansion at the check points, C × columns
  // With filters, as those above: log(S/σ²), its coefficients and the residual variance of its fit.
  Matrix log_variances;
  Matrix log_variance_coefficients;
  Vector log_variance_residual;
  // The fit has the first so many rows: all, unless too few trajectories are left at the next one.
  int fitted_rows = 0;

  int Column(int row, int channel) const {
    return row * static_cast<int>(rows.noise.size() / rows.rows.size()) + channel;
  }
  const SampleRow& Row(int row) const { return rows.rows[static_cast<size_t>(row)]; }
  // The sample of a channel; NaN where it is missing.
  double Value(int row, int channel) const {
    const size_t width = rows.width();
    return rows.values[static_cast<size_t>(row) * width + static_cast<size_t>(channel)];
  }
  // The standard deviation of its noise; 0 where it is missing.
  double Noise(int row, int channel) const {
    return rows.noise[static_cast<size_t>(Column(row, channel))];
  }
};

}  // namespace polyest::internal
