#include "core/umbridge/evaluation_requests.h"

#include <absl/strings/str_cat.h>

#include <iterator>
#include <set>
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
  requests.inputs_ = inputs;
  POLYEST_RETURN_IF_ERROR(requests.CheckInputs());
  return requests;
}

// Whether there are too many lines depends on the delay.
absl::Status EvaluationRequests::CheckInputs() const {
  for (Eigen::Index i = 0; i < std::ssize(inputs_); ++i) {
    std::set<double> delays_s;
    for (Eigen::Index point = 0; point < specification_->parameters.rows(); ++point) {
      if (!delays_s.insert(DelayOf(point, i)).second) continue;
      const absl::Status status = LinesFor(point, i).status();
      if (status.ok()) continue;
      const std::string& name = description_->model.inputs[static_cast<size_t>(i)].name;
      return absl::Status(status.code(), absl::StrCat("input ", name, ": ", status.message()));
    }
  }
  return absl::OkStatus();
}

// A model with inputs has no listed times, so that there are some here.
absl::StatusOr<InputLines> EvaluationRequests::LinesFor(Eigen::Index point,
                                                        Eigen::Index input) const {
  return LinesOf(inputs_[static_cast<size_t>(input)], DelayOf(point, input), times_s_.back());
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
  for (Eigen::Index i = 0; i < std::ssize(inputs_); ++i) {
    InputLines lines = LinesFor(point, i).value();  // as CheckInputs has seen
    const Matrix& offsets = specification_->input_offsets;
    const double offset = offsets.size() == 0 ? 0 : offsets(point, i);
    for (double& value : lines.values) {
      value = specification_->amplitudes(point, i) * value + offset;
    }
    driven.emplace(description_->model.inputs[static_cast<size_t>(i)].name, std::move(lines));
  }
  return driven;
}

std::string EvaluationRequests::Of(Eigen::Index point) const {
  return EvaluateRequest(description_->remote_name, Parameters(point), description_->config,
                         times_s_, Inputs(point));
}

}  // namespace polyest::internal
