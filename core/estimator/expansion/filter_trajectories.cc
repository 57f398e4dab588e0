// Filters in place of trajectories, where the likelihood is that of prediction errors
// (fitted_trajectories.h).

#include <vector>

#include "core/common/status.h"
#include "core/estimator/expansion/fitted_trajectories.h"

namespace polyest::internal {
namespace {

// Replaces the whitened innovations w of the rows by z − σ w, of which they are the residuals in
// units of the noise. They stay 0 without a sample.
void SubstituteInnovations(int first, int count, int channels, FittedBlock& block) {
  for (int row = first; row < first + count; ++row) {
    for (int c = 0; c < channels; ++c) {
      const double sigma = block.Noise(row, c);
      if (!(sigma > 0)) continue;
      const double z = block.Value(row, c);
      for (double& output : block.outputs.col(block.Column(row, c))) output = z - sigma * output;
    }
  }
}

}  // namespace

void FittedTrajectories::StartFilters(int run) {
  filters_ = std::make_unique<FilterBank>(
      problem_.MakeEnsemble(thetas_, problem_.outputs(), threads_, run), &inputs_->signals());
  StartControls(run);
}

// Takes rows of the block that are of the present run.
absl::Status FittedTrajectories::AdvanceFilters(int first, int count, FittedBlock& block,
                                                const Stop& stop) {
  std::vector<double> times_s;
  Matrix values(channels_, count), noise(channels_, count);
  for (int k = 0; k < count; ++k) {
    times_s.push_back(block.Row(first + k).time_s);
    for (int c = 0; c < channels_; ++c) {
      values(c, k) = block.Value(first + k, c);
      noise(c, k) = block.Noise(first + k, c);
    }
  }
  block.log_variances.resize(block.outputs.rows(), block.outputs.cols());
  block.log_variance_coefficients.resize(block.coefficients.rows(), block.coefficients.cols());
  block.log_variance_residual.resize(block.residual_variance.size());
  const FilterSamples samples{times_s, values, noise};
  auto innovations = block.outputs.middleCols(first * channels_, count * channels_);
  auto variances = block.log_variances.middleCols(first * channels_, count * channels_);
  POLYEST_RETURN_IF_ERROR(filters_->Advance(samples, innovations.topRows(trajectories()),
                                            variances.topRows(trajectories()), stop));
  if (controls_ > 0) {
    POLYEST_RETURN_IF_ERROR(control_filters_->Advance(samples, innovations.bottomRows(controls_),
                                                      variances.bottomRows(controls_), stop));
  }
  SubstituteInnovations(first, count, channels_, block);
  return absl::OkStatus();
}

std::optional<FilteredStates> FittedTrajectories::Filtered() const {
  if (!filters_ || !shortage_.ok()) return std::nullopt;
  Matrix means, deviations;
  filters_->ReadStates(means, deviations);
  FilteredStates filtered{Matrix(design_.basis->size(), means.cols()),
                          Matrix(design_.basis->size(), means.cols())};
  Vector residual(means.cols());
  CollocationMatrix matrix = matrix_;
  matrix.Solve(means(kept_, Eigen::all), filtered.mean, residual);
  matrix.Solve(deviations(kept_, Eigen::all), filtered.deviation, residual);
  return filtered;
}

}  // namespace polyest::internal
