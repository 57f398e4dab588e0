#include "polyest/estimator.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/component_mixture.h"
#include "core/estimator/estimator_access.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/memory_use.h"
#include "core/estimator/problem_fingerprint.h"
#include "core/estimator/record/checkpoints.h"
#include "core/estimator/record/known_inputs_store.h"
#include "core/estimator/record/sample_checks.h"
#include "core/estimator/second_search.h"
#include "core/estimator/snapshot.h"
#include "core/estimator/studies/cost_profile.h"
#include "core/estimator/studies/log_density.h"
#include "core/estimator/studies/posterior_study.h"
#include "core/estimator/studies/prediction.h"
#include "core/estimator/studies/regularization_sweep.h"
#include "core/estimator/studies/score_diagnosis.h"

namespace polyest {

using namespace internal;

namespace {

constexpr int64_t kNever = std::numeric_limits<int64_t>::max();

}  // namespace

// Owns the record and the mixture of components that represents the posterior.
class Estimator::Implementation {
 public:
  Implementation(ResolvedProblem problem, EstimatorOptions options)
      : problem_(std::move(problem)),
        threads_(options.threads),
        store_(StoreFor(problem_, std::move(options.store))),
        checks_(problem_),
        snapshot_(std::move(options.snapshot)),
        checkpoints_(problem_.problem().integration.samples_between_checkpoints,
                     problem_.has_checkpoints_in_runs()) {}

  absl::Status Begin(const Stop& stop) {
    POLYEST_ASSIGN_OR_RETURN(mixture_,
                             ComponentMixture::OfPrior(problem_, store_.get(), threads_, {}, stop));
    return absl::OkStatus();
  }

  const ResolvedProblem& problem() const { return problem_; }
  int64_t rows_appended() const { return store_->rows(); }
  int64_t rows_processed() const { return mixture_->rows_taken(); }
  int64_t memory_bytes() const { return BytesOf(*mixture_) + search_.memory_bytes(); }

  absl::Status Append(const Samples& samples);
  absl::Status Process(const Stop& stop);
  absl::Status Restore(const EstimatorSnapshot& snapshot, const Stop& stop);
  absl::StatusOr<Estimate> CurrentEstimate(const Stop& stop) const;
  absl::StatusOr<Estimate> TestedEstimate(const Stop& stop) const;
  absl::StatusOr<Posterior> CurrentPosterior(const PosteriorOptions& options,
                                             const Stop& stop) const;
  absl::StatusOr<CostProfiles> CurrentProfiles(const ProfileOptions& options,
                                               const Stop& stop) const;
  absl::StatusOr<LogDensity> CurrentLogDensity(const LogDensityOptions& options,
                                               const Stop& stop) const;
  absl::StatusOr<RegularizationSweep> CurrentRegularizationSweep(
      const RegularizationOptions& options, const Stop& stop) const;
  absl::StatusOr<Prediction> CurrentPrediction(const PredictionOptions& options,
                                               const Stop& stop) const;

 private:
  absl::StatusOr<int64_t> SettledRows() const;
  const ResolvedProblem& estimated_problem() const;
  absl::StatusOr<Prediction> PredictOther(PredictionSubject subject,
                                          const PredictionOptions& options, const Stop& stop) const;
  absl::StatusOr<DensityBasis> MakeDensityBasis(const Stop& stop) const;
  void MakeSnapshot(int64_t rows);

