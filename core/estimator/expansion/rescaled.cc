#include "core/estimator/expansion/rescaled.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/expansion_state.h"
#include "core/estimator/expansion/replay.h"

namespace polyest::internal {
namespace {

bool AreSame(const Vector& a, const Vector& b) { return a.size() == b.size() && a == b; }
bool AreSame(const Matrix& a, const Matrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && a == b;
}

// Whether nothing but the scale differs.
bool DifferInScale(const ChannelNoise& a, const ChannelNoise& b) {
  return a.time_constant_s == b.time_constant_s && a.white_share == b.white_share &&
         a.learned == b.learned && a.of_prediction == b.of_prediction &&
         a.grid.shortest_s == b.grid.shortest_s && a.grid.longest_s == b.grid.longest_s;
}

// Returns the factors of the channels' variances (m), if they are all that differs and the sums can
// be divided by them.
std::optional<Vector> VarianceFactors(const ResolvedProblem& problem,
                                      const RegionalExpansion& present, const LearnedNoise& after) {
  const LearnedNoise& before = present.noise();
  if (!AreSame(before.centre, after.centre) ||
      !AreSame(before.posterior.centre, after.posterior.centre) ||
      !AreSame(before.posterior.factor, after.posterior.factor)) {
    return std::nullopt;
  }
  Vector factors(std::ssize(after.channels));
  for (size_t c = 0; c < after.channels.size(); ++c) {
    const ChannelNoise &a = before.channels[c], &b = after.channels[c];
    if (!DifferInScale(a, b)) return std::nullopt;
    factors[static_cast<Eigen::Index>(c)] = b.scale * b.scale / (a.scale * a.scale);
    if (a.scale == b.scale) continue;
    const bool plain = b.learned && !present.absorbed().KeptRelative(static_cast<int>(c)) &&
                       b.grid.empty() && !problem.uses_filters() &&
                       problem.problem().measured[c].noise.outliers == OutlierHandling::kNone;
    if (!plain) return std::nullopt;
  }
  return factors;
}

// Divides what belongs to samples that are kept by themselves, whose own noise stays as it is.
void Divide(const Vector& factors, const AbsorbedRows& absorbed, SampleBySample& few) {
  const double least = factors.minCoeff();
  few.own_error /= least;
  few.check_residual /= least;
  for (Eigen::Index c = 0; c < factors.size(); ++c) {
    few.check_chi_squared.col(c) /= factors[c];
    few.point_chi_squared.col(c) /= factors[c];
    const auto samples = static_cast<double>(absorbed.sums[static_cast<size_t>(c)].samples.count());
    few.log_noise += 0.5 * samples * std::log(factors[c]);
    few.log_variance += 0.5 * samples * std::log(factors[c]);
  }
}

void Divide(const Vector& factors, AbsorbedRows& absorbed) {
  if (absorbed.few) Divide(factors, absorbed, *absorbed.few);
  const double least = factors.minCoeff();
  absorbed.own_error /= least;
  absorbed.carried_error /= least;
  absorbed.carried_rate /= least;
  absorbed.check_residual /= least;
  absorbed.windows.Divide(factors, absorbed.sums);
  for (Eigen::Index c = 0; c < factors.size(); ++c) {
    ChannelSums& sums = absorbed.sums[static_cast<size_t>(c)];
    const auto terms = static_cast<Eigen::Index>(sums.samples.terms());
    const Matrix same = Matrix::Identity(terms, terms);
    const Vector unmoved = Vector::Zero(terms);
    sums.samples = sums.samples.Substituted(same, unmoved, factors[c]);
    sums.differences = sums.differences.Substituted(same, unmoved, factors[c]);
    absorbed.previous_coefficients.col(c) /= std::sqrt(factors[c]);
    absorbed.previous_error[c] /= std::sqrt(factors[c]);
    absorbed.discount[c] /= factors[c];
    absorbed.check_chi_squared.col(c) /= factors[c];
    absorbed.point_chi_squared.col(c) /= factors[c];
    for (Eigen::Index i = c; i < absorbed.control_scores.cols(); i += factors.size()) {
      absorbed.control_scores.col(i) /= factors[c];
    }
    const double change = 0.5 * static_cast<double>(sums.samples.count()) * std::log(factors[c]);
    absorbed.log_noise += change;
    absorbed.log_variance += change;
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<RegionalExpansion>> Rescaled(
    const ResolvedProblem& problem, const RegionalExpansion& present, LearnedNoise noise,
    const SampleStore& store, int64_t rows, int threads, const Stop& stop, double max_shift) {
  const bool is_short = rows <= RowsOfShortRecord(problem);
  if (is_short || !present.kept_state() || rows != present.absorbed_rows()) {
    return InfeasibleError("there is no state to go on from");
  }
  const std::optional<Vector> factors = VarianceFactors(problem, present, noise);
  if (!factors) return InfeasibleError("more than scales of noise differs");
  ExpansionState state = *present.kept_state();
  if ((factors->array() != 1).any()) {
    const double error = present.absorbed().OwnError() / factors->minCoeff();
    if (!(error <= max_shift * max_shift * noise.misfit)) {
      return InfeasibleError("the expansion is not accurate enough");
    }
    Divide(*factors, state.absorbed);
    std::vector<PreviousSample>& previous = state.trajectories.previous;
    for (size_t c = 0; c < previous.size(); ++c) {
      previous[c].noise *= std::sqrt((*factors)[static_cast<Eigen::Index>(c)]);
    }
  }
  state.absorbed.propagated = 0;
  // The residuals are linearized about another point from here on.
  for (ResidualBlocks& blocks : state.absorbed.blocks) blocks = blocks.Renewed();
  state.noise = noise.ForNewExpansion();
  state.design.element =
      present.design().element.bounds();  // it may have been freed from bounds since
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> expansion =
      RegionalExpansion::FromState(problem, std::move(state), store, threads, stop);
  if (absl::IsDataLoss(expansion.status())) {
    return InfeasibleError("the state cannot be gone on from");
  }
  POLYEST_RETURN_IF_ERROR(expansion.status());
  POLYEST_RETURN_IF_ERROR(TakeRows(store, rows, stop, **expansion));
  return expansion;
}

}  // namespace polyest::internal
