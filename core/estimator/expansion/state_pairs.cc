#include "core/estimator/expansion/state_pairs.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/carried_state.h"
#include "core/estimator/record/run_inputs.h"
#include "core/estimator/record/whitening.h"
#include "core/propagation/ensemble_propagator.h"
#include "core/propagation/filter_bank.h"

namespace polyest::internal {
namespace {

constexpr int64_t kRowsToRead = 256;

// The pairs: the first half of the trajectories or filters begins in their own states, the second
// half in those of the polynomials.
class StatePairs {
 public:
  StatePairs(const ResolvedProblem& problem, const RegionalExpansion& present,
             const ExpansionState& kept, const SampleStore& store, int threads)
      : problem_(problem),
        store_(store),
        kept_(kept.trajectories),
        kept_rows_(kept.absorbed.rows),
        design_(present.design()),
        noise_(present.noise()),
        threads_(threads) {}

  absl::StatusOr<PairComparison> Compare(int64_t rows, const Stop& stop) {
    POLYEST_RETURN_IF_ERROR(Start(stop));
    Whitening whitening(noise_.channels, 2 * checks());
    RowBlock block;
    PairComparison comparison;
    int64_t samples = 0;
    Vector sums = Vector::Zero(checks());
    for (int64_t first = kept_rows_; first < rows; first += kRowsToRead) {
      POLYEST_RETURN_IF_ERROR(store_.Read(first, std::min(kRowsToRead, rows - first), block));
      const int count = RowsOfRun(block);
      if (count == 0) break;
      Matrix outputs(2 * checks(), count * problem_.channels());
      Matrix log_variances = Matrix::Zero(outputs.rows(), outputs.cols());
      POLYEST_RETURN_IF_ERROR(Advance(block, count, outputs, log_variances, stop));
      comparison.propagated += 2 * checks() * count;
      if (!filters_) whitening.Apply(0, count, block, outputs);
      for (int column = 0; column < outputs.cols(); ++column) {
        const double sigma = block.noise[static_cast<size_t>(column)];
        if (sigma <= 0) continue;
        sums += SquaredDifferences(outputs.col(column)) / (filters_ ? 1 : sigma * sigma) +
                SquaredDifferences(log_variances.col(column)) / 2;
        ++samples;
      }
    }
    if (samples > 0) comparison.mean_square = sums.maxCoeff() / static_cast<double>(samples);
    return comparison;
  }

 private:
  Eigen::Index checks() const { return design_.check_points.rows(); }

  Vector SquaredDifferences(const ConstVectorRef& values) const {
    return (values.head(checks()) - values.tail(checks())).cwiseAbs2();
  }

  int RowsOfRun(const RowBlock& block) const {
    int count = 0;
    while (count < block.count() && block.rows[static_cast<size_t>(count)].run == kept_.run) {
      ++count;
    }
    return count;
  }

  absl::Status Start(const Stop& stop) {
    POLYEST_ASSIGN_OR_RETURN(const Matrix states, States(stop));
    const Matrix xis = design_.region.ManyToGerm(design_.check_points);
    Matrix thetas(2 * checks(), xis.cols());
    for (Eigen::Index i = 0; i < checks(); ++i) {
      thetas.row(i) = problem_.prior().ToParameters(xis.row(i).transpose()).transpose();
      thetas.row(checks() + i) = thetas.row(i);
    }
    EnsembleSpecification specification =
        problem_.MakeEnsemble(thetas, problem_.outputs(), threads_, kept_.run);
    POLYEST_ASSIGN_OR_RETURN(
        const int64_t first,
        RowOfFirstKnots(problem_, store_, kept_rows_ - kept_.ensemble->samples, kept_rows_,
                        kept_.ensemble->time_s - LargestInputDelay(specification)));
    inputs_.emplace(problem_, &store_, kept_.run, first);
    POLYEST_RETURN_IF_ERROR(inputs_->ReadUpTo(kept_.ensemble->time_s));
    const EnsembleState state = WithInterpolated(problem_, *kept_.ensemble, states);
    return Restore(std::move(specification), state)
               ? absl::OkStatus()
               : InfeasibleError("the states cannot be gone on from");
  }

  bool Restore(EnsembleSpecification specification, const EnsembleState& state) {
    if (problem_.uses_filters()) {
      return filters_.emplace(std::move(specification), &inputs_->signals()).Restore(state);
    }
    return propagator_.emplace(std::move(specification), &inputs_->signals()).Restore(state);
  }

  absl::StatusOr<Matrix> States(const Stop& stop) const {
    POLYEST_ASSIGN_OR_RETURN(CollocationMatrix fit,
                             CollocationMatrix::Factor(*design_.basis, design_.points, stop));
    const Matrix all = InterpolableStates(problem_, *kept_.ensemble);
    Matrix coefficients(fit.terms(), all.cols()), phi;
    Vector residual(all.cols());
    fit.Solve(all.topRows(design_.points.rows()), coefficients, residual);
    design_.basis->EvaluateMany(design_.check_points, phi);
    Matrix states(2 * checks(), all.cols());
    states << all.bottomRows(checks()), phi * coefficients;
    return states;
  }

  // Writes the outputs, or the innovations and the log variances.
  absl::Status Advance(const RowBlock& block, int count, Matrix& outputs, Matrix& log_variances,
                       const Stop& stop) {
    const Eigen::Index rows = count, channels = problem_.channels();
    std::vector<double> times_s;
    for (int k = 0; k < count; ++k) times_s.push_back(block.rows[static_cast<size_t>(k)].time_s);
    POLYEST_RETURN_IF_ERROR(inputs_->ReadUpTo(times_s.back()));
    if (filters_) {
      const Eigen::Index width = std::ssize(block.values) / block.count();
      const Eigen::Map<const Matrix> values(block.values.data(), width, block.count());
      const Eigen::Map<const Matrix> noise(block.noise.data(), channels, block.count());
      const FilterSamples samples{times_s, values.topLeftCorner(channels, rows),
                                  noise.leftCols(rows)};
      POLYEST_RETURN_IF_ERROR(filters_->Advance(samples, outputs, log_variances, stop));
    } else {
      POLYEST_RETURN_IF_ERROR(propagator_->Advance(times_s, outputs, stop));
    }
    return outputs.allFinite() && log_variances.allFinite()
               ? absl::OkStatus()
               : InfeasibleError("trajectories have failed");
  }

  const ResolvedProblem& problem_;
  const SampleStore& store_;
  const TrajectoryState& kept_;
  const int64_t kept_rows_;  // of the record, after which they were kept
  const ExpansionDesign& design_;
  const LearnedNoise& noise_;
  int threads_;
  std::optional<RunInputs> inputs_;
  std::optional<EnsemblePropagator> propagator_;
  std::optional<FilterBank> filters_;  // in place of the propagator
};

}  // namespace

absl::StatusOr<PairComparison> ComparePairs(const ResolvedProblem& problem,
                                            const RegionalExpansion& present,
                                            const ExpansionState& kept, const SampleStore& store,
                                            int64_t rows, int threads, const Stop& stop) {
  return StatePairs(problem, present, kept, store, threads).Compare(rows, stop);
}

}  // namespace polyest::internal
