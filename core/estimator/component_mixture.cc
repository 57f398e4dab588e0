#include "core/estimator/component_mixture.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/posterior/mixture_weighing.h"

namespace polyest::internal {

absl::StatusOr<std::unique_ptr<ComponentMixture>> ComponentMixture::OfPrior(
    const ResolvedProblem& problem, const SampleStore* store, int threads,
    const TemperedBeginning& beginning, const Stop& stop) {
  std::unique_ptr<ComponentMixture> mixture(new ComponentMixture);
  POLYEST_ASSIGN_OR_RETURN(mixture->components_.emplace_back(),
                           MixtureComponent::OfPrior(problem, store, threads, beginning, stop));
  return mixture;
}

absl::StatusOr<std::unique_ptr<ComponentMixture>> ComponentMixture::FromState(
    const ResolvedProblem& problem, MixtureState state, int64_t rows, const SampleStore* store,
    int threads, const Stop& stop) {
  const bool several = state.components.size() > 1;
  if (state.components.empty() || std::ssize(state.components) > MaxComponents(problem) ||
      (several && state.weighing_row <= rows)) {
    return absl::DataLossError("the snapshot's components cannot be of a mixture");
  }
  std::unique_ptr<ComponentMixture> mixture(new ComponentMixture);
  for (ComponentState& one : state.components) {
    if (one.taken != rows) return absl::DataLossError("the snapshot's components do not agree");
    POLYEST_ASSIGN_OR_RETURN(
        mixture->components_.emplace_back(),
        MixtureComponent::FromState(problem, std::move(one), store, threads, stop));
  }
  mixture->weighing_row_ = state.weighing_row;
  mixture->left_out_ = state.left_out;
  mixture->elements_left_out_ = state.elements_left_out;
  mixture->reexpansions_ = state.reexpansions;
  mixture->propagated_rows_ = state.propagated_rows;
  return mixture;
}

MixtureState ComponentMixture::State() const {
  MixtureState state;
  for (const auto& component : components_) state.components.push_back(component->State());
  state.weighing_row = weighing_row_;
  state.left_out = left_out_;
  state.elements_left_out = elements_left_out_;
  state.reexpansions = reexpansions_;
  state.propagated_rows = propagated_rows_;
  return state;
}

absl::Status ComponentMixture::TakeUpTo(int64_t rows, const Stop& stop) {
  while (true) {
    const bool weighs = components_.size() > 1 && weighing_row_ <= rows;
    POLYEST_ASSIGN_OR_RETURN(const bool divided, TakeOrDivide(weighs ? weighing_row_ : rows, stop));
    if (divided) continue;
    if (AwaitsRun()) {
      POLYEST_RETURN_IF_ERROR(BeginRun(stop));
    } else if (weighs) {
      POLYEST_RETURN_IF_ERROR(Weigh(stop));
    } else {
      return absl::OkStatus();
    }
  }
}

bool ComponentMixture::AwaitsRun() const {
  return std::ranges::any_of(components_, [](const auto& one) { return one->awaits_run(); });
}

int64_t ComponentMixture::rows_taken() const {
  int64_t rows = components_.front()->rows_taken();
  for (const auto& component : components_) rows = std::min(rows, component->rows_taken());
  return rows;
}

double ComponentMixture::Misfit() const {
  double misfit = kInfinity;
  for (const auto& component : components_) {
    misfit = std::min(misfit, component->expansion().noise().misfit);
  }
  return misfit;
}

void ComponentMixture::AddWorkOf(const ComponentMixture& other) {
  reexpansions_ += other.reexpansions_;
  propagated_rows_ += other.propagated_rows_;
  for (const auto& component : other.components_) Retire(*component);
}

// Returns true when a component has been divided or left out, or its division has failed; then not
// all components have reached `rows`.
absl::StatusOr<bool> ComponentMixture::TakeOrDivide(int64_t rows, const Stop& stop) {
  for (size_t k = 0; k < components_.size(); ++k) {
    const absl::Status taken = components_[k]->TakeUpTo(rows, stop);
    if (IsInfeasible(taken) && components_.size() > 1) {
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

absl::Status ComponentMixture::Divide(size_t component, const Stop& stop) {
  MixtureComponent& whole = *components_[component];
  POLYEST_ASSIGN_OR_RETURN(Components parts, whole.Divide(stop));
  if (parts.empty()) return absl::OkStatus();
  if (whole.bisects()) {
    for (const auto& part : parts) part->set_weight(whole.weight() / 2);
  } else {
    const auto room = static_cast<size_t>(whole.room());
    POLYEST_RETURN_IF_ERROR(KeepHeaviest(parts, whole.weight(), room, stop).status());
  }
  if (components_.size() == 1) weighing_row_ = NextWeighing(whole.rows_taken());
  Retire(whole);
  const auto place =
      components_.erase(components_.begin() + static_cast<std::ptrdiff_t>(component));
  components_.insert(place, std::make_move_iterator(parts.begin()),
                     std::make_move_iterator(parts.end()));
  return absl::OkStatus();
}

// Begins the run that the components await. After a stop some of them have begun it.
absl::Status ComponentMixture::BeginRun(const Stop& stop) {
  if (components_.size() > 1 && united_row_ != rows_taken()) {
    POLYEST_RETURN_IF_ERROR(UniteBeforeRun(stop));
  }
  for (size_t k = 0; k < components_.size();) {
    const absl::Status begun =
        components_[k]->awaits_run() ? components_[k]->BeginAwaitedRun(stop) : absl::OkStatus();
    if (IsInfeasible(begun) && components_.size() > 1) {
      LeaveOut(k);
      continue;
    }
    POLYEST_RETURN_IF_ERROR(begun);
    ++k;
  }
  return absl::OkStatus();
}

// Replaces components that differ in the parameters of the ended run alone by one of them, which
// goes on for all: without these parameters they are the same posterior, several times, and the new
// run would divide each of them again. Separate modes of the ended run's parameters stay apart.
absl::Status ComponentMixture::UniteBeforeRun(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const std::vector<Matrix> particles, KeepComparable(stop));
  FreeBounds(particles);
  const std::vector<std::vector<size_t>> groups =
      GroupsWithoutLastRun(Requests(components_), particles, stop);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  Components kept;
  for (const std::vector<size_t>& group : groups) kept.push_back(Represent(group, particles));
  for (const auto& component : components_) {
    if (component) Retire(*component);
  }
  components_ = std::move(kept);
  ShareRoom();
  united_row_ = rows_taken();
  weighing_row_ = NextWindow(united_row_, united_row_);
  return absl::OkStatus();
}

// Takes the heaviest component of the group, which goes on for all of it.
std::unique_ptr<MixtureComponent> ComponentMixture::Represent(
    const std::vector<size_t>& group, const std::vector<Matrix>& particles) {
  std::vector<Matrix> own;
  std::vector<double> weights;
  for (const size_t k : group) {
    own.push_back(particles[k]);
    weights.push_back(components_[k]->weight());
  }
  const double weight = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& one : weights) one /= weight;
  const auto heaviest = std::ranges::max_element(weights) - weights.begin();
  std::unique_ptr<MixtureComponent> kept =
      std::move(components_[group[static_cast<size_t>(heaviest)]]);
  kept->set_weight(weight);
  if (group.size() > 1) kept->GoOnFor(PooledParticles(own, weights));
  return kept;
}

// Leaves out an element in which too few trajectories can be integrated to go on.
void ComponentMixture::LeaveOut(size_t component) {
  Retire(*components_[component]);
  components_.erase(components_.begin() + static_cast<std::ptrdiff_t>(component));
  ++elements_left_out_;
}

// Adds up what a component has done that is to be replaced.
void ComponentMixture::Retire(const MixtureComponent& component) {
  reexpansions_ += component.reexpansions();
  propagated_rows_ += component.propagated_rows();
}

absl::Status ComponentMixture::Weigh(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const std::vector<Matrix> particles, KeepComparable(stop));
  POLYEST_RETURN_IF_ERROR(Unite(particles, stop));
  FreeBounds(particles);
  ShareRoom();
  weighing_row_ = NextWeighing(weighing_row_);
  return absl::OkStatus();
}

// Weighs all components, keeps those that matter, and returns the particles of each.
absl::StatusOr<std::vector<Matrix>> ComponentMixture::KeepComparable(const Stop& stop) {
  for (const auto& component : components_) {
    POLYEST_RETURN_IF_ERROR(component->MakeComparable(stop));
  }
  const int max_components = MaxComponents(components_.front()->problem());
  return KeepHeaviest(components_, 1, static_cast<size_t>(max_components), stop);
}

// Divides the room among the components.
void ComponentMixture::ShareRoom() {
  const int all = MaxComponents(components_.front()->problem());
  for (const auto& component : components_) {
    component->set_room(std::max(1, all / static_cast<int>(components_.size())));
  }
}

// Returns the row of the next weighing after one. Windows are counted from where the present run
// has begun, if earlier ones have lost their own parameters: it divides the posterior anew.
int64_t ComponentMixture::NextWeighing(int64_t row) const {
  const EndedRuns* ended = components_.front()->problem().ended_runs();
  return NextWindow(row, ended != nullptr ? ended->rows : 0);
}

// Replaces the components by a single one if its expansion represents the posterior as well.
// `particles` are those of each component. It waits until no single sample can raise a piece of
// the posterior that is too light to have particles.
absl::Status ComponentMixture::Unite(const std::vector<Matrix>& particles, const Stop& stop) {
  if (components_.size() < 2) return absl::OkStatus();
  const MixtureComponent& first = *components_.front();
  if (PowerOfFirstSamples(first.problem(), first.rows_taken()) < 1) return absl::OkStatus();
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

// Returns the elements of all components but one.
std::vector<const Element*> ComponentMixture::ElementsBeside(size_t component) const {
  std::vector<const Element*> elements;
  for (size_t k = 0; k < components_.size(); ++k) {
    if (k != component) elements.push_back(&components_[k]->element());
  }
  return elements;
}

// Frees elements from bounds on which their posterior presses and beyond which all others have been
// dropped: while the expansions were not accurate yet, the other side looked too light. `particles`
// are those of each component. What cannot be integrated stays beyond its bound.
void ComponentMixture::FreeBounds(const std::vector<Matrix>& particles) {
  if (elements_left_out_ > 0 || particles.size() != components_.size()) return;
  std::vector<Element> freed;
  for (size_t k = 0; k < components_.size(); ++k) {
    freed.push_back(components_[k]->element().Freed(ElementsBeside(k), particles[k]));
  }
  for (size_t k = 0; k < freed.size(); ++k) components_[k]->set_element(std::move(freed[k]));
}

// Keeps at most `max_kept` components, the heaviest, and returns the particles of each. `weight` is
// the weight of all of them together.
absl::StatusOr<std::vector<Matrix>> ComponentMixture::KeepHeaviest(Components& components,
                                                                   double weight, size_t max_kept,
                                                                   const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(MixtureWeighing weighing,
                           WeighMixture(Requests(components), max_kept, stop));
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

std::vector<AssessmentRequest> ComponentMixture::Requests(const Components& components) {
  std::vector<AssessmentRequest> requests;
  for (const auto& component : components) requests.push_back(component->RequestAssessment());
  return requests;
}

absl::StatusOr<AssessedMixture> ComponentMixture::Assess(const Stop& stop) const {
  return Assess(EffortForEstimate(component(0).problem()), stop);
}

absl::StatusOr<AssessedMixture> ComponentMixture::Assess(const PosteriorEffort& effort,
                                                         const Stop& stop) const {
  std::vector<AssessmentRequest> requests = Requests(components_);
  for (size_t k = 0; k < requests.size(); ++k) {
    requests[k].effort = effort;
    if (elements_left_out_ == 0) requests[k].others = ElementsBeside(k);
  }
  requests.front().reexpansions += reexpansions_;
  requests.front().propagated_rows += propagated_rows_;
  POLYEST_ASSIGN_OR_RETURN(AssessedMixture assessed,
                           AssessMixture(std::move(requests), left_out_, stop));
  if (elements_left_out_ > 0) {
    assessed.whole.estimate.diagnostics.push_back(
        {DiagnosticCode::kPointsFailed,
         absl::StrFormat(
             "parts of the prior (%d) were left out, because in each too few trajectories "
             "could be integrated",
             elements_left_out_)});
  }
  return assessed;
}

}  // namespace polyest::internal
