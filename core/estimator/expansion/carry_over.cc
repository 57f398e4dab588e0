#include "core/estimator/expansion/carry_over.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/estimator/expansion/carried_state.h"
#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/record/run_inputs.h"
#include "core/estimator/record/whitening.h"
#include "core/propagation/ensemble_points.h"
#include "core/propagation/ensemble_propagator.h"

namespace polyest::internal {
namespace {

// Rows since the state kept, or half of those between two checkpoints if these are fewer, that it
// takes to judge the states.
constexpr int64_t kLeastRows = 256;
constexpr int64_t kRowsOfPairs = 256;
// Factor by which the record may become longer before the error of the states exceeds the limit.
constexpr double kRoomToGrow = 16;

absl::Status Refused(const char* why) { return absl::FailedPreconditionError(why); }

int64_t RowsToJudge(const ResolvedProblem& problem) {
  const int64_t interval = problem.problem().integration.samples_between_checkpoints;
  return std::clamp<int64_t>(interval / 2, 1, kLeastRows);
}

// Returns the largest coordinate of the points (local coordinates of `to`) in units of the trusted
// box of `from`; at least 1.
double ReachOf(const ExpansionDesign& from, const ExpansionDesign& to) {
  const Matrix units = TrustedRegion(from).ManyToLocal(to.region.ManyToGerm(to.points));
  return std::max(1.0, units.cwiseAbs().maxCoeff());
}

absl::Status Refusal(const ResolvedProblem& problem, const RegionalExpansion& present,
                     const ExpansionState& kept, const ExpansionDesign& design) {
  const Truncation& before = present.design().basis->truncation();
  const Truncation& after = design.basis->truncation();
  if (before.exponent != 1 || after.exponent != 1 || after.order < before.order) {
    return Refused("the terms are not those of the expansion before");
  }
  if (problem.ended_runs() != nullptr || problem.uses_filters()) {
    return Refused("sums of ended runs and filters are not carried over");
  }
  const auto valid = [](const std::vector<bool>& flags) {
    return std::ranges::count(flags, false) == 0;
  };
  if (std::ssize(kept.kept) != present.points() || !present.failures().empty() ||
      !valid(kept.absorbed.check_valid) || !valid(kept.absorbed.control_valid)) {
    return Refused("trajectories have failed");
  }
  const auto learned = [](const CorrelationProfile& profile) { return !profile.empty(); };
  if (std::ranges::any_of(kept.absorbed.profiles, learned)) {
    return Refused("the correlation of noise is being learned");
  }
  if ((kept.ensemble && !AreSmooth(*kept.ensemble)) ||
      (kept.controls && !AreSmooth(*kept.controls))) {
    return Refused("the states are not smooth");
  }
  return absl::OkStatus();
}

// Trajectories of the old check points from the state kept on, each from its own state there and
// from the one that the polynomials give, the first ones above the others.
class PairsOfTrajectories {
 public:
  PairsOfTrajectories(const ResolvedProblem& problem, const RegionalExpansion& present,
                      const ExpansionState& kept, const SampleStore& store, int threads)
      : problem_(problem),
        store_(store),
        kept_(kept),
        design_(present.design()),
        noise_(present.noise()),
        threads_(threads) {}

  // Returns the largest mean square, over the samples of the run up to the first `rows` rows, of
  // the difference of two outputs in units of the noise.
  absl::StatusOr<double> MeanSquare(int64_t rows, const Stop& stop) {
    POLYEST_RETURN_IF_ERROR(Start());
    Whitening whitening(noise_.channels, 2 * checks());
    RowBlock block;
    int64_t samples = 0;
    Vector sums = Vector::Zero(checks());
    for (int64_t first = kept_.absorbed.rows; first < rows; first += kRowsOfPairs) {
      POLYEST_RETURN_IF_ERROR(store_.Read(first, std::min(kRowsOfPairs, rows - first), block));
      const int count = RowsOfRun(block);
      if (count == 0) break;
      POLYEST_ASSIGN_OR_RETURN(Matrix outputs, Advance(block, count, stop));
      propagated_ += 2 * checks() * count;
      whitening.Apply(0, count, block, outputs);
      for (int column = 0; column < outputs.cols(); ++column) {
        const double sigma = block.noise[static_cast<size_t>(column)];
        if (sigma <= 0) continue;
        const auto y = outputs.col(column);
        sums += ((y.head(checks()) - y.tail(checks())) / sigma).cwiseAbs2();
        ++samples;
      }
    }
    return samples == 0 ? 0 : sums.maxCoeff() / static_cast<double>(samples);
  }
  int64_t propagated() const { return propagated_; }  // trajectories × rows

