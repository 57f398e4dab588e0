#include "polyest/v1/model_service.grpc.pb.h"
#include "proto/wire/operations/operations.h"
#include "server/service/calls.h"
#include "server/service/services.h"

namespace polyest::internal {
namespace {

class ModelService final : public v1::ModelService::CallbackService {
 public:
  using Unary = grpc::ServerUnaryReactor;
  using Context = grpc::CallbackServerContext;

  explicit ModelService(const ServiceContext& context) : context_(context) {}

  // A folder of FMUs may have to be read, which may take long.
  Unary* ListModels(Context* call, const v1::ListModelsRequest* request,
                    v1::ListModelsResponse* response) override {
    return StartCall(
        context_, {call, "ListModels", request, response}, [=, this](const Caller& caller) {
          return JobOfCaller(context_, caller, [=, this](const Caller&, const Stop&) {
            return Deliver(polyest::internal::ListModels(*request, context_.models), response);
          });
        });
  }

  Unary* GetModel(Context* call, const v1::GetModelRequest* request, v1::Model* response) override {
    return StartCall(
        context_, {call, "GetModel", request, response}, [=, this](const Caller& caller) {
          return JobOfCaller(context_, caller, [=, this](const Caller&, const Stop&) {
            return Deliver(polyest::internal::GetModel(*request, context_.models), response);
          });
        });
  }

 private:
  const ServiceContext context_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeModelService(const ServiceContext& context) {
  return std::make_unique<ModelService>(context);
}

}  // namespace polyest::internal
