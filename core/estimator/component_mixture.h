#pragma once

// The components of the posterior's mixture, which advance along the record together.
//
// There is one component at first, and as long as one expansion suffices. Components are added and
// dropped only at rows that are a function of the record alone, with all components at the same
// row. When one component is divided, only its parts are weighed. All components are weighed only
// where a window of the mixture ends, and before a run for which the ended ones lose their own
// parameters.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "core/estimator/mixture_state.h"
#include "core/estimator/posterior/mixture_component.h"
#include "core/estimator/posterior/posterior_mixture.h"

namespace polyest::internal {

class ComponentMixture {
 public:
  // Makes a mixture of one component over the whole prior. `store` must outlive it. Errors are
  // those of MixtureComponent::OfPrior.
  static absl::StatusOr<std::unique_ptr<ComponentMixture>> OfPrior(
      const ResolvedProblem& problem, const SampleStore* store, int threads,
      const TemperedBeginning& beginning, const Stop& stop);
  // Restores a mixture after `rows` rows. Returns DataLoss when the state cannot belong to it,
  // or the status of a stop request.
  static absl::StatusOr<std::unique_ptr<ComponentMixture>> FromState(const ResolvedProblem& problem,
                                                                     MixtureState state,
                                                                     int64_t rows,
                                                                     const SampleStore* store,
                                                                     int threads, const Stop& stop);
  // Returns the state. May be called where all components may be asked for theirs.
  MixtureState State() const;

  // Takes rows of the store up to the first `rows`. On a stop request returns its status; the next
  // call continues from there.
  absl::Status TakeUpTo(int64_t rows, const Stop& stop);
  int64_t rows_taken() const;  // by all components

  // The misfit (posterior/misfit.h) of the component that the residuals contradict least.
  double Misfit() const;
  size_t size() const { return components_.size(); }
  const MixtureComponent& component(size_t i) const { return *components_[i]; }
  // Counts the work that the other mixture has done as done for this one.
  void AddWorkOf(const ComponentMixture& other);

  // Assesses the mixture, by default with the effort for an estimate. Returns an error only on a
  // stop request.
  absl::StatusOr<AssessedMixture> Assess(const Stop& stop) const;
  absl::StatusOr<AssessedMixture> Assess(const PosteriorEffort& effort, const Stop& stop) const;

 private:
  using Components = std::vector<std::unique_ptr<MixtureComponent>>;

  ComponentMixture() = default;

  absl::StatusOr<bool> TakeOrDivide(int64_t rows, const Stop& stop);
  absl::Status Divide(size_t component, const Stop& stop);
  bool AwaitsRun() const;
  absl::Status BeginRun(const Stop& stop);
  absl::Status UniteBeforeRun(const Stop& stop);
  std::unique_ptr<MixtureComponent> Represent(const std::vector<size_t>& group,
                                              const std::vector<Matrix>& particles);
  absl::Status Weigh(const Stop& stop);
  absl::StatusOr<std::vector<Matrix>> KeepComparable(const Stop& stop);
  void ShareRoom();
  int64_t NextWeighing(int64_t row) const;
  absl::StatusOr<std::vector<Matrix>> KeepHeaviest(Components& components, double weight,
                                                   size_t max_kept, const Stop& stop);
  absl::Status Unite(const std::vector<Matrix>& particles, const Stop& stop);
  std::vector<const Element*> ElementsBeside(size_t component) const;
  void FreeBounds(const std::vector<Matrix>& particles);
  void LeaveOut(size_t component);
  void Retire(const MixtureComponent& component);
  static std::vector<AssessmentRequest> Requests(const Components& components);

  Components components_;
  int64_t weighing_row_ = 0;   // row of the next weighing, if there are several components
  int64_t united_row_ = -1;    // before which components were last united for a new run
  double left_out_ = 0;        // largest share of components dropped for lack of room
  int elements_left_out_ = 0;  // because too few of their trajectories could be integrated
  int reexpansions_ = 0;       // by components that no longer exist
  int64_t propagated_rows_ = 0;
};

}  // namespace polyest::internal