 private:
  Eigen::Index checks() const { return design_.check_points.rows(); }

  int RowsOfRun(const RowBlock& block) const {
    int count = 0;
    while (count < block.count() && block.rows[static_cast<size_t>(count)].run == kept_.run) {
      ++count;
    }
    return count;
  }

  absl::Status Start() {
    POLYEST_ASSIGN_OR_RETURN(const Matrix states, States());
    const Matrix xis = design_.region.ManyToGerm(design_.check_points);
    Matrix thetas(2 * checks(), xis.cols());
    for (Eigen::Index i = 0; i < checks(); ++i) {
      thetas.row(i) = problem_.prior().ToParameters(xis.row(i).transpose()).transpose();
      thetas.row(checks() + i) = thetas.row(i);
    }
    EnsembleSpecification specification =
        problem_.MakeEnsemble(thetas, problem_.outputs(), threads_, kept_.run);
    const int64_t rows = kept_.absorbed.rows;
    POLYEST_ASSIGN_OR_RETURN(
        const int64_t first,
        RowOfFirstKnots(problem_, store_, rows - kept_.ensemble->samples, rows,
                        kept_.ensemble->time_s - LargestInputDelay(specification)));
    inputs_.emplace(problem_, &store_, kept_.run, first);
    propagator_.emplace(std::move(specification), &inputs_->signals());
    POLYEST_RETURN_IF_ERROR(inputs_->ReadUpTo(kept_.ensemble->time_s));
    return propagator_->Restore(WithStates(*kept_.ensemble, states))
               ? absl::OkStatus()
               : Refused("the states cannot be gone on from");
  }

  absl::StatusOr<Matrix> States() const {
    POLYEST_ASSIGN_OR_RETURN(CollocationMatrix fit,
                             CollocationMatrix::Factor(*design_.basis, design_.points));
    const Matrix all = StatesOf(*kept_.ensemble);
    Matrix coefficients(fit.terms(), all.cols()), phi;
    Vector residual(all.cols());
    fit.Solve(all.topRows(design_.points.rows()), coefficients, residual);
    design_.basis->EvaluateMany(design_.check_points, phi);
    Matrix states(2 * checks(), all.cols());
    states << all.bottomRows(checks()), phi * coefficients;
    return states;
  }

  absl::StatusOr<Matrix> Advance(const RowBlock& block, int count, const Stop& stop) {
    std::vector<double> times_s;
    for (int k = 0; k < count; ++k) times_s.push_back(block.rows[static_cast<size_t>(k)].time_s);
    POLYEST_RETURN_IF_ERROR(inputs_->ReadUpTo(times_s.back()));
    Matrix outputs(2 * checks(), count * problem_.channels());
    POLYEST_RETURN_IF_ERROR(propagator_->Advance(times_s, outputs, stop));
    if (!outputs.allFinite()) return Refused("trajectories have failed");
    return outputs;
  }

