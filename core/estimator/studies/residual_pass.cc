#include "core/estimator/studies/residual_pass.h"

namespace polyest::internal {

void ResidualPass::Compare(const RowBlock& block, Matrix& outputs) const {
  const auto channels = static_cast<size_t>(problem_.channels());
  const size_t width = channels + problem_.streamed_inputs().size();
  for (size_t row = 0; row < block.rows.size(); ++row) {
    for (size_t c = 0; c < channels; ++c) {
      auto y = outputs.col(static_cast<Eigen::Index>(row * channels + c));
      const double sigma = block.noise[row * channels + c];
      if (!(sigma > 0) || block.rows[row].time_s < problem_.used_from_s()[c]) {
        y.setZero();
        continue;
      }
      const double first = y[0];
      y.array() -= first;
      y[0] = block.values[row * width + c] - first;
      y /= sigma;
    }
  }
}

absl::Status ResidualPass::Run(const Matrix& thetas, int64_t rows, double late_s, Take take,
                               const Stop& stop) const {
  const auto compare = [&](const RowBlock& block, Matrix& outputs, bool begins_run) {
    Compare(block, outputs);
    take(outputs, begins_run);
  };
  return pass_.Run(thetas, rows, late_s, compare, stop);
}

}  // namespace polyest::internal