  ResolvedProblem problem_;
  int threads_;
  std::shared_ptr<SampleStore> store_;
  SampleChecks checks_;
  std::function<void(EstimatorSnapshot)> snapshot_;
  Checkpoints checkpoints_;
  std::unique_ptr<ComponentMixture> mixture_;
  SecondSearch search_;
  // What densities of the processed rows are computed from, once they have been asked for: a
  // function of the rows, kept because such calls come by the thousand.
  mutable std::optional<DensityBasis> density_;
};

absl::Status Estimator::Implementation::Append(const Samples& samples) {
  POLYEST_ASSIGN_OR_RETURN(const CheckedSamples checked, checks_.Check(samples));
  std::optional<ResolvedProblem> grown;
  if (problem_.per_run() && checked.after.run >= problem_.runs()) {
    POLYEST_ASSIGN_OR_RETURN(grown, problem_.AtRun(checked.after.run));
  }
  POLYEST_RETURN_IF_ERROR(store_->Append(checked));
  if (grown) problem_ = *std::move(grown);
  checks_.Accept(checked);
  if (snapshot_) checkpoints_.Add(checked.rows);
  return absl::OkStatus();
}

// Returns the number of rows up to which the streamed inputs are settled, whatever rows may follow.
absl::StatusOr<int64_t> Estimator::Implementation::SettledRows() const {
  const RecordPosition& last = checks_.position();
  if (last.run_ended) return last.rows;
  return polyest::internal::SettledRows(problem_, last.knots, last.rows - last.rows_in_run,
                                        last.rows, *store_);
}

// Returns the problem of estimates: that of the components with the fewest parameters. A run of
// which no row has been processed yet has no parameters in it, nor has one in which a stop kept
// some components from beginning.
const ResolvedProblem& Estimator::Implementation::estimated_problem() const {
  size_t least = 0;
  for (size_t i = 1; i < mixture_->size(); ++i) {
    const auto dimension = [&](size_t k) { return mixture_->component(k).problem().dimension(); };
    if (dimension(i) < dimension(least)) least = i;
  }
  return mixture_->component(least).problem();
}

absl::Status Estimator::Implementation::Process(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const int64_t settled, SettledRows());
  if (settled != rows_processed()) density_.reset();
  while (true) {
    const int64_t checkpoint = checkpoints_.next().value_or(kNever);
    const int64_t rows = std::min({settled, checkpoint, search_.row()});
    POLYEST_RETURN_IF_ERROR(mixture_->TakeUpTo(rows, stop));
    if (rows == search_.row()) {
      density_.reset();
      POLYEST_RETURN_IF_ERROR(search_.Look(problem_, store_.get(), threads_, stop, mixture_));
    } else if (rows == checkpoint) {
      MakeSnapshot(rows);
    } else {
      return absl::OkStatus();
    }
  }
}

void Estimator::Implementation::MakeSnapshot(int64_t rows) {
  const EstimatorState state{mixture_->State(), search_.state()};
  snapshot_({rows, EncodeState(state, rows, FingerprintOf(problem_.problem()))});
  checkpoints_.Pass(rows);
}

absl::Status Estimator::Implementation::Restore(const EstimatorSnapshot& snapshot,
                                                const Stop& stop) {
  if (rows_processed() > 0) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "%d rows have been processed; a snapshot is restored before any", rows_processed()));
  }
  if (snapshot.rows > rows_appended()) {
    return absl::FailedPreconditionError(
        absl::StrFormat("the snapshot is of %d rows and only %d have been appended", snapshot.rows,
                        rows_appended()));
  }
  POLYEST_ASSIGN_OR_RETURN(EstimatorState state, DecodeState(snapshot.state, snapshot.rows,
                                                             FingerprintOf(problem_.problem())));
  POLYEST_RETURN_IF_ERROR(SecondSearch::CheckState(state.search, snapshot.rows));
  POLYEST_ASSIGN_OR_RETURN(
      mixture_, ComponentMixture::FromState(problem_, std::move(state.mixture), snapshot.rows,
                                            store_.get(), threads_, stop));
  search_.Restore(state.search);
  density_.reset();
  checkpoints_.Pass(snapshot.rows);
  return absl::OkStatus();
}

absl::StatusOr<Estimate> Estimator::Implementation::CurrentEstimate(const Stop& stop) const {
  POLYEST_ASSIGN_OR_RETURN(AssessedMixture assessed, mixture_->Assess(stop));
  return std::move(assessed.whole.estimate);
}

absl::StatusOr<Estimate> Estimator::Implementation::TestedEstimate(const Stop& stop) const {
  POLYEST_ASSIGN_OR_RETURN(AssessedMixture assessed, mixture_->Assess(stop));
  Estimate& estimate = assessed.whole.estimate;
  if (!IsWorthTesting(estimate)) return std::move(estimate);
  const LearnedNoise& noise = mixture_->component(assessed.order.front()).expansion().noise();
  POLYEST_ASSIGN_OR_RETURN(const FixedValueTests tests,
                           TestFixedQuantities(estimated_problem(), *store_, rows_processed(),
                                               noise.channels, estimate, stop));
  AddScoreTests(tests, estimate);
  return std::move(estimate);
}

absl::StatusOr<Posterior> Estimator::Implementation::CurrentPosterior(
    const PosteriorOptions& options, const Stop& stop) const {
  const Prior& prior = estimated_problem().prior();
  POLYEST_RETURN_IF_ERROR(Validate(options, prior));
  POLYEST_ASSIGN_OR_RETURN(const AssessedMixture assessed,
                           mixture_->Assess(EffortOf(options), stop));
  return DescribePosterior(assessed.whole, prior, options);
}

