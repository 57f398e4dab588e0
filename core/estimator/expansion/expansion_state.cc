#include "core/estimator/expansion/expansion_state.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/common/finite_matrix.h"
#include "core/common/infeasible.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/expansion/inconsistent_state.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {
namespace {

// Whether an expansion of the problem can have this truncation: its first one or, for an automatic
// order, a higher one, over the whole prior in many dimensions only (return_to_prior.h).
bool IsTruncationOf(const ResolvedProblem& problem, const Truncation& truncation,
                    bool whole_prior) {
  const ExpansionOptions& options = problem.problem().expansion;
  const Truncation first = FirstTruncation(options, problem.dimension());
  if (truncation.exponent != first.exponent) return false;
  if (truncation.order == first.order) return true;
  return (!whole_prior || problem.dimension() > kFewDimensions) && !options.order &&
         truncation.order > first.order && truncation.order < kMaxTerms &&
         TermCount(problem.dimension(), truncation, kMaxTerms) <= kMaxTerms;
}

bool IsElementIn(int dimension, const std::vector<Element::Bound>& bounds) {
  return std::ranges::all_of(bounds, [&](const Element::Bound& bound) {
    return IsFiniteMatrix(bound.normal, dimension) && std::isfinite(bound.offset);
  });
}

bool IsDesignFor(const ResolvedProblem& problem, const DesignState& state) {
  const int n = problem.dimension();
  const Eigen::Index checks = state.check_points.rows();
  if (!IsTruncationOf(problem, state.truncation, state.whole_prior) ||
      !IsFiniteMatrix(state.centre, n) || !IsFiniteMatrix(state.axes, n, n) ||
      !IsFiniteMatrix(state.points, state.points.rows(), n) || state.points.rows() > kMaxPoints ||
      !IsFiniteMatrix(state.check_points, checks, n) || checks > kMaxPoints ||
      state.check_costs.size() != checks || !IsFiniteMatrix(state.reference, n) ||
      !IsFiniteMatrix(state.lower, n) || !IsFiniteMatrix(state.upper, n) ||
      !IsElementIn(n, state.element)) {
    return false;
  }
  return std::isfinite(LuFactors(state.axes).LogAbsDeterminant()) &&
         (state.upper - state.lower).minCoeff() > 0;
}

bool IsNoiseOf(const ResolvedProblem& problem, const LearnedNoise& noise) {
  if (std::ssize(noise.channels) != problem.channels()) return false;
  for (const double misfit : {noise.misfit, noise.misfit_of_weights}) {
    if (!(misfit >= 1 && std::isfinite(misfit))) return false;
  }
  for (const ChannelNoise& channel : noise.channels) {
    if (!(channel.scale > 0 && std::isfinite(channel.scale))) return false;
    if (!(channel.time_constant_s >= 0 && std::isfinite(channel.time_constant_s))) return false;
    if (!(channel.white_share >= 0 && channel.white_share < 1)) return false;
    const TimeConstantGrid& grid = channel.grid;
    if (grid.empty()) continue;
    if (!(grid.shortest_s > 0 && std::isfinite(grid.longest_s))) return false;
  }
  const int n = problem.dimension();
  if (noise.centre.size() > 0 && !IsFiniteMatrix(noise.centre, n)) return false;
  const PosteriorSummary& posterior = noise.posterior;
  return posterior.centre.size() == 0 ||
         (IsFiniteMatrix(posterior.centre, n) && IsFiniteMatrix(posterior.factor, n, n));
}

// Samples that are kept may have been given up since the beginning, but not the other way.
bool AreOfFew(const std::optional<SampleBySample>& state,
              const std::optional<SampleBySample>& fresh, int terms) {
  if (!state) return true;
  if (!fresh || state->channels.size() != fresh->channels.size()) return false;
  if (state->relative.size() != fresh->relative.size()) return false;
  for (size_t c = 0; c < fresh->channels.size(); ++c) {
    const RelativeSamples& relative = state->relative[c];
    if (relative.keeps() != fresh->relative[c].keeps() || !relative.IsValid(terms)) return false;
    const RobustSamples& samples = state->channels[c];
    if (samples.outliers() != fresh->channels[c].outliers() || !samples.IsValid(terms))
      return false;
  }
  return state->check_chi_squared.rows() == fresh->check_chi_squared.rows() &&
         state->check_chi_squared.cols() == fresh->check_chi_squared.cols() &&
         state->check_residual.size() == fresh->check_residual.size() &&
         state->point_chi_squared.rows() == fresh->point_chi_squared.rows() &&
         state->point_chi_squared.cols() == fresh->point_chi_squared.cols() &&
         state->check_log_variance.rows() == fresh->check_log_variance.rows() &&
         state->check_log_variance.cols() == fresh->check_log_variance.cols() &&
         state->point_log_variance.rows() == fresh->point_log_variance.rows() &&
         state->point_log_variance.cols() == fresh->point_log_variance.cols() &&
         IsFiniteMatrix(state->largest, fresh->largest.size()) && state->own_error >= 0 &&
         std::isfinite(state->own_error);
}

// Values accumulated at the check points may be infinite, since a trajectory may diverge.
bool HasSizesOf(const AbsorbedRows& state, const AbsorbedRows& fresh, bool has_windows) {
  const auto terms = static_cast<int>(fresh.previous_coefficients.rows());
  const auto channels = fresh.discount.size();
  for (const ChannelSums& sums : state.sums) {
    if (!sums.samples.IsValid(terms) || !sums.differences.IsValid(terms)) return false;
    if (!IsFiniteMatrix(sums.log_variance, fresh.sums.front().log_variance.size())) return false;
    if (!std::isfinite(sums.log_variance_at_reference)) return false;
    if (!std::isfinite(sums.surplus)) return false;
  }
  const auto same = [](const CorrelationProfile& a, const CorrelationProfile& b) {
    return a.HasSizesOf(b);
  };
  const auto alike = [](const ResidualBlocks& a, const ResidualBlocks& b) {
    return a.HasSizesOf(b);
  };
  const auto of_same = [](const OutlierDensity& a, const OutlierDensity& b) {
    return a.IsValidLike(b);
  };
  return state.sums.size() == fresh.sums.size() &&
         std::ranges::equal(state.densities, fresh.densities, of_same) &&
         state.windows.Suits(fresh.sums, has_windows ? state.rows : 0) &&
         std::ranges::equal(state.profiles, fresh.profiles, same) &&
         std::ranges::equal(state.blocks, fresh.blocks, alike) &&
         IsFiniteMatrix(state.discount, channels) && std::ssize(state.outliers) == channels &&
         IsFiniteMatrix(state.previous_coefficients, terms, channels) &&
         IsFiniteMatrix(state.previous_error, channels) &&
         IsFiniteMatrix(state.largest, channels) &&
         state.check_chi_squared.rows() == fresh.check_chi_squared.rows() &&
         state.check_chi_squared.cols() == channels &&
         state.check_residual.size() == fresh.check_residual.size() &&
         state.check_valid.size() == fresh.check_valid.size() &&
         state.point_chi_squared.rows() == fresh.point_chi_squared.rows() &&
         state.point_chi_squared.cols() == channels &&
         state.point_log_variance.size() == fresh.point_log_variance.size() &&
         IsFiniteMatrix(state.control_scores, terms, fresh.control_scores.cols()) &&
         state.control_valid.size() == fresh.control_valid.size() && state.rows >= 0 &&
         state.sample_count >= 0 && state.propagated >= 0 && state.own_error >= 0 &&
         std::isfinite(state.own_error) && state.carried_error >= 0 &&
         std::isfinite(state.carried_error) && state.carried_rate >= 0 &&
         std::isfinite(state.carried_rate) && AreOfFew(state.few, fresh.few, terms);
}

}  // namespace

