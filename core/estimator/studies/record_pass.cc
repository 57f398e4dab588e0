#include "core/estimator/studies/record_pass.h"

#include <algorithm>
#include <optional>

#include "core/common/status.h"
#include "core/estimator/record/run_inputs.h"
#include "core/estimator/record/whitening.h"
#include "core/propagation/ensemble_propagator.h"

namespace polyest::internal {
namespace {

constexpr int64_t kPassRows = 64;  // at once

}  // namespace

// A run, in which the model starts anew, with the run's own inputs.
struct RecordPass::RunOfModel {
  RunOfModel(const RecordPass& of, const Matrix& thetas, Eigen::Index values, int run,
             int64_t first_row)
      : number(run),
        trajectories(thetas.rows()),
        inputs(of.problem_, &of.store_, run, first_row),
        ensemble(of.problem_.MakeEnsemble(thetas, of.problem_.outputs(), of.threads_, run),
                 &inputs.signals()),
        whitening(of.noise_, values) {}

  int number;
  Eigen::Index trajectories;
  RunInputs inputs;
  EnsemblePropagator ensemble;
  Whitening whitening;
  double time_s = 0;  // of the last row
};

// Reads the next rows, as far as they are of the same run.
absl::Status RecordPass::ReadOfOneRun(int64_t first, int64_t rows, RowBlock& block) const {
  POLYEST_RETURN_IF_ERROR(store_.Read(first, std::min(kPassRows, rows - first), block));
  const auto same = std::ranges::count(block.rows, block.rows.front().run, &SampleRow::run);
  return same == block.count() ? absl::OkStatus() : store_.Read(first, same, block);
}

// Returns the outputs of the trajectories and, for each channel, those of the first one with that
// channel late. These come from the same trajectory, read a little before each row.
absl::StatusOr<Matrix> RecordPass::Outputs(const RowBlock& block, double late_s, RunOfModel& run,
                                           const Stop& stop) const {
  const Eigen::Index m = problem_.channels();
  std::vector<double> times, early_s;
  for (const SampleRow& row : block.rows) {
    early_s.push_back(std::min(late_s, 0.5 * (row.time_s - run.time_s)));
    if (early_s.back() > 0) times.push_back(row.time_s - early_s.back());
    times.push_back(row.time_s);
    run.time_s = row.time_s;
  }
  Matrix read(run.trajectories, m * std::ssize(times));
  POLYEST_RETURN_IF_ERROR(run.ensemble.Advance(times, read, stop));
  Matrix outputs(run.trajectories + (late_s > 0 ? m : 0), m * block.count());
  Eigen::Index at = 0;
  for (Eigen::Index row = 0; row < block.count(); ++row) {
    const double early = early_s[static_cast<size_t>(row)];
    const Eigen::Index before = at;
    if (early > 0) at += m;
    auto values = outputs.middleCols(row * m, m);
    values.topRows(run.trajectories) = read.middleCols(at, m);
    for (Eigen::Index c = 0; late_s > 0 && c < m; ++c) {
      values.row(run.trajectories + c) = read.row(0).segment(at, m);
      if (early > 0) {
        values(run.trajectories + c, c) += late_s / early * (read(0, before + c) - read(0, at + c));
      }
    }
    at += m;
  }
  return outputs;
}

absl::Status RecordPass::Run(const Matrix& thetas, int64_t rows, double late_s, Take take,
                             const Stop& stop) const {
  const Eigen::Index values = thetas.rows() + (late_s > 0 ? problem_.channels() : 0);
  std::optional<RunOfModel> run;
  RowBlock block;
  for (int64_t first = 0; first < rows; first += block.count()) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    POLYEST_RETURN_IF_ERROR(ReadOfOneRun(first, rows, block));
    const int number = block.rows.front().run;
    const bool begins = !run || run->number != number;
    if (begins) run.emplace(*this, thetas, values, number, first);
    POLYEST_RETURN_IF_ERROR(run->inputs.ReadUpTo(block.rows.back().time_s));
    POLYEST_ASSIGN_OR_RETURN(Matrix outputs, Outputs(block, late_s, *run, stop));
    run->whitening.Apply(0, block.count(), block, outputs);
    take(block, outputs, begins);
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
