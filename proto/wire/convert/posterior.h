#pragma once

// Converts the requests and the responses of ComputePosterior and ComputeCostProfiles.

#include <string>
#include <vector>

#include "core/estimator/studies/cost_profile.h"
#include "core/estimator/studies/posterior_study.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Converts the options for a posterior of the parameters of these names.
PosteriorOptions ToPosteriorOptions(const v1::ComputePosteriorRequest& request,
                                    const std::vector<std::string>& names);
// Converts a posterior that was computed with `options`. `sequence` stays 0: only the session knows
// it.
v1::ComputePosteriorResponse ToProto(const Posterior& posterior, const PosteriorOptions& options);

ProfileOptions ToProfileOptions(const v1::ComputeCostProfilesRequest& request);
// Converts cost profiles. `sequence` stays 0: only the session knows it.
v1::ComputeCostProfilesResponse ToProto(const CostProfiles& profiles);

}  // namespace polyest::internal
