#pragma once

// Converts the requests and the responses of ComputePosterior and ComputeCostProfiles.

#include "core/estimator/studies/cost_profile.h"
#include "core/estimator/studies/posterior_study.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

PosteriorOptions ToPosteriorOptions(const v1::ComputePosteriorRequest& request);
// Converts a posterior that was computed with `options`. `sequence` stays 0: only the session knows
// it.
v1::ComputePosteriorResponse ToProto(const Posterior& posterior, const PosteriorOptions& options);

ProfileOptions ToProfileOptions(const v1::ComputeCostProfilesRequest& request);
// Converts cost profiles. `sequence` stays 0: only the session knows it.
v1::ComputeCostProfilesResponse ToProto(const CostProfiles& profiles);

}  // namespace polyest::internal
