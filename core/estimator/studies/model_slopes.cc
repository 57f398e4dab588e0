#include "core/estimator/studies/model_slopes.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "core/propagation/ensemble_propagator.h"

namespace polyest::internal {
namespace {

// The half step of a difference, in standard deviations of the germ, and the most that the
// integration may be wrong. A phase of f radians for each standard deviation leaves f²h²/6 of the
// slope out, and an error e of the trajectories e/h: 4 % of a phase of 100, and 2·10⁻⁸.
constexpr double kHalfStep = 0.005;
constexpr double kTolerance = 1e-10;

// The points of one draw: itself, then one below and one above it along each germ.
class Stencil {
 public:
  Stencil(const Prior& prior, const Matrix& xis) : prior_(prior), xis_(xis) {}

  int points() const { return 1 + 2 * prior_.dimension(); }
  int row(int draw) const { return draw * points(); }

  double Lower(int draw, int j) const {
    return std::max(xis_(draw, j) - Step(j), prior_.lower()[j]);
  }
  double Upper(int draw, int j) const {
    return std::min(xis_(draw, j) + Step(j), prior_.upper()[j]);
  }

  Matrix Thetas() const {
    Matrix thetas(xis_.rows() * points(), xis_.cols());
    for (int draw = 0; draw < static_cast<int>(xis_.rows()); ++draw) {
      const auto set = [&](int point, const Vector& xi) {
        thetas.row(row(draw) + point) = prior_.ToParameters(xi).transpose();
      };
      const Vector xi = xis_.row(draw).transpose();
      set(0, xi);
      for (int j = 0; j < prior_.dimension(); ++j) {
        Vector shifted = xi;
        shifted[j] = Lower(draw, j);
        set(1 + 2 * j, shifted);
        shifted[j] = Upper(draw, j);
        set(2 + 2 * j, shifted);
      }
    }
    return thetas;
  }

 private:
  double Step(int j) const { return kHalfStep * prior_.GermStandardDeviation()[j]; }

  const Prior& prior_;
  const Matrix& xis_;
};

// Takes the values of all trajectories (Q × columns) as those of the rows from `first` on.
void TakeValues(const Stencil& stencil, const Matrix& values, Eigen::Index first,
                std::vector<OutputsAtDraw>& outputs) {
  for (int draw = 0; draw < static_cast<int>(outputs.size()); ++draw) {
    OutputsAtDraw& at = outputs[static_cast<size_t>(draw)];
    const int row = stencil.row(draw);
    at.values.segment(first, values.cols()) = values.row(row).transpose();
    for (int j = 0; j < static_cast<int>(at.slopes.cols()); ++j) {
      const double width = stencil.Upper(draw, j) - stencil.Lower(draw, j);
      at.slopes.col(j).segment(first, values.cols()) =
          (values.row(row + 2 + 2 * j) - values.row(row + 1 + 2 * j)).transpose() / width;
    }
  }
}

// Leaves out the draws of which a trajectory has failed.
absl::Status LeaveOutFailed(const Stencil& stencil, ModelAtDraws& model) {
  std::vector<bool> failed(model.outputs.size(), false);
  for (const PointFailure& failure : model.failures) {
    failed[static_cast<size_t>(failure.point / stencil.points())] = true;
  }
  std::vector<int> kept;
  std::vector<OutputsAtDraw> outputs;
  for (size_t draw = 0; draw < failed.size(); ++draw) {
    if (failed[draw]) continue;
    kept.push_back(static_cast<int>(draw));
    outputs.push_back(std::move(model.outputs[draw]));
  }
  if (kept.empty()) {
    const PointFailure& first = model.failures.front();
    return absl::FailedPreconditionError(
        absl::StrFormat("the model could not be integrated at any draw of the prior; the first "
                        "trajectory failed at t = %g s: %s (solver flag %d)",
                        first.time_s, first.reason, first.flag));
  }
  model.outputs = std::move(outputs);
  model.xis = Matrix(model.xis(kept, Eigen::all));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ModelAtDraws> EvaluateAtDraws(const ResolvedProblem& problem,
                                             const std::vector<int>& outputs, const Matrix& xis,
                                             const TimeGrid& grid, int threads, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckIsOfThePrior(problem));
  ResolvedProblem precise = problem;
  precise.set_relative_tolerance(
      std::min(kTolerance, problem.problem().integration.relative_tolerance));
  const Stencil stencil(precise.prior(), xis);
  const InputSignals inputs = precise.MakeInputs();
  EnsemblePropagator ensemble(precise.MakeEnsemble(stencil.Thetas(), outputs, threads), &inputs);
  const auto m = static_cast<int64_t>(outputs.size());
  const Eigen::Index rows = grid.count() * m;
  ModelAtDraws model{xis, {}, ensemble.points(), {}};
  model.outputs.assign(static_cast<size_t>(xis.rows()), {Vector(rows), Matrix(rows, xis.cols())});
  const auto take = [&](int64_t first, const Matrix& values) {
    TakeValues(stencil, values, first * m, model.outputs);
    return absl::OkStatus();
  };
  POLYEST_RETURN_IF_ERROR(PropagateOver(grid, m, ensemble, take, stop));
  model.failures = ensemble.failures();
  POLYEST_RETURN_IF_ERROR(LeaveOutFailed(stencil, model));
  return model;
}

}  // namespace polyest::internal
