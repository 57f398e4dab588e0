// Sends arbitrary requests to every call of the service, several in a row and on streams, to a
// daemon in the same process. None may crash it, hang it, make it answer with a fault of its own,
// or leave anything behind. An input is a script (rpc_script.h).

#include <google/protobuf/stubs/logging.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/common/check.h"
#include "polyest/v1/model_service.grpc.pb.h"
#include "polyest/v1/operation_service.grpc.pb.h"
#include "polyest/v1/session_service.grpc.pb.h"
#include "server/daemon/daemon.h"
#include "tests/fuzz/message_mutation.h"
#include "tests/fuzz/open_rpc.h"
#include "tests/fuzz/rpc_script.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t most);

namespace polyest::internal {
namespace {

constexpr size_t kMaxCalls = 12;
// The time limit of the computation for one call. A computation that does not stop at it delays the
// next input until libFuzzer reports a hang.
constexpr std::chrono::milliseconds kDeadline{100};

// A daemon that keeps nothing on disk. It has one thread for each kind of call, so that each run of
// an input is the same.
class Server {
 public:
  Server() {
    google::protobuf::SetLogHandler(nullptr);
    spdlog::set_level(spdlog::level::off);
    DaemonOptions options;
    options.listen = {{"127.0.0.1", 0}};
    options.threads = 1;
    options.max_message_mb = 1;
    options.limits = {.sessions = 8, .sessions_per_tenant = 8, .batch_rows = 1'000, .rows = 10'000};
    auto daemon = Daemon::Start(options);
    POLYEST_CHECK(daemon.ok());
    daemon_ = *std::move(daemon);
    channel_ = grpc::CreateChannel(daemon_->addresses().front().ToString(),
                                   grpc::InsecureChannelCredentials());
    generic_ = std::make_unique<grpc::GenericStub>(channel_);
    models_ = v1::ModelService::NewStub(channel_);
    sessions_ = v1::SessionService::NewStub(channel_);
    operations_ = v1::OperationService::NewStub(channel_);
  }

  void Run(const RpcScript& script) {
    std::vector<std::unique_ptr<OpenRpc>> calls;
    for (const ScriptCall& call : script) {
      if (calls.size() == kMaxCalls) break;
      calls.push_back(std::make_unique<OpenRpc>(*generic_, call, kDeadline));
      calls.back()->Await();
    }
    calls.clear();
    Clean();
  }

 private:
  // Brings the daemon back to its first state for the next input.
  void Clean() {
    AwaitCalls();
    DeleteOperations();
    const v1::ListSessionsResponse left = List();
    for (const v1::Session& session : left.sessions()) {
      grpc::ClientContext context;
      v1::DeleteSessionRequest request;
      request.set_name(session.name());
      google::protobuf::Empty response;
      POLYEST_CHECK(sessions_->DeleteSession(&context, request, &response).ok());
    }
    AwaitCalls();
    POLYEST_CHECK(List().sessions().empty());
  }

  v1::ListSessionsResponse List() {
    grpc::ClientContext context;
    v1::ListSessionsResponse response;
    POLYEST_CHECK(sessions_->ListSessions(&context, {}, &response).ok());
    return response;
  }

  void DeleteOperations() {
    grpc::ClientContext context;
    v1::ListOperationsRequest all;
    all.set_page_size(200);
    v1::ListOperationsResponse left;
    POLYEST_CHECK(operations_->ListOperations(&context, all, &left).ok());
    for (const v1::Operation& operation : left.operations()) {
      grpc::ClientContext deletion;
      v1::DeleteOperationRequest request;
      request.set_name(operation.name());
      google::protobuf::Empty response;
      POLYEST_CHECK(operations_->DeleteOperation(&deletion, request, &response).ok());
    }
  }

  // Waits for all cancelled calls, by one more call in each lane of the executor.
  void AwaitCalls() {
    grpc::ClientContext of_models, of_sessions;
    v1::ListModelsResponse models;
    POLYEST_CHECK(models_->ListModels(&of_models, {}, &models).ok());
    v1::GetSessionRequest none;
    none.set_name("sessions/none");
    v1::Session session;
    sessions_->GetSession(&of_sessions, none, &session);
  }

  std::unique_ptr<Daemon> daemon_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<grpc::GenericStub> generic_;
  std::unique_ptr<v1::ModelService::Stub> models_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
  std::unique_ptr<v1::OperationService::Stub> operations_;
};

// Adds a call, with an empty request or a copy of one in the script.
void AddCall(RpcScript& script, MessageMutation& mutation) {
  const auto methods = FuzzedMethods();
  ScriptCall call{.method = methods[mutation.Choose(methods.size())], .requests = {}};
  call.requests.push_back({MakeMessage(*call.method->input_type()), ""});
  const size_t at = mutation.Choose(script.size() + 1);
  script.insert(script.begin() + static_cast<std::ptrdiff_t>(at), std::move(call));
}

void MutateCall(RpcScript& script, MessageMutation& mutation) {
  const size_t chosen = mutation.Choose(script.size());
  ScriptCall& call = script[chosen];
  ScriptRequest& request = call.requests[mutation.Choose(call.requests.size())];
  switch (mutation.Choose(16)) {
    case 0:
      script.erase(script.begin() + static_cast<std::ptrdiff_t>(chosen));
      return;
    case 1:
      std::swap(call, script[mutation.Choose(script.size())]);
      return;
    case 2:
      call.cancelled = !call.cancelled;
      return;
    case 3:
      // The request is kept as bytes from here on.
      request.bytes = request.Wire();
      request.message = nullptr;
      return mutation.MutateBytesOf(request.bytes);
    case 4:
    case 5:
      call.requests.push_back({nullptr, request.bytes});
      if (call.requests.front().message != nullptr) {
        call.requests.back().message = MakeMessage(*call.method->input_type());
        mutation.Replace(*call.requests.back().message);
      }
      return;
    default:
      if (request.message == nullptr) return mutation.MutateBytesOf(request.bytes);
      return mutation.Mutate(*request.message);
  }
}

std::string MutateScript(std::string_view text, unsigned seed) {
  MessageMutation mutation(seed, LLVMFuzzerMutate);
  const RpcScript known = ParseScript(text);
  for (const ScriptCall& call : known) {
    for (const ScriptRequest& request : call.requests) {
      if (request.message != nullptr) mutation.Learn(*request.message);
    }
  }
  RpcScript script = ParseScript(text);
  for (size_t changes = 1 + mutation.Choose(4); changes > 0; --changes) {
    if (script.empty() || mutation.Choose(24) == 0) {
      AddCall(script, mutation);
    } else {
      MutateCall(script, mutation);
    }
  }
  return PrintScript(script);
}

}  // namespace
}  // namespace polyest::internal

// Hides OpenSSL's list of errors of a thread: the leak sanitizer does not see the pointer to it.
extern "C" const char* __lsan_default_suppressions() { return "leak:CRYPTO_zalloc"; }

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t most, unsigned seed) {
  const std::string text =
      polyest::internal::MutateScript({reinterpret_cast<const char*>(data), size}, seed);
  // Changes the raw bytes of an input that is too long to be kept whole.
  if (text.size() > most || seed % 16 == 0) return LLVMFuzzerMutate(data, size, most);
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static polyest::internal::Server server;
  server.Run(polyest::internal::ParseScript({reinterpret_cast<const char*>(data), size}));
  return 0;
}
