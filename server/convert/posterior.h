#pragma once

// Requests and answers of GetPosterior and ProfileCost.

#include "core/estimator/cost_profile.h"
#include "core/estimator/posterior_study.h"
#include "polyest/v1/estimation_service.pb.h"

namespace polyest {

PosteriorOptions ToPosteriorOptions(const v1::GetPosteriorRequest& request);
// options: those used. `sequence` stays 0.
v1::GetPosteriorResponse ToProto(const Posterior& posterior, const PosteriorOptions& options);

ProfileOptions ToProfileOptions(const v1::ProfileCostRequest& request);
// `sequence` stays 0.
v1::ProfileCostResponse ToProto(const CostProfiles& profiles);

}  // namespace polyest
