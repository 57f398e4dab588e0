#include "polyest/estimator.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/estimator_access.h"
#include "core/estimator/posterior/assessment.h"
#include "core/estimator/posterior/mixture_component.h"
#include "core/estimator/posterior/posterior_mixture.h"
#include "core/estimator/problem_fingerprint.h"
#include "core/estimator/record/checkpoints.h"
#include "core/estimator/record/memory_store.h"
#include "core/estimator/record/sample_checks.h"
#include "core/estimator/snapshot.h"
#include "core/estimator/studies/cost_profile.h"
#include "core/estimator/studies/posterior_study.h"
#include "core/estimator/studies/regularization_sweep.h"

namespace polyest {

using namespace internal;

namespace {

constexpr int64_t kNever = std::numeric_limits<int64_t>::max();

}  // namespace

// Owns the record and the components of the posterior's mixture. There is one component at first,
// and as long as one expansion suffices. Components are added and dropped only at rows that are a
// function of the record alone, with all components at the same row. When one component is divided,
// only its parts are weighed. All components are weighed only where a window of the mixture ends.
class Estimator::Implementation {
 public:
  Implementation(ResolvedProblem problem, EstimatorOptions options)
      : problem_(std::move(problem)),
        threads_(options.threads),
        store_(options.store ? std::move(options.store) : std::make_shared<MemoryStore>()),
        checks_(problem_),
        snapshot_(std::move(options.snapshot)),
        checkpoints_(problem_.problem().integration.samples_between_checkpoints,
                     HasCheckpointsInRuns(*problem_.problem().model)) {}

  absl::Status Begin() {
    POLYEST_ASSIGN_OR_RETURN(auto component,
                             MixtureComponent::OfPrior(problem_, store_.get(), threads_));
    components_.push_back(std::move(component));
    return absl::OkStatus();
  }

  const ResolvedProblem& problem() const { return problem_; }
  int64_t rows_appended() const { return store_->rows(); }
  int64_t rows_processed() const;

  absl::Status Append(const Samples& samples);
  absl::Status Process(const Stop& stop);
  absl::Status Restore(const EstimatorSnapshot& snapshot);
  absl::StatusOr<Estimate> CurrentEstimate(const Stop& stop) const;
  absl::StatusOr<Posterior> CurrentPosterior(const PosteriorOptions& options,
                                             const Stop& stop) const;
  absl::StatusOr<CostProfiles> CurrentProfiles(const ProfileOptions& options,
                                               const Stop& stop) const;
  absl::StatusOr<RegularizationSweep> CurrentRegularizationSweep(
      const RegularizationOptions& options, const Stop& stop) const;

 private:
  using Components = std::vector<std::unique_ptr<MixtureComponent>>;

  int64_t SettledRows() const;
  absl::StatusOr<bool> TakeUpTo(int64_t rows, const Stop& stop);
  absl::Status Divide(size_t component, const Stop& stop);
  absl::Status Weigh(const Stop& stop);
  absl::StatusOr<std::vector<Matrix>> KeepHeaviest(Components& components, double weight,
                                                   size_t most, const Stop& stop);
  absl::Status Unite(const std::vector<Matrix>& particles, const Stop& stop);
  void LeaveOut(size_t component);
  void Retire(const MixtureComponent& component);
  void MakeSnapshot(int64_t rows);
  absl::StatusOr<Components> ComponentsOf(EstimatorState& state, int64_t rows) const;
  static std::vector<AssessmentRequest> Requests(const Components& components);
  absl::StatusOr<AssessedMixture> AssessAll(const PosteriorEffort& effort, const Stop& stop) const;

