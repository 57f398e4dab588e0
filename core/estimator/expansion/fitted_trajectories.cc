#include "core/estimator/expansion/fitted_trajectories.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "core/common/status.h"
#include "core/estimator/expansion/control_trajectories.h"
#include "core/propagation/ensemble_propagator.h"
#include "core/propagation/linear_system.h"

namespace polyest::internal {
namespace {

// A block of so few trajectories takes as long as a block of one.
constexpr Eigen::Index kMaxControls = kLanes;
// The tolerance must leave room for one of at most half its size.
constexpr double kMinControllable = 2 * kMinControlTolerance;
// A tenth of the tolerance takes at most ten times the steps, with a method of order 1.
constexpr int kMoreSteps = 10;

// Returns the parameters of the collocation points, followed by those of the check points.
Matrix ParametersOf(const ResolvedProblem& problem, const ExpansionDesign& design) {
  Matrix etas(design.points.rows() + design.check_points.rows(), design.points.cols());
  etas << design.points, design.check_points;
  Matrix thetas = design.region.ManyToGerm(etas);
  for (Eigen::Index i = 0; i < thetas.rows(); ++i) {
    thetas.row(i) = problem.prior().ToParameters(thetas.row(i).transpose()).transpose();
  }
  return thetas;
}

Matrix BasisAtCheckPoints(const ExpansionDesign& design) {
  Matrix phi;
  design.basis->EvaluateMany(design.check_points, phi);
  return phi;
}

}  // namespace

FittedTrajectories::FittedTrajectories(const ResolvedProblem& problem, const SampleStore* store,
                                       const ExpansionDesign& design,
                                       const std::vector<ChannelNoise>& noise,
                                       CollocationMatrix matrix, int threads)
    : problem_(problem),
      store_(store),
      design_(design),
      matrix_(std::move(matrix)),
      threads_(threads),
      channels_(problem.channels()),
      check_basis_(BasisAtCheckPoints(design)),
      thetas_(ParametersOf(problem, design)),
      next_row_(problem.first_row()),
      controls_(CountControls()),
      whitening_(noise, count()),
      kept_(static_cast<size_t>(points())) {
  std::iota(kept_.begin(), kept_.end(), 0);
}

bool FittedTrajectories::StepsExactly() const {
  const InputSignals inputs = problem_.MakeInputs();
  return internal::StepsExactly(problem_.MakeEnsemble(thetas_, problem_.outputs(), threads_,
                                                      std::max(run_, problem_.first_run())),
                                inputs);
}

absl::Status FittedTrajectories::Propagate(const RowBlock& rows, FittedBlock& block,
                                           const Stop& stop) {
  block.rows = rows;
  block.fitted_rows = 0;
  const int columns = channels_ * rows.count();
  block.outputs.resize(count(), columns);
  block.coefficients.resize(design_.basis->size(), columns);
  block.residual_variance.resize(columns);
  block.check_predictions.resize(checks(), columns);
  for (int first = 0; first < rows.count() && block.fitted_rows == first;) {
    const int run = rows.rows[static_cast<size_t>(first)].run;
    int count = 1;
    while (first + count < rows.count() &&
           rows.rows[static_cast<size_t>(first + count)].run == run) {
      ++count;
    }
    if (run != run_) StartRun(run, next_row_, next_row_);
    POLYEST_RETURN_IF_ERROR(PropagateRun(first, count, block, stop));
    first += count;
    next_row_ += count;
  }
  return absl::OkStatus();
}

// Each run has its own inputs, whose knots are read from the row `first_knots` on.
void FittedTrajectories::StartRun(int run, int64_t first_row, int64_t first_knots) {
  run_ = run;
  run_begin_ = first_row;
  whitening_.BeginRun();
  propagator_.reset();
  control_propagator_.reset();
  filters_.reset();
  control_filters_.reset();
  inputs_ = std::make_unique<RunInputs>(problem_, store_, run, first_knots);
  input_reach_s_ = InputReach(run);
  if (problem_.uses_filters()) return StartFilters(run);
  propagator_ = std::make_unique<EnsemblePropagator>(
      problem_.MakeEnsemble(thetas_, problem_.outputs(), threads_, run), &inputs_->signals());
  StartControls(run);
}

// Returns the time before the present one from which trajectories of the run may need the inputs,
// +∞ if they may need them from its beginning.
double FittedTrajectories::InputReach(int run) const {
  if (problem_.streamed_inputs().empty() || !problem_.has_checkpoints_in_runs()) return kInfinity;
  return LargestInputDelay(problem_.MakeEnsemble(thetas_, problem_.outputs(), threads_, run));
}

// Takes rows of the block that are of the present run.
absl::Status FittedTrajectories::PropagateRun(int first, int count, FittedBlock& block,
                                              const Stop& stop) {
  const double last_s = block.Row(first + count - 1).time_s;
  POLYEST_RETURN_IF_ERROR(inputs_->ReadUpTo(last_s));
  POLYEST_RETURN_IF_ERROR(filters_ ? AdvanceFilters(first, count, block, stop)
                                   : Advance(first, count, block, stop));
  if (input_reach_s_ < kInfinity) inputs_->Forget(last_s - input_reach_s_);
  whitening_.Apply(first, count, block.rows,
                   block.outputs.middleCols(first * channels_, count * channels_));
  POLYEST_RETURN_IF_ERROR(FitRows(first, count, block, stop));
  AddDelayErrors(first, block);
  return absl::OkStatus();
}

absl::Status FittedTrajectories::Advance(int first, int count, FittedBlock& block,
                                         const Stop& stop) {
  std::vector<double> times;
  for (int k = first; k < first + count; ++k) times.push_back(block.Row(k).time_s);
  auto outputs = block.outputs.middleCols(first * channels_, count * channels_);
  POLYEST_RETURN_IF_ERROR(propagator_->Advance(times, outputs.topRows(trajectories()), stop));
  if (controls_ == 0) return absl::OkStatus();
  return control_propagator_->Advance(times, outputs.bottomRows(controls_), stop);
}

int FittedTrajectories::CountControls() const {
  const Problem& problem = problem_.problem();
  const Model& model = *problem.model;
  if (!HasCheckpointsInRuns(model) || model.description().states.empty()) return 0;
  if (problem.integration.relative_tolerance < kMinControllable || StepsExactly()) return 0;
  return static_cast<int>(std::min<Eigen::Index>(kMaxControls, checks()));
}

// Starts the first check points once more, with a smaller tolerance.
void FittedTrajectories::StartControls(int run) {
  if (controls_ == 0) return;
  EnsembleSpecification specification = problem_.MakeEnsemble(
      thetas_.middleRows(points(), controls_), problem_.outputs(), threads_, run);
  IntegrationOptions& integration = specification.integration;
  integration.relative_tolerance =
      std::max(kMinControlTolerance, kControlTolerance * integration.relative_tolerance);
  const int most = std::numeric_limits<int>::max();
  integration.max_steps =
      integration.max_steps > most / kMoreSteps ? most : kMoreSteps * integration.max_steps;
  if (problem_.uses_filters()) {
    control_filters_ = std::make_unique<FilterBank>(std::move(specification), &inputs_->signals());
    return;
  }
  control_propagator_ =
      std::make_unique<EnsemblePropagator>(std::move(specification), &inputs_->signals());
}

}  // namespace polyest::internal
