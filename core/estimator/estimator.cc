#include "core/estimator/estimator.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "core/estimator/assessment.h"
#include "core/estimator/memory_store.h"
#include "core/estimator/mixture_component.h"
#include "core/estimator/sample_checks.h"

namespace polyest {

// Owns the record; what is made of it is the component's.
class Estimator::Implementation {
 public:
  Implementation(ResolvedProblem problem, EstimatorOptions options)
      : problem_(std::move(problem)),
        threads_(options.threads),
        store_(options.store ? std::move(options.store) : std::make_shared<MemoryStore>()),
        checks_(problem_) {}

  absl::Status Begin() {
    POLYEST_ASSIGN_OR_RETURN(component_,
                             MixtureComponent::OfPrior(problem_, store_.get(), threads_));
    return absl::OkStatus();
  }

  const ResolvedProblem& problem() const { return problem_; }
  int64_t rows_appended() const { return store_->rows(); }
  int64_t rows_processed() const { return component_->rows_taken(); }

  absl::Status Append(const Samples& samples);
  absl::Status Process(const Stop& stop) { return component_->TakeUpTo(SettledRows(), stop); }
  absl::StatusOr<Estimate> CurrentEstimate(const Stop& stop) const;
  absl::StatusOr<Posterior> CurrentPosterior(const PosteriorOptions& options,
                                             const Stop& stop) const;
  absl::StatusOr<CostProfiles> CurrentProfiles(const ProfileOptions& options,
                                               const Stop& stop) const;
  absl::StatusOr<RegularizationSweep> CurrentRegularizationSweep(
      const RegularizationOptions& options, const Stop& stop) const;

 private:
  int64_t SettledRows() const;

  ResolvedProblem problem_;
  int threads_;
  std::shared_ptr<SampleStore> store_;
  SampleChecks checks_;
  std::unique_ptr<MixtureComponent> component_;
};

absl::Status Estimator::Implementation::Append(const Samples& samples) {
  POLYEST_ASSIGN_OR_RETURN(const CheckedSamples checked, checks_.Check(samples));
  POLYEST_RETURN_IF_ERROR(store_->Append(checked));
  if (problem_.per_run() && checked.after.run >= problem_.runs()) {
    POLYEST_ASSIGN_OR_RETURN(problem_, problem_.WithRuns(checked.after.run + 1));
  }
  checks_.Accept(checked);
  return absl::OkStatus();
}

// Rows up to which the streamed inputs are settled, whatever rows may follow.
int64_t Estimator::Implementation::SettledRows() const {
  const RecordPosition& last = checks_.position();
  if (last.run_ended) return last.rows;
  return last.rows - std::min<int64_t>(problem_.knots_ahead(), last.rows_in_run);
}

absl::StatusOr<Estimate> Estimator::Implementation::CurrentEstimate(const Stop& stop) const {
  POLYEST_ASSIGN_OR_RETURN(Assessed assessed, Assess(component_->RequestAssessment(), stop));
  return std::move(assessed.estimate);
}

absl::StatusOr<Posterior> Estimator::Implementation::CurrentPosterior(
    const PosteriorOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(options.Validate(problem_.prior()));
  AssessmentRequest request = component_->RequestAssessment();
  request.effort = options.Effort();
  POLYEST_ASSIGN_OR_RETURN(const Assessed assessed, Assess(request, stop));
  return DescribePosterior(assessed, problem_.prior(), options);
}

absl::StatusOr<CostProfiles> Estimator::Implementation::CurrentProfiles(
    const ProfileOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(options.Validate(problem_.prior()));
  POLYEST_ASSIGN_OR_RETURN(const Assessed assessed, Assess(component_->RequestAssessment(), stop));
  const Cost cost = component_->expansion().MakeCost(assessed.estimate.regularization);
  return ProfileCost(assessed, cost, component_->expansion().design(), options, stop);
}

absl::StatusOr<RegularizationSweep> Estimator::Implementation::CurrentRegularizationSweep(
    const RegularizationOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_ASSIGN_OR_RETURN(const Assessed assessed, Assess(component_->RequestAssessment(), stop));
  return SweepRegularization(problem_, component_->expansion(), assessed, options, stop);
}

Estimator::Estimator(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
Estimator::~Estimator() = default;

absl::StatusOr<std::unique_ptr<Estimator>> Estimator::Make(ResolvedProblem problem,
                                                           EstimatorOptions options) {
  if (problem.channels() == 0) {
    return absl::InvalidArgumentError("measured: at least one output must be measured");
  }
  if (options.threads < 1) {
    return absl::InvalidArgumentError(
        absl::StrFormat("threads: %d must be at least 1", options.threads));
  }
  if (options.store && options.store->rows() > 0) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "the sample store holds %d rows already; an estimator begins with an empty one",
        options.store->rows()));
  }
  auto implementation = std::make_unique<Implementation>(std::move(problem), std::move(options));
  POLYEST_RETURN_IF_ERROR(implementation->Begin());
  return std::unique_ptr<Estimator>(new Estimator(std::move(implementation)));
}

const ResolvedProblem& Estimator::problem() const { return implementation_->problem(); }
absl::Status Estimator::Append(const Samples& samples) { return implementation_->Append(samples); }
absl::Status Estimator::Process(const Stop& stop) { return implementation_->Process(stop); }
absl::StatusOr<Estimate> Estimator::CurrentEstimate(const Stop& stop) const {
  return implementation_->CurrentEstimate(stop);
}
absl::StatusOr<Posterior> Estimator::CurrentPosterior(const PosteriorOptions& options,
                                                      const Stop& stop) const {
  return implementation_->CurrentPosterior(options, stop);
}
absl::StatusOr<CostProfiles> Estimator::CurrentProfiles(const ProfileOptions& options,
                                                        const Stop& stop) const {
  return implementation_->CurrentProfiles(options, stop);
}
absl::StatusOr<RegularizationSweep> Estimator::CurrentRegularizationSweep(
    const RegularizationOptions& options, const Stop& stop) const {
  return implementation_->CurrentRegularizationSweep(options, stop);
}
int64_t Estimator::rows_appended() const { return implementation_->rows_appended(); }
int64_t Estimator::rows_processed() const { return implementation_->rows_processed(); }

}  // namespace polyest