  ResolvedProblem problem_;
  int threads_;
  std::shared_ptr<SampleStore> store_;
  SampleChecks checks_;
  std::function<void(EstimatorSnapshot)> snapshot_;
  Checkpoints checkpoints_;
  Components components_;
  int64_t weighing_row_ = 0;   // row of the next weighing, if there are several components
  double left_out_ = 0;        // largest share of components dropped for lack of room
  int elements_left_out_ = 0;  // because too few of their trajectories could be integrated
  int reexpansions_ = 0;       // by components that no longer exist
  int64_t propagated_rows_ = 0;
};

absl::Status Estimator::Implementation::Append(const Samples& samples) {
  POLYEST_ASSIGN_OR_RETURN(const CheckedSamples checked, checks_.Check(samples));
  std::optional<ResolvedProblem> grown;
  if (problem_.per_run() && checked.after.run >= problem_.runs()) {
    POLYEST_ASSIGN_OR_RETURN(grown, problem_.WithRuns(checked.after.run + 1));
  }
  POLYEST_RETURN_IF_ERROR(store_->Append(checked));
  if (grown) problem_ = *std::move(grown);
  checks_.Accept(checked);
  if (snapshot_) checkpoints_.Add(checked.rows);
  return absl::OkStatus();
}

// Returns the number of rows up to which the streamed inputs are settled, whatever rows may follow.
int64_t Estimator::Implementation::SettledRows() const {
  const RecordPosition& last = checks_.position();
  if (last.run_ended) return last.rows;
  return last.rows - std::min<int64_t>(problem_.knots_ahead(), last.rows_in_run);
}

int64_t Estimator::Implementation::rows_processed() const {
  int64_t rows = components_.front()->rows_taken();
  for (const auto& component : components_) rows = std::min(rows, component->rows_taken());
  return rows;
}

absl::Status Estimator::Implementation::Process(const Stop& stop) {
  const int64_t settled = SettledRows();
  while (true) {
    const int64_t checkpoint = checkpoints_.next().value_or(kNever);
    const int64_t weighing = components_.size() > 1 ? weighing_row_ : kNever;
    const int64_t rows = std::min({settled, weighing, checkpoint});
    POLYEST_ASSIGN_OR_RETURN(const bool divided, TakeUpTo(rows, stop));
    if (divided) continue;
    if (components_.size() > 1 && rows == weighing) {
      POLYEST_RETURN_IF_ERROR(Weigh(stop));
    } else if (rows == checkpoint) {
      MakeSnapshot(rows);
    } else {
      return absl::OkStatus();
    }
  }
}

void Estimator::Implementation::MakeSnapshot(int64_t rows) {
  EstimatorState state;
  for (const auto& component : components_) state.components.push_back(component->State());
  state.weighing_row = weighing_row_;
  state.left_out = left_out_;
  state.elements_left_out = elements_left_out_;
  state.reexpansions = reexpansions_;
  state.propagated_rows = propagated_rows_;
  snapshot_({rows, EncodeState(state, rows, FingerprintOf(problem_.problem()))});
  checkpoints_.Pass(rows);
}

absl::Status Estimator::Implementation::Restore(const EstimatorSnapshot& snapshot) {
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
  POLYEST_ASSIGN_OR_RETURN(components_, ComponentsOf(state, snapshot.rows));
  weighing_row_ = state.weighing_row;
  left_out_ = state.left_out;
  elements_left_out_ = state.elements_left_out;
  reexpansions_ = state.reexpansions;
  propagated_rows_ = state.propagated_rows;
  checkpoints_.Pass(snapshot.rows);
  return absl::OkStatus();
}

absl::StatusOr<Estimator::Implementation::Components> Estimator::Implementation::ComponentsOf(
    EstimatorState& state, int64_t rows) const {
  const bool several = state.components.size() > 1;
  if (state.components.empty() || std::ssize(state.components) > MostComponents(problem_) ||
      (several && state.weighing_row <= rows)) {
    return absl::DataLossError("the snapshot's components cannot be of a mixture");
  }
  Components components;
  for (ComponentState& one : state.components) {
    if (one.taken != rows) return absl::DataLossError("the snapshot's components do not agree");
    POLYEST_ASSIGN_OR_RETURN(
        components.emplace_back(),
        MixtureComponent::FromState(problem_, std::move(one), store_.get(), threads_));
  }
  return components;
}

// Returns true when a component has been divided or left out, or its division has failed; then not
// all components have reached `rows`.
absl::StatusOr<bool> Estimator::Implementation::TakeUpTo(int64_t rows, const Stop& stop) {
  for (size_t k = 0; k < components_.size(); ++k) {
    const absl::Status taken = components_[k]->TakeUpTo(rows, stop);
    if (absl::IsFailedPrecondition(taken) && components_.size() > 1) {
      LeaveOut(k);
      return true;
    }
    POLYEST_RETURN_IF_ERROR(taken);
    if (!components_[k]->must_divide()) continue;
    POLYEST_RETURN_IF_ERROR(Divide(k, stop));
    return true;
  }
  return false;
}

absl::Status Estimator::Implementation::Divide(size_t component, const Stop& stop) {
  MixtureComponent& whole = *components_[component];
  POLYEST_ASSIGN_OR_RETURN(Components parts, whole.Divide(stop));
  if (parts.empty()) return absl::OkStatus();
  if (whole.bisects()) {
    for (const auto& part : parts) part->set_weight(whole.weight() / 2);
  } else {
    const auto room = static_cast<size_t>(whole.room());
    POLYEST_RETURN_IF_ERROR(KeepHeaviest(parts, whole.weight(), room, stop).status());
  }
  if (components_.size() == 1) weighing_row_ = NextWindow(whole.rows_taken());
  Retire(whole);
  const auto place =
      components_.erase(components_.begin() + static_cast<std::ptrdiff_t>(component));
  components_.insert(place, std::make_move_iterator(parts.begin()),
                     std::make_move_iterator(parts.end()));
  return absl::OkStatus();
}

// Leaves out an element in which too few trajectories can be integrated to go on.
void Estimator::Implementation::LeaveOut(size_t component) {
  Retire(*components_[component]);
  components_.erase(components_.begin() + static_cast<std::ptrdiff_t>(component));
  ++elements_left_out_;
}

// Adds up what a component has done that is to be replaced.
void Estimator::Implementation::Retire(const MixtureComponent& component) {
  reexpansions_ += component.reexpansions();
  propagated_rows_ += component.propagated_rows();
}

absl::Status Estimator::Implementation::Weigh(const Stop& stop) {
  for (const auto& component : components_) {
    POLYEST_RETURN_IF_ERROR(component->MakeComparable(stop));
  }
  const int most = MostComponents(components_.front()->problem());
  POLYEST_ASSIGN_OR_RETURN(const std::vector<Matrix> particles,
                           KeepHeaviest(components_, 1, static_cast<size_t>(most), stop));
  POLYEST_RETURN_IF_ERROR(Unite(particles, stop));
  for (const auto& component : components_) {
    component->set_room(std::max(1, most / static_cast<int>(components_.size())));
  }
  weighing_row_ = NextWindow(weighing_row_);
  return absl::OkStatus();
}

// Replaces the components by a single one if its expansion represents the posterior as well.
// `particles` are those of each component.
absl::Status Estimator::Implementation::Unite(const std::vector<Matrix>& particles,
                                              const Stop& stop) {
  if (components_.size() < 2) return absl::OkStatus();
  std::vector<double> weights;
  for (const auto& component : components_) weights.push_back(component->weight());
  const std::optional<Piece> whole = UnitePieces(particles, weights);
  if (!whole) return absl::OkStatus();
  const auto heaviest = std::ranges::max_element(weights) - weights.begin();
  POLYEST_ASSIGN_OR_RETURN(auto united,
                           components_[static_cast<size_t>(heaviest)]->Unite(*whole, stop));
  if (!united) return absl::OkStatus();
  for (const auto& component : components_) Retire(*component);
  components_.clear();
  components_.push_back(std::move(united));
  return absl::OkStatus();
}

// Keeps the `most` heaviest components and returns the particles of each. `weight` is the weight of
// all of them together.
absl::StatusOr<std::vector<Matrix>> Estimator::Implementation::KeepHeaviest(Components& components,
                                                                            double weight,
                                                                            size_t most,
                                                                            const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(MixtureWeighing weighing,
                           WeighMixture(Requests(components), most, stop));
  Components kept;
  for (size_t i = 0; i < weighing.kept.size(); ++i) {
    kept.push_back(std::move(components[weighing.kept[i]]));
    kept.back()->set_weight(weight * weighing.weights[i]);
  }
  for (const auto& component : components) {
    if (component) Retire(*component);
  }
  left_out_ = std::max(left_out_, weight * weighing.left_out);
  components = std::move(kept);
  return std::move(weighing.particles);
}

std::vector<AssessmentRequest> Estimator::Implementation::Requests(const Components& components) {
  std::vector<AssessmentRequest> requests;
  for (const auto& component : components) requests.push_back(component->RequestAssessment());
  return requests;
}

absl::StatusOr<AssessedMixture> Estimator::Implementation::AssessAll(const PosteriorEffort& effort,
                                                                     const Stop& stop) const {
  std::vector<AssessmentRequest> requests = Requests(components_);
  for (AssessmentRequest& request : requests) request.effort = effort;
  requests.front().reexpansions += reexpansions_;
  requests.front().propagated_rows += propagated_rows_;
  POLYEST_ASSIGN_OR_RETURN(AssessedMixture assessed,
                           AssessMixture(std::move(requests), left_out_, stop));
  if (elements_left_out_ > 0) {
    assessed.whole.estimate.diagnostics.push_back(
        {DiagnosticCode::kPointsFailed,
         absl::StrFormat("%d parts of the prior were left out, because in each of them too few "
                         "trajectories could be integrated",
                         elements_left_out_)});
  }
  return assessed;
}

absl::StatusOr<Estimate> Estimator::Implementation::CurrentEstimate(const Stop& stop) const {
  POLYEST_ASSIGN_OR_RETURN(AssessedMixture assessed, AssessAll(PosteriorEffort(), stop));
  return std::move(assessed.whole.estimate);
}

absl::StatusOr<Posterior> Estimator::Implementation::CurrentPosterior(
    const PosteriorOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(Validate(options, problem_.prior()));
  POLYEST_ASSIGN_OR_RETURN(const AssessedMixture assessed, AssessAll(EffortOf(options), stop));
  return DescribePosterior(assessed.whole, problem_.prior(), options);
}

absl::StatusOr<CostProfiles> Estimator::Implementation::CurrentProfiles(
    const ProfileOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(Validate(options, problem_.prior()));
  POLYEST_ASSIGN_OR_RETURN(const AssessedMixture assessed, AssessAll(PosteriorEffort(), stop));
  const auto profile = [&](const Assessed& one, size_t component) {
    const RegionalExpansion& expansion = components_[component]->expansion();
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

absl::StatusOr<RegularizationSweep> Estimator::Implementation::CurrentRegularizationSweep(
    const RegularizationOptions& options, const Stop& stop) const {
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_ASSIGN_OR_RETURN(const AssessedMixture assessed, AssessAll(PosteriorEffort(), stop));
  const RegionalExpansion& expansion = components_[assessed.order.front()]->expansion();
  return SweepRegularization(problem_, expansion, assessed.whole, options, stop);
}

Estimator::Estimator(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
Estimator::~Estimator() = default;

absl::StatusOr<std::unique_ptr<Estimator>> Estimator::Make(Problem problem,
                                                           EstimatorOptions options) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem resolved, ResolvedProblem::Make(std::move(problem)));
  return EstimatorAccess::Make(std::move(resolved), std::move(options));
}

const Problem& Estimator::problem() const { return implementation_->problem().problem(); }
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
absl::Status Estimator::Restore(const EstimatorSnapshot& snapshot) {
  return implementation_->Restore(snapshot);
}
int64_t Estimator::rows_appended() const { return implementation_->rows_appended(); }
int64_t Estimator::rows_processed() const { return implementation_->rows_processed(); }

}  // namespace polyest

namespace polyest::internal {

absl::StatusOr<std::unique_ptr<Estimator>> EstimatorAccess::Make(ResolvedProblem problem,
                                                                 EstimatorOptions options) {
  if (problem.channels() == 0) {
    return InvalidField("measured", "at least one output must be measured");
  }
  if (options.threads < 1) {
    return InvalidField("threads", absl::StrFormat("%d must be at least 1", options.threads));
  }
  if (options.store && options.store->rows() > 0) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "the sample store holds %d rows already; an estimator begins with an empty one",
        options.store->rows()));
  }
  auto implementation =
      std::make_unique<Estimator::Implementation>(std::move(problem), std::move(options));
  POLYEST_RETURN_IF_ERROR(implementation->Begin());
  return std::unique_ptr<Estimator>(new Estimator(std::move(implementation)));
}

const ResolvedProblem& EstimatorAccess::ProblemOf(const Estimator& estimator) {
  return estimator.implementation_->problem();
}

}  // namespace polyest::internal