DesignState StateOf(const ExpansionDesign& design) {
  return {design.basis->truncation(), design.whole_prior,   design.in_tails,
          design.region.centre(),     design.region.axes(), design.points,
          design.check_points,        design.check_costs,   design.checks_are_draws,
          design.reference,           design.lower,         design.upper,
          design.element.bounds()};
}

absl::StatusOr<ExpansionDesign> DesignOf(const ResolvedProblem& problem, DesignState state) {
  if (!IsDesignFor(problem, state)) return InconsistentState("expansion");
  const auto n = static_cast<size_t>(problem.dimension());
  ExpansionDesign design;
  design.region = Region(std::move(state.centre), std::move(state.axes));
  design.basis = std::make_shared<Basis>(
      state.whole_prior ? problem.prior().germs() : std::vector<Germ>(n, Germ::Uniform()),
      state.truncation);
  design.points = std::move(state.points);
  design.check_points = std::move(state.check_points);
  design.check_costs = std::move(state.check_costs);
  design.checks_are_draws = state.checks_are_draws;
  design.reference = std::move(state.reference);
  design.lower = std::move(state.lower);
  design.upper = std::move(state.upper);
  design.whole_prior = state.whole_prior;
  design.in_tails = state.in_tails;
  design.element = Element(std::move(state.element));
  return design;
}

