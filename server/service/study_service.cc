#include "polyest/v1/study_service.grpc.pb.h"
#include "server/service/services.h"
#include "server/service/study_jobs.h"

namespace polyest::internal {
namespace {

class StudyService final : public v1::StudyService::CallbackService {
 public:
  using Unary = grpc::ServerUnaryReactor;
  using Context = grpc::CallbackServerContext;

  explicit StudyService(const ServiceContext& context) : context_(context) {}

  Unary* ComputeEstimate(Context* call, const v1::ComputeEstimateRequest* request,
                         v1::ComputeEstimateResponse* response) override {
    return Compute(call, "ComputeEstimate", request, response);
  }
  Unary* ComputePropagation(Context* call, const v1::ComputePropagationRequest* request,
                            v1::ComputePropagationResponse* response) override {
    return Compute(call, "ComputePropagation", request, response);
  }
  Unary* ComputeCostGrid(Context* call, const v1::ComputeCostGridRequest* request,
                         v1::ComputeCostGridResponse* response) override {
    return Compute(call, "ComputeCostGrid", request, response);
  }
  Unary* ComputeSensitivity(Context* call, const v1::ComputeSensitivityRequest* request,
                            v1::ComputeSensitivityResponse* response) override {
    return Compute(call, "ComputeSensitivity", request, response);
  }
  Unary* ComputeExperimentDesign(Context* call, const v1::ComputeExperimentDesignRequest* request,
                                 v1::ComputeExperimentDesignResponse* response) override {
    return Compute(call, "ComputeExperimentDesign", request, response);
  }
  Unary* ComputePosterior(Context* call, const v1::ComputePosteriorRequest* request,
                          v1::ComputePosteriorResponse* response) override {
    return Compute(call, "ComputePosterior", request, response);
  }
  Unary* ComputeCostProfiles(Context* call, const v1::ComputeCostProfilesRequest* request,
                             v1::ComputeCostProfilesResponse* response) override {
    return Compute(call, "ComputeCostProfiles", request, response);
  }
  Unary* ComputeLogDensity(Context* call, const v1::ComputeLogDensityRequest* request,
                           v1::ComputeLogDensityResponse* response) override {
    return Compute(call, "ComputeLogDensity", request, response);
  }
  Unary* ComputeRegularizationSweep(Context* call,
                                    const v1::ComputeRegularizationSweepRequest* request,
                                    v1::ComputeRegularizationSweepResponse* response) override {
    return Compute(call, "ComputeRegularizationSweep", request, response);
  }
  Unary* Predict(Context* call, const v1::PredictRequest* request,
                 v1::PredictResponse* response) override {
    return Compute(call, "Predict", request, response);
  }

 private:
  template <typename Request, typename Response>
  Unary* Compute(Context* call, Method method, const Request* request, Response* response) {
    return StartCall(context_, {call, method, request, response}, [&](const Caller& caller) {
      return StudyJob(context_, caller, request, response);
    });
  }

  const ServiceContext context_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeStudyService(const ServiceContext& context) {
  return std::make_unique<StudyService>(context);
}

}  // namespace polyest::internal
