#include "core/fmu/worker/exchange_model.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace polyest::internal {
namespace {

std::vector<Quantity> Numbered(size_t count) {
  std::vector<Quantity> quantities(count);
  for (size_t i = 0; i < count; ++i) quantities[i].name = absl::StrCat(i);
  return quantities;
}

// Returns the first elements of a buffer, which grows to hold them.
std::span<double> SpanOf(std::vector<double>& buffer, Eigen::Index count) {
  const auto size = static_cast<size_t>(count);
  if (buffer.size() < size) buffer.resize(size);
  return std::span(buffer).first(size);
}

}  // namespace

ExchangeModel::ExchangeModel(const InstanceFactory& factory,
                             std::vector<std::unique_ptr<Instance>> instances)
    : uses_time_(factory.interface.derivatives_use_time),
      states_of_outputs_(factory.states_of_outputs),
      instances_(std::move(instances)) {
  description_.states = Numbered(static_cast<size_t>(factory.interface.states));
  description_.parameters = Numbered(1);
  description_.inputs = Numbered(factory.inputs.size());
  description_.outputs = Numbered(factory.outputs.size());
}

// Calls read(instance, result) for each row, with its instance set to the row's point. A row whose
// instance fails becomes NaN.
template <class Read>
void ExchangeModel::ForEachRow(double time_s, const ConstBlock& states,
                               const ConstBlock& parameters, const ConstBlock& inputs,
                               Block results, Read read) const {
  const std::span<double> x = SpanOf(states_, states.cols());
  const std::span<double> u = SpanOf(inputs_, inputs.cols());
  const std::span<double> result = SpanOf(result_, results.cols());
  for (Eigen::Index row = 0; row < parameters.rows(); ++row) {
    Instance& instance = *instances_[static_cast<size_t>(parameters(row, 0))];
    for (size_t i = 0; i < x.size(); ++i) x[i] = states(row, static_cast<Eigen::Index>(i));
    for (size_t i = 0; i < u.size(); ++i) u[i] = inputs(row, static_cast<Eigen::Index>(i));
    if (!(instance.SetPoint(time_s, x, u.data()) && read(instance, result))) {
      std::ranges::fill(result, std::numeric_limits<double>::quiet_NaN());
    }
    for (size_t i = 0; i < result.size(); ++i) {
      results(row, static_cast<Eigen::Index>(i)) = result[i];
    }
  }
}

void ExchangeModel::InitialStates(const ConstBlock& parameters, Block states) const {
  Vector x(states.cols());
  const std::span<double> values(x.data(), static_cast<size_t>(x.size()));
  for (Eigen::Index row = 0; row < parameters.rows(); ++row) {
    Instance& instance = *instances_[static_cast<size_t>(parameters(row, 0))];
    if (!instance.GetStates(values)) x.setConstant(std::numeric_limits<double>::quiet_NaN());
    states.row(row) = x.array();
  }
}

void ExchangeModel::Derivatives(double time_s, const ConstBlock& states,
                                const ConstBlock& parameters, const ConstBlock& inputs,
                                Block derivatives) const {
  ForEachRow(
      time_s, states, parameters, inputs, derivatives,
      [](Instance& instance, std::span<double> result) { return instance.GetDerivatives(result); });
}

void ExchangeModel::Outputs(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                            const ConstBlock& inputs, Block outputs) const {
  if (states_of_outputs_.empty()) {
    ForEachRow(time_s, states, parameters, inputs, outputs,
               [](Instance& instance, std::span<double> result) {
                 return instance.GetOutputs(result.data());
               });
  }
  for (size_t i = 0; i < states_of_outputs_.size(); ++i) {
    outputs.col(static_cast<Eigen::Index>(i)) = states.col(states_of_outputs_[i]);
  }
}

ExchangeEnsemble::ExchangeEnsemble(std::shared_ptr<const ExchangeModel> model,
                                   EnsembleSpecification channels, const InputSignals* signals)
    : model_(std::move(model)) {
  const Eigen::Index points = channels.amplitudes.rows();
  channels.model = model_;
  channels.parameters = Vector::LinSpaced(points, 0, static_cast<double>(points - 1));
  channels.outputs.resize(model_->description().outputs.size());
  std::iota(channels.outputs.begin(), channels.outputs.end(), 0);
  channels.threads = 1;
  propagator_ = std::make_unique<EnsemblePropagator>(std::move(channels), signals);
}

absl::Status ExchangeEnsemble::Advance(std::span<const double> times_s, MatrixRef outputs,
                                       const Stop& stop) {
  const absl::Status status = propagator_->Advance(times_s, outputs, stop);
  failures_ = propagator_->failures();
  for (PointFailure& failure : failures_) {
    const Instance& instance = model_->instance(failure.point);
    if (instance.failure().empty()) continue;
    failure.reason = instance.failure();
    failure.flag = instance.failure_status();
  }
  return status;
}

}  // namespace polyest::internal
