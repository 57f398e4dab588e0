#include "core/umbridge/evaluation_requests.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "core/common/status.h"

namespace polyest::internal {

absl::StatusOr<EvaluationRequests> EvaluationRequests::Make(
    std::shared_ptr<const UmBridgeDescription> description,
    std::shared_ptr<const EnsembleSpecification> specification, const InputSignals& inputs,
    std::span<const double> times_s) {
  EvaluationRequests requests;
  requests.description_ = std::move(description);
  requests.specification_ = std::move(specification);
  requests.times_s_.assign(times_s.begin(), times_s.end());
  // A model with listed times has no inputs.
  if (!times_s.empty()) POLYEST_RETURN_IF_ERROR(requests.Drive(inputs));
  return requests;
}

absl::Status EvaluationRequests::Drive(const InputSignals& inputs) {
  shapes_.resize(inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    for (Eigen::Index point = 0; point < specification_->parameters.rows(); ++point) {
      const double delay_s = DelayOf(point, static_cast<Eigen::Index>(i));
      if (shapes_[i].contains(delay_s)) continue;
      absl::StatusOr<InputLines> lines = LinesOf(inputs[i], delay_s, times_s_.back());
      if (!lines.ok()) {
        return absl::Status(lines.status().code(),
                            absl::StrCat("input ", description_->model.inputs[i].name, ": ",
                                         lines.status().message()));
      }
      shapes_[i].emplace(delay_s, *std::move(lines));
    }
  }
  return absl::OkStatus();
}

double EvaluationRequests::DelayOf(Eigen::Index point, Eigen::Index input) const {
  const Matrix& delays_s = specification_->input_delays_s;
  return delays_s.size() == 0 ? 0 : delays_s(point, input);
}

// Deals the parameters out to the model's input vectors.
Vectors EvaluationRequests::Parameters(Eigen::Index point) const {
  Vectors vectors;
  Eigen::Index next = 0;
  for (const int size : description_->input_sizes) {
    std::vector<double>& vector = vectors.emplace_back();
    for (int i = 0; i < size; ++i) vector.push_back(specification_->parameters(point, next++));
  }
  return vectors;
}

// u_i(t) = amplitude_i · shape_i(t − delay_i) + offset_i
DrivenInputs EvaluationRequests::Inputs(Eigen::Index point) const {
  DrivenInputs driven;
  for (size_t i = 0; i < shapes_.size(); ++i) {
    const auto input = static_cast<Eigen::Index>(i);
    InputLines lines = shapes_[i].at(DelayOf(point, input));
    const Matrix& offsets = specification_->input_offsets;
    const double offset = offsets.size() == 0 ? 0 : offsets(point, input);
    for (double& value : lines.values) {
      value = specification_->amplitudes(point, input) * value + offset;
    }
    driven.emplace(description_->model.inputs[i].name, std::move(lines));
  }
  return driven;
}

std::string EvaluationRequests::Of(Eigen::Index point) const {
  return EvaluateRequest(description_->remote_name, Parameters(point), description_->config,
                         times_s_, Inputs(point));
}

}  // namespace polyest::internal
