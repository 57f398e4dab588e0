#include "core/fmu/worker/pointwise_ensemble.h"

#include <algorithm>
#include <limits>

namespace polyest::internal {

absl::Status PointwiseEnsemble::Advance(std::span<const double> times_s, MatrixRef outputs,
                                        const Stop& stop) {
  for (int point = 0; point < points(); ++point) {
    if (absl::Status status = stop.Check(); !status.ok()) return status;
    AdvancePoint(point, times_s, outputs);
  }
  std::sort(failures_.begin(), failures_.end(),
            [](const PointFailure& a, const PointFailure& b) { return a.point < b.point; });
  return absl::OkStatus();
}

void PointwiseEnsemble::AdvancePoint(int point, std::span<const double> times_s,
                                     MatrixRef outputs) {
  std::unique_ptr<PointTrajectory>& trajectory = points_[static_cast<size_t>(point)];
  Vector row(outputs_);
  for (size_t k = 0; k < times_s.size(); ++k) {
    if (trajectory != nullptr &&
        !(trajectory->AdvanceTo(times_s[k]) && trajectory->ReadOutputs(row.data()))) {
      failures_.push_back(trajectory->failure());
      failures_.back().point = point;
      trajectory.reset();
    }
    if (trajectory == nullptr) row.setConstant(std::numeric_limits<double>::quiet_NaN());
    outputs.row(point).segment(static_cast<Eigen::Index>(k) * outputs_, outputs_) = row;
  }
}

}  // namespace polyest::internal
