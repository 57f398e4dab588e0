#include "tests/fuzz/open_rpc.h"

#include <cstdio>
#include <string>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr std::chrono::milliseconds kTimeToAnswer{10};

}  // namespace

OpenRpc::OpenRpc(grpc::GenericStub& stub, const ScriptCall& call,
                 std::chrono::milliseconds deadline)
    : call_(call) {
  for (const ScriptRequest& request : call.requests) {
    const std::string wire = request.Wire();
    well_formed_ = well_formed_ && MakeMessage(*call.method->input_type())->ParseFromString(wire);
    const grpc::Slice slice(wire);
    requests_.emplace_back(&slice, 1);
  }
  context_.set_deadline(std::chrono::system_clock::now() + deadline);
  const std::string path = "/" + call.method->service()->full_name() + "/" + call.method->name();
  stub.PrepareBidiStreamingCall(&context_, path, {}, this);
  StartRead(&answer_);
  WriteNext();
  StartCall();
}

OpenRpc::~OpenRpc() {
  context_.TryCancel();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ended_; });
}

void OpenRpc::Await() {
  std::unique_lock lock(mutex_);
  const auto ended = [this] { return ended_; };
  if (call_.method->server_streaming() && !call_.method->client_streaming()) {
    changed_.wait_for(lock, kTimeToAnswer, ended);
  } else {
    changed_.wait(lock, ended);
  }
}

void OpenRpc::WriteNext() {
  if (written_ < requests_.size()) {
    StartWrite(&requests_[written_++]);
  } else if (call_.cancelled) {
    context_.TryCancel();
  } else {
    StartWritesDone();
  }
}

void OpenRpc::OnWriteDone(bool ok) {
  if (ok) WriteNext();
}

void OpenRpc::OnReadDone(bool ok) {
  if (!ok) return;
  CheckAnswer();
  StartRead(&answer_);
}

void OpenRpc::OnDone(const grpc::Status& status) {
  CheckStatus(status);
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

void OpenRpc::CheckAnswer() {
  std::vector<grpc::Slice> slices;
  POLYEST_CHECK(answer_.Dump(&slices).ok());
  std::string bytes;
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  POLYEST_CHECK(MakeMessage(*call_.method->output_type())->ParseFromString(bytes));
}

void OpenRpc::CheckStatus(const grpc::Status& status) const {
  const grpc::StatusCode code = status.error_code();
  const bool fault = code == grpc::StatusCode::INTERNAL || code == grpc::StatusCode::UNKNOWN ||
                     code == grpc::StatusCode::DATA_LOSS;
  // gRPC itself refuses with INTERNAL a request that it cannot parse.
  if (!fault || !well_formed_) return;
  std::fprintf(stderr, "%s: code %d: %s\n", call_.method->name().c_str(), static_cast<int>(code),
               status.error_message().c_str());
  POLYEST_CHECK(!fault);
}

}  // namespace polyest::internal