absl::StatusOr<CostProfiles> Estimator::Implementation::CurrentProfiles(
    const ProfileOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(Validate(options, estimated_problem().prior()));
  POLYEST_ASSIGN_OR_RETURN(const AssessedMixture assessed, mixture_->Assess(stop));
  const auto profile = [&](const Assessed& one, size_t component) {
    const RegionalExpansion& expansion = mixture_->component(component).expansion();
    return ProfileCost(one, expansion.MakeCost(one.estimate.regularization), expansion.design(),
                       options, stop);
  };
  if (assessed.components.empty()) return profile(assessed.whole, assessed.order.front());
  std::vector<CostProfiles> profiles;
  std::vector<double> heights;
  for (size_t k = 0; k < assessed.components.size(); ++k) {
    POLYEST_ASSIGN_OR_RETURN(CostProfiles one, profile(assessed.components[k], assessed.order[k]));
    profiles.push_back(std::move(one));
    heights.push_back(assessed.components[k].share.height);
  }
  CostProfiles lowest = LowestOf(profiles, heights);
  lowest.diagnostics = assessed.whole.estimate.diagnostics;
  return lowest;
}

absl::StatusOr<DensityBasis> Estimator::Implementation::MakeDensityBasis(const Stop& stop) const {
  POLYEST_ASSIGN_OR_RETURN(const AssessedMixture assessed, mixture_->Assess(stop));
  DensityBasis basis;
  for (size_t k = 0; k < assessed.order.size(); ++k) {
    const Assessed& one = assessed.components.empty() ? assessed.whole : assessed.components[k];
    const RegionalExpansion& expansion = mixture_->component(assessed.order[k]).expansion();
    Cost cost = expansion.MakeCost(one.estimate.regularization);
    const MinimizationProblem search = SearchOf(cost, expansion.design());
    basis.components.push_back({std::move(cost), search.lower, search.upper, one.share.height});
  }
  for (const ParameterEstimate& parameter : assessed.whole.estimate.parameters) {
    basis.units.push_back(parameter.unit);
  }
  basis.diagnostics = assessed.whole.estimate.diagnostics;
  return basis;
}

absl::StatusOr<LogDensity> Estimator::Implementation::CurrentLogDensity(
    const LogDensityOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(Validate(options, estimated_problem().prior().Names()));
  if (!density_) {
    POLYEST_ASSIGN_OR_RETURN(density_, MakeDensityBasis(stop));
  }
  return EvaluateLogDensity(*density_, options);
}

absl::StatusOr<RegularizationSweep> Estimator::Implementation::CurrentRegularizationSweep(
    const RegularizationOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_RETURN_IF_ERROR(RefuseFilters(problem_.problem(), "a regularization sweep"));
  POLYEST_ASSIGN_OR_RETURN(const AssessedMixture assessed, mixture_->Assess(stop));
  const RegionalExpansion& expansion = mixture_->component(assessed.order.front()).expansion();
  return SweepRegularization(estimated_problem(), expansion, assessed.whole, options, stop);
}

absl::StatusOr<Prediction> Estimator::Implementation::CurrentPrediction(
    const PredictionOptions& options, const Stop& stop) const {
  const ResolvedProblem& own = estimated_problem();
  POLYEST_RETURN_IF_ERROR(Validate(options, own, rows_processed()));
  // More draws than trajectories, of which there may be 10,000.
  POLYEST_ASSIGN_OR_RETURN(const AssessedMixture assessed,
                           mixture_->Assess(PosteriorEffort(), stop));
  const AssessmentRequest heaviest =
      mixture_->component(assessed.order.front()).RequestAssessment();
  PredictionSubject subject;
  subject.problem = &own;
  subject.store = store_.get();
  subject.rows = rows_processed();
  subject.thetas = EquallyWeightedThetas(assessed.whole.posterior, own.prior(), options.draws);
  subject.noise = NoiseOf(assessed.whole, *heaviest.record, heaviest.expansion->noise(), own);
  absl::StatusOr<Prediction> prediction = options.record
                                              ? PredictOther(std::move(subject), options, stop)
                                              : Predict(subject, options, threads_, stop);
  POLYEST_RETURN_IF_ERROR(prediction.status());
  prediction->diagnostics = assessed.whole.estimate.diagnostics;
  return prediction;
}