ExpansionState RegionalExpansion::State() const {
  ExpansionState state;
  state.design = StateOf(design_);
  state.noise = noise_;
  state.absorbed = absorbed_;
  state.trajectories = trajectories_.State();
  return state;
}

absl::StatusOr<std::unique_ptr<RegionalExpansion>> RegionalExpansion::FromState(
    const ResolvedProblem& problem, ExpansionState state, const SampleStore& store, int threads,
    const Stop& stop) {
  if (!IsNoiseOf(problem, state.noise)) return InconsistentState("noise");
  POLYEST_ASSIGN_OR_RETURN(ExpansionDesign design, DesignOf(problem, std::move(state.design)));
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> expansion =
      Make(problem, &store, std::move(design), std::move(state.noise), threads, stop);
  if (IsInfeasible(expansion.status())) return InconsistentState("collocation points");
  POLYEST_RETURN_IF_ERROR(expansion.status());
  FittedTrajectories& trajectories = (*expansion)->trajectories_;
  const int64_t rows = state.absorbed.rows;
  trajectories.BeginAt(rows);
  if (state.trajectories.ensemble) {
    POLYEST_RETURN_IF_ERROR(trajectories.RestoreRun(state.trajectories, rows, store));
  }
  POLYEST_RETURN_IF_ERROR((*expansion)->RestoreSums(std::move(state.absorbed)));
  POLYEST_RETURN_IF_ERROR(trajectories.RestoreFit(std::move(state.trajectories), stop));
  return expansion;
}

absl::Status RegionalExpansion::RestoreSums(AbsorbedRows state) {
  const bool has_windows = problem_.ended_runs() == nullptr;
  if (!HasSizesOf(state, absorbed_, has_windows)) return InconsistentState("sums");
  for (size_t c = 0; c < absorbed_.sums.size(); ++c) {
    // The flags of the channel's noise are kept, since they do not come from the rows.
    ChannelSums sums = absorbed_.sums[c];
    sums.samples = std::move(state.sums[c].samples);
    sums.differences = std::move(state.sums[c].differences);
    sums.log_variance = std::move(state.sums[c].log_variance);
    sums.log_variance_at_reference = state.sums[c].log_variance_at_reference;
    sums.surplus = state.sums[c].surplus;
    state.sums[c] = std::move(sums);
  }
  absorbed_ = std::move(state);
  return absl::OkStatus();
}

}  // namespace polyest::internal
