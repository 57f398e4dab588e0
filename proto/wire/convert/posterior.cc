#include "proto/wire/convert/posterior.h"

#include <algorithm>

#include "core/common/check.h"
#include "proto/wire/convert/estimate.h"
#include "proto/wire/convert/repeated.h"

namespace polyest::internal {
namespace {

constexpr size_t kMaxPaired = 8;  // parameters of ComputePosteriorRequest.all_joints

v1::ComputePosteriorResponse::Method ToProto(PosteriorMethod method) {
  switch (method) {
    case PosteriorMethod::kImportanceSampling:
      return v1::ComputePosteriorResponse::IMPORTANCE_SAMPLING;
    case PosteriorMethod::kMarkovChains:
      return v1::ComputePosteriorResponse::MARKOV_CHAINS;
  }
  POLYEST_CHECK(false);
}

void ToProto(const PosteriorMarginal& marginal, v1::ComputePosteriorResponse::Marginal& proto) {
  proto.set_name(marginal.parameter);
  proto.set_unit(marginal.unit);
  proto.set_mean(marginal.mean);
  proto.set_std_dev(marginal.std_dev);
  Append(marginal.quantiles, *proto.mutable_quantiles());
  Append(marginal.density.value, *proto.mutable_value());
  Append(marginal.density.density, *proto.mutable_density());
  proto.set_effective_sample_size(marginal.effective_size);
  proto.set_r_hat(marginal.r_hat);
}

}  // namespace

PosteriorOptions ToPosteriorOptions(const v1::ComputePosteriorRequest& request,
                                    const std::vector<std::string>& names) {
  PosteriorOptions options;
  if (!request.probabilities().empty()) {
    options.probabilities.assign(request.probabilities().begin(), request.probabilities().end());
  }
  if (request.density_bin_count() != 0) options.density_bins = request.density_bin_count();
  for (const auto& pair : request.joints())
    options.joints.emplace_back(pair.first(), pair.second());
  const size_t paired = request.all_joints() ? std::min<size_t>(names.size(), kMaxPaired) : 0;
  for (size_t i = 0; i < paired; ++i) {
    for (size_t j = i + 1; j < paired; ++j) options.joints.emplace_back(names[i], names[j]);
  }
  if (request.joint_bin_count() != 0) options.joint_bins = request.joint_bin_count();
  options.samples = request.sample_count();
  return options;
}

v1::ComputePosteriorResponse ToProto(const Posterior& posterior, const PosteriorOptions& options) {
  v1::ComputePosteriorResponse response;
  for (const PosteriorMarginal& marginal : posterior.marginals) {
    ToProto(marginal, *response.add_parameters());
  }
  response.mutable_probabilities()->Add(options.probabilities.begin(), options.probabilities.end());
  for (const PosteriorJoint& joint : posterior.joints) {
    v1::ComputePosteriorResponse::Joint& added = *response.add_joints();
    added.set_first(joint.first);
    added.set_second(joint.second);
    Append(joint.density.first, *added.mutable_first_value());
    Append(joint.density.second, *added.mutable_second_value());
    Append(joint.density.density, *added.mutable_density());
  }
  Append(posterior.samples, *response.mutable_samples());
  response.mutable_sample_chains()->Add(posterior.sample_chains.begin(),
                                        posterior.sample_chains.end());
  response.set_method(ToProto(posterior.method));
  response.set_draw_count(posterior.draws);
  response.set_effective_sample_size(posterior.effective_size);
  response.set_r_hat(posterior.r_hat);
  if (posterior.log_evidence) response.set_log_evidence(*posterior.log_evidence);
  for (const Diagnostic& diagnostic : posterior.diagnostics) {
    *response.add_diagnostics() = ToProto(diagnostic);
  }
  response.set_time_s(posterior.time_s);
  response.set_measured_value_count(posterior.sample_values);
  return response;
}

ProfileOptions ToProfileOptions(const v1::ComputeCostProfilesRequest& request) {
  ProfileOptions options;
  options.parameters.assign(request.parameters().begin(), request.parameters().end());
  if (request.point_count() != 0) options.points = request.point_count();
  return options;
}

v1::ComputeCostProfilesResponse ToProto(const CostProfiles& profiles) {
  v1::ComputeCostProfilesResponse response;
  for (const CostProfile& profile : profiles.profiles) {
    v1::ComputeCostProfilesResponse::Profile& added = *response.add_profiles();
    added.set_parameter(profile.parameter);
    added.set_unit(profile.unit);
    Append(profile.value, *added.mutable_value());
    Append(profile.total, *added.mutable_total());
    Append(profile.mismatch, *added.mutable_mismatch());
    Append(profile.prior, *added.mutable_prior());
    Append(profile.at, *added.mutable_minima());
    for (const bool converged : profile.converged) added.add_converged(converged);
  }
  response.mutable_parameters()->Add(profiles.parameters.begin(), profiles.parameters.end());
  response.mutable_least()->set_total(profiles.least.total);
  response.mutable_least()->set_mismatch(profiles.least.mismatch);
  response.mutable_least()->set_prior(profiles.least.prior);
  for (const Diagnostic& diagnostic : profiles.diagnostics) {
    *response.add_diagnostics() = ToProto(diagnostic);
  }
  return response;
}

}  // namespace polyest::internal
