#include "server/web/web_call.h"

#include <grpc/support/time.h>
#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/client_callback.h>

#include <condition_variable>
#include <mutex>

#include "core/common/check.h"
#include "server/telemetry/request_id.h"

namespace polyest::internal {

// Receives what happens to the call on gRPC's threads. A hold keeps gRPC from ending the call while
// the next read may be started from another thread.
class WebCall::Reactor final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  Reactor(const std::shared_ptr<grpc::Channel>& channel, const Request& request) : stub_(channel) {
    for (const auto& [key, value] : request.metadata) context_.AddMetadata(key, value);
    if (request.timeout) {
      context_.set_deadline(
          gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC),
                       gpr_time_from_micros(request.timeout->count(), GPR_TIMESPAN)));
    }
    const grpc::Slice slice(request.message);
    request_ = grpc::ByteBuffer(&slice, 1);
    stub_.PrepareBidiStreamingCall(&context_, request.method, grpc::StubOptions(), this);
    AddHold();
    // Within a process, gRPC drops a message that comes along with the status, as that of a unary
    // call does, unless it has been asked for (grpc/grpc#23398). The call then seems to end well.
    reading_ = true;
    StartRead(&response_);
    StartWriteLast(&request_, grpc::WriteOptions());
    StartCall();
  }

  const WakeUp& wake_up() const { return wake_up_; }

  void OnReadDone(bool ok) override {
    bool release = false;
    {
      const std::lock_guard lock(mutex_);
      reading_ = false;
      has_message_ = ok && !closing_;
      if (!has_message_) release = std::exchange(held_, false);
      wake_up_.Signal();
    }
    if (release) RemoveHold();
  }

  void OnDone(const grpc::Status& status) override {
    const std::lock_guard lock(mutex_);
    status_ = status;
    done_ = true;
    wake_up_.Signal();
    ended_.notify_all();
  }

  // Returns what has happened, if anything, and otherwise asks for the next message.
  std::optional<Event> Look() {
    bool read = false;
    {
      const std::lock_guard lock(mutex_);
      wake_up_.Clear();
      if (has_message_) return Event::kMessage;
      if (done_) return Event::kEnd;
      if (held_ && !reading_) read = reading_ = true;
    }
    if (read) StartRead(&response_);
    return std::nullopt;
  }

  std::string TakeMessage() {
    const std::lock_guard lock(mutex_);
    has_message_ = false;
    std::vector<grpc::Slice> slices;
    POLYEST_CHECK(response_.Dump(&slices).ok());
    std::string message;
    message.reserve(response_.Length());
    for (const grpc::Slice& slice : slices) {
      message.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
    response_.Clear();
    return message;
  }

  void Cancel() { context_.TryCancel(); }

  void Close() {
    Cancel();
    bool release = false;
    {
      const std::lock_guard lock(mutex_);
      closing_ = true;
      if (!reading_) release = std::exchange(held_, false);
    }
    if (release) RemoveHold();
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [this] { return done_; });
  }

  const grpc::Status& status() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }

  std::string RequestId() const {
    const auto& metadata = context_.GetServerInitialMetadata();
    const auto found = metadata.find(kRequestIdKey);
    return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
  }

 private:
  const WakeUp wake_up_;
  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;  // belongs to gRPC while reading_ is set
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  bool reading_ = false;
  bool has_message_ = false;
  bool held_ = true;
  bool closing_ = false;
  bool done_ = false;
  grpc::Status status_;
};

WebCall::WebCall(const std::shared_ptr<grpc::Channel>& channel, const Request& request)
    : reactor_(std::make_unique<Reactor>(channel, request)) {}

WebCall::~WebCall() { reactor_->Close(); }

void WebCall::Cancel() { reactor_->Cancel(); }

WebCall::Event WebCall::Await(int client, Clock::time_point deadline) {
  return AwaitEvent(reactor_->wake_up(), client, deadline, [this] { return reactor_->Look(); });
}

WebCall::Event WebCall::AwaitEvent(const WakeUp& wake_up, int client, Clock::time_point deadline,
                                   absl::FunctionRef<std::optional<Event>()> look) {
  while (true) {
    if (const std::optional<Event> event = look()) return *event;
    switch (wake_up.Await(client, deadline)) {
      case WakeUp::Reason::kSignal:
        break;
      case WakeUp::Reason::kClientGone:
        return Event::kClientGone;
      case WakeUp::Reason::kTimeout:
        return Event::kTimeout;
    }
  }
}

std::optional<grpc::Status> WebCall::AwaitOnly(int client, std::string& message) {
  const Clock::time_point deadline = Clock::now() + kForever;
  Event event = Await(client, deadline);
  const bool answered = event == Event::kMessage;
  if (answered) {
    message = TakeMessage();
    event = Await(client, deadline);
  }
  if (event != Event::kEnd) return std::nullopt;
  if (status().ok() && !answered) {
    return grpc::Status(grpc::StatusCode::INTERNAL, "the call has ended without an answer");
  }
  return status();
}

std::string WebCall::TakeMessage() { return reactor_->TakeMessage(); }

const grpc::Status& WebCall::status() const { return reactor_->status(); }

std::string WebCall::request_id() const { return reactor_->RequestId(); }

}  // namespace polyest::internal