// Predicts another record with the subject's values.
absl::StatusOr<Prediction> Estimator::Implementation::PredictOther(PredictionSubject subject,
                                                                   const PredictionOptions& options,
                                                                   const Stop& stop) const {
  const std::vector<int>& runs = options.record->run;
  const int last_run = runs.empty() ? 0 : *std::max_element(runs.begin(), runs.end());
  const int most = problem_.max_joint_runs();
  if (last_run >= most && problem_.population()) {
    return InvalidField(
        "record.run",
        absl::StrFormat("%d must be 0: the runs of a population are predicted one at a time, since "
                        "their parameters are never known together",
                        last_run));
  }
  if (last_run >= most) {
    return InvalidField(
        "record.run",
        absl::StrFormat("%d must be below %d: each run has parameters of its own, and more runs "
                        "would have too many of them",
                        last_run, most));
  }
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem other,
                           problem_.WithRuns(problem_.per_run() ? std::max(0, last_run) + 1 : 1));
  const absl::StatusOr<CheckedSamples> checked = SampleChecks(other).Check(*options.record);
  if (!checked.ok()) return OfRecord(checked.status());
  const std::shared_ptr<SampleStore> store = StoreFor(other, nullptr);
  POLYEST_RETURN_IF_ERROR(store->Append(*checked));
  POLYEST_RETURN_IF_ERROR(Validate(options, other, store->rows()));
  subject.thetas = ThetasOfOtherRuns(*subject.problem, subject.thetas, other, options.same_runs);
  subject.problem = &other;
  subject.store = store.get();
  subject.rows = store->rows();
  return Predict(subject, options, threads_, stop);
}

Estimator::Estimator(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
Estimator::~Estimator() = default;

absl::StatusOr<std::unique_ptr<Estimator>> Estimator::Make(Problem problem,
                                                           EstimatorOptions options,
                                                           const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem resolved, ResolvedProblem::Make(std::move(problem)));
  return EstimatorAccess::Make(std::move(resolved), std::move(options), stop);
}

const Problem& Estimator::problem() const { return implementation_->problem().problem(); }
absl::Status Estimator::Append(const Samples& samples) { return implementation_->Append(samples); }
absl::Status Estimator::Process(const Stop& stop) { return implementation_->Process(stop); }
absl::StatusOr<Estimate> Estimator::CurrentEstimate(const Stop& stop) const {
  return implementation_->CurrentEstimate(stop);
}
absl::StatusOr<Estimate> Estimator::TestedEstimate(const Stop& stop) const {
  return implementation_->TestedEstimate(stop);
}
absl::StatusOr<Posterior> Estimator::CurrentPosterior(const PosteriorOptions& options,
                                                      const Stop& stop) const {
  return implementation_->CurrentPosterior(options, stop);
}
absl::StatusOr<CostProfiles> Estimator::CurrentProfiles(const ProfileOptions& options,
                                                        const Stop& stop) const {
  return implementation_->CurrentProfiles(options, stop);
}
absl::StatusOr<LogDensity> Estimator::CurrentLogDensity(const LogDensityOptions& options,
                                                        const Stop& stop) const {
  return implementation_->CurrentLogDensity(options, stop);
}
absl::StatusOr<RegularizationSweep> Estimator::CurrentRegularizationSweep(
    const RegularizationOptions& options, const Stop& stop) const {
  return implementation_->CurrentRegularizationSweep(options, stop);
}
absl::StatusOr<Prediction> Estimator::CurrentPrediction(const PredictionOptions& options,
                                                        const Stop& stop) const {
  return implementation_->CurrentPrediction(options, stop);
}
absl::Status Estimator::Restore(const EstimatorSnapshot& snapshot, const Stop& stop) {
  return implementation_->Restore(snapshot, stop);
}
int64_t Estimator::rows_appended() const { return implementation_->rows_appended(); }
int64_t Estimator::rows_processed() const { return implementation_->rows_processed(); }

}  // namespace polyest

namespace polyest::internal {

absl::StatusOr<std::unique_ptr<Estimator>> EstimatorAccess::Make(ResolvedProblem problem,
                                                                 EstimatorOptions options,
                                                                 const Stop& stop) {
  if (problem.channels() == 0) {
    return InvalidField("measured", "at least one output must be measured");
  }
  POLYEST_RETURN_IF_ERROR(CheckAtLeast("threads", options.threads, 1));
  if (options.store && options.store->rows() > 0) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "the sample store holds %d rows already; an estimator begins with an empty one",
        options.store->rows()));
  }
  auto implementation =
      std::make_unique<Estimator::Implementation>(std::move(problem), std::move(options));
  POLYEST_RETURN_IF_ERROR(implementation->Begin(stop));
  return std::unique_ptr<Estimator>(new Estimator(std::move(implementation)));
}

const ResolvedProblem& EstimatorAccess::ProblemOf(const Estimator& estimator) {
  return estimator.implementation_->problem();
}

int64_t EstimatorAccess::MemoryBytes(const Estimator& estimator) {
  return estimator.implementation_->memory_bytes();
}

}  // namespace polyest::internal