  const ResolvedProblem& problem_;
  const SampleStore& store_;
  const ExpansionState& kept_;
  const ExpansionDesign& design_;
  const LearnedNoise& noise_;
  int threads_;
  int64_t propagated_ = 0;
  std::optional<RunInputs> inputs_;
  std::optional<EnsemblePropagator> propagator_;
};

// Returns by how much the square of an error of degree p + 1 grows where the new region reaches
// beyond the old one.
double GrowthIn(const ExpansionDesign& design, const ExpansionDesign& before) {
  return std::pow(ReachOf(before, design), 2 * (before.basis->order() + 1));
}

// Returns Σ ρ/R of the sums in the new region: what the fit leaves at the collocation points, or
// the old check points in the new region show.
double ErrorIn(const ExpansionDesign& design, const ExpansionDesign& before,
               const AbsorbedRows& absorbed) {
  const Matrix checks = design.region.ManyToLocal(before.region.ManyToGerm(before.check_points));
  double error = absorbed.own_error;
  for (Eigen::Index i = 0; i < checks.rows(); ++i) {
    const bool inside = checks.row(i).cwiseAbs().maxCoeff() <= 1;
    if (inside) error = std::max(error, absorbed.check_residual[i]);
  }
  return error * GrowthIn(design, before);
}

// The errors of what is taken over.
struct Inherited {
  double error = 0;        // Σ ρ/R of the sums
  double rate = 0;         // what each further sample of the run adds to it
  int64_t propagated = 0;  // trajectories × rows that it took to find out
};

// Judges whether the sums and the states can be carried over.
absl::StatusOr<Inherited> Judge(const ResolvedProblem& problem, const RegionalExpansion& present,
                                const ExpansionState& kept, const ExpansionDesign& design,
                                const SampleStore& store, int64_t rows, int threads,
                                const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(Refusal(problem, present, kept, design));
  Inherited inherited{.error = ErrorIn(design, present.design(), kept.absorbed)};
  const double most = kMaxCarriedShift * kMaxCarriedShift * present.noise().misfit;
  if (!(inherited.error <= most)) return Refused("the sums are not accurate enough");
  if (!kept.ensemble) return inherited;
  if (rows - kept.absorbed.rows < RowsToJudge(problem)) {
    return Refused("too few rows tell how accurate the states are");
  }
  PairsOfTrajectories pairs(problem, present, kept, store, threads);
  POLYEST_ASSIGN_OR_RETURN(const double mean_square, pairs.MeanSquare(rows, stop));
  inherited.propagated = pairs.propagated();
  inherited.rate = kept.absorbed.carried_rate + mean_square * GrowthIn(design, present.design());
  const double to_come = kRoomToGrow * static_cast<double>(present.absorbed().samples);
  if (!(inherited.error + inherited.rate * to_come <= most)) {
    return Refused("the states are not accurate enough");
  }
  return inherited;
}

}  // namespace

absl::StatusOr<std::unique_ptr<RegionalExpansion>> CarryOver(const ResolvedProblem& problem,
                                                             const RegionalExpansion& present,
                                                             const ExpansionDesign& design,
                                                             const SampleStore& store, int64_t rows,
                                                             int threads, const Stop& stop) {
  const std::shared_ptr<const ExpansionState> kept = present.kept_state();
  if (!kept || rows != present.absorbed_rows()) return Refused("there is no state to go on from");
  POLYEST_ASSIGN_OR_RETURN(const Inherited inherited,
                           Judge(problem, present, *kept, design, store, rows, threads, stop));
  POLYEST_ASSIGN_OR_RETURN(ExpansionState state,
                           CarriedState(problem, present, *kept, design, inherited.error));
  state.absorbed.propagated = inherited.propagated;
  state.absorbed.carried_rate = inherited.rate;
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> moved =
      RegionalExpansion::FromState(problem, std::move(state), store, threads);
  if (absl::IsDataLoss(moved.status())) return Refused("the state cannot be carried over");
  POLYEST_RETURN_IF_ERROR(moved.status());
  POLYEST_RETURN_IF_ERROR(TakeRows(store, rows, stop, **moved));
  return moved;
}

absl::StatusOr<std::unique_ptr<RegionalExpansion>> Restored(const RegionalExpansion& present,
                                                            const ResolvedProblem& problem,
                                                            const SampleStore& store, int64_t rows,
                                                            int threads, const Stop& stop) {
  if (!present.kept_state()) {
    return Replay(problem, present.design(), present.noise(), store, rows, threads, stop);
  }
  ExpansionState state = *present.kept_state();
  state.noise = present.noise();
  POLYEST_ASSIGN_OR_RETURN(auto restored,
                           RegionalExpansion::FromState(problem, std::move(state), store, threads));
  POLYEST_RETURN_IF_ERROR(TakeRows(store, rows, stop, *restored));
  return restored;
}

}  // namespace polyest::internal
