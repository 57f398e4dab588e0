#pragma once

// Instances of an FMU for Model Exchange without events as one state-space model, integrated by the
// same integrators as the built-in models. The only parameter is the index of the instance.

#include <memory>
#include <utility>
#include <vector>

#include "core/fmu/worker/instance.h"
#include "core/propagation/ensemble_propagator.h"
#include "polyest/model.h"

namespace polyest::internal {

class ExchangeModel final : public StateSpaceModel {
 public:
  ExchangeModel(const InstanceFactory& factory, std::vector<std::unique_ptr<Instance>> instances);
  // So many instances that are still to be set.
  ExchangeModel(const InstanceFactory& factory, int points)
      : ExchangeModel(factory,
                      std::vector<std::unique_ptr<Instance>>(static_cast<size_t>(points))) {}
  bool Has(int point) const { return instances_[static_cast<size_t>(point)] != nullptr; }
  void Set(int point, std::unique_ptr<Instance> instance) {
    instances_[static_cast<size_t>(point)] = std::move(instance);
  }

  const ModelDescription& description() const override { return description_; }
  bool uses_time() const override { return uses_time_; }
  void InitialStates(const ConstBlock& parameters, Block states) const override;
  void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock& inputs, Block derivatives) const override;
  void Outputs(double time_s, const ConstBlock& states, const ConstBlock& parameters,
               const ConstBlock& inputs, Block outputs) const override;

  const Instance& instance(int point) const { return *instances_[static_cast<size_t>(point)]; }

 private:
  template <class Read>
  void ForEachRow(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                  const ConstBlock& inputs, Block results, Read read) const;

  ModelDescription description_;
  const bool uses_time_;
  const std::vector<int> states_of_outputs_;  // see InstanceFactory
  std::vector<std::unique_ptr<Instance>> instances_;
  // Values of one row, for calls. All calls come from one thread: a worker computes in no other.
  mutable std::vector<double> states_, inputs_, result_;
};

// A block of such instances, with the reason for each failure.
class ExchangeEnsemble final : public TrajectoryEnsemble {
 public:
  // `channels` holds the rows of this block only.
  ExchangeEnsemble(std::shared_ptr<const ExchangeModel> model, EnsembleSpecification channels,
                   const InputSignals* signals);

  int points() const override { return propagator_->points(); }
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs,
                       const Stop& stop) override;
  const std::vector<PointFailure>& failures() const override { return failures_; }

 private:
  std::shared_ptr<const ExchangeModel> model_;
  std::unique_ptr<EnsemblePropagator> propagator_;
  std::vector<PointFailure> failures_;
};

}  // namespace polyest::internal
