#pragma once

// Passes a stream on to the daemon that owns its session. In each direction one message is under
// way: the next one is read when the last one has been written, so that HTTP/2's flow control
// reaches from the owner to the client and back.

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/client_callback.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/forwarding/node_forwarder.h"
#include "server/service/open_calls.h"
#include "server/service/passed_on.h"
#include "server/service/status_mapping.h"

namespace polyest::internal {

// Takes what happens between this daemon and the client. Thread-safe.
class PassedOnStream : public Drainable {
 public:
  virtual void OnRead(bool ok) = 0;
  virtual void OnWritten(bool ok) = 0;
  virtual void OnCancelled() = 0;
};

// Is made when nothing has been written to the client and nothing is being read from it. `Reactor`
// is that of the call at this daemon; one that reads must be a bidirectional one.
template <typename Request, typename Response, typename Reactor>
class StreamRelay final : public PassedOnStream, public grpc::ClientBidiReactor<Request, Response> {
 public:
  // Starts to pass the call on, with the request that has been read already. `reactor` is finished
  // when the owner's call has ended; `call` must live until then.
  static std::shared_ptr<PassedOnStream> Start(NodeForwarder::Passage passage,
                                               const std::string& path,
                                               grpc::CallbackServerContext& call, Reactor* reactor,
                                               Request first) {
    std::shared_ptr<StreamRelay> relay(
        new StreamRelay(std::move(passage), call, reactor, std::move(first)));
    relay->Begin(path, relay);
    return relay;
  }

  // The client has sent a request, or has no more.
  void OnRead(bool ok) override {
    const std::lock_guard lock(mutex_);
    if (ended_ || half_closed_) return;
    if (ok) {
      writing_ = true;
      this->StartWrite(&request_);
    } else {
      HalfClose();
    }
  }

  // The client has taken a response.
  void OnWritten(bool ok) override {
    const std::lock_guard lock(mutex_);
    if (!ok) passage_.context->TryCancel();
    this->StartRead(&response_);
  }

  void OnCancelled() override {
    const std::lock_guard lock(mutex_);
    if (reactor_ != nullptr) passage_.context->TryCancel();
  }

  // Lets the owner send the last estimate of a stream of measurements.
  void Drain() override {
    const std::lock_guard lock(mutex_);
    draining_ = true;
    if (ended_ || reactor_ == nullptr) return;
    if (!kReads) {
      passage_.context->TryCancel();
    } else if (!writing_) {
      HalfClose();
    }
  }

  // The owner has taken a request.
  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (!ok || ended_ || half_closed_) return;
    if (draining_) return HalfClose();
    ReadNext();
  }

  // The owner has sent a response, or has no more.
  void OnReadDone(bool ok) override {
    {
      const std::lock_guard lock(mutex_);
      if (ok) {
        reactor_->StartWrite(&response_);
        return;
      }
      ended_ = true;
    }
    this->RemoveHold();
  }

  void OnDone(const grpc::Status& outcome) override {
    const std::shared_ptr<StreamRelay> self = std::move(self_);
    const std::lock_guard lock(mutex_);
    PassOnTrailers(*passage_.context, call_);
    const bool cut = draining_ && (outcome.ok() || !kReads);
    std::exchange(reactor_, nullptr)
        ->Finish(cut ? ToGrpc(ShuttingDown())
                     : OutcomeFrom(passage_.owner, *passage_.context, outcome));
  }

 private:
  static constexpr bool kReads = requires(Reactor & reactor, Request& request) {
    reactor.StartRead(&request);
  };

  StreamRelay(NodeForwarder::Passage passage, grpc::CallbackServerContext& call, Reactor* reactor,
              Request first)
      : passage_(std::move(passage)),
        stub_(passage_.channel),
        call_(call),
        reactor_(reactor),
        request_(std::move(first)) {}

  void Begin(const std::string& path, std::shared_ptr<StreamRelay> self) {
    const std::lock_guard lock(mutex_);
    self_ = std::move(self);
    stub_.PrepareBidiStreamingCall(passage_.context.get(), path, grpc::StubOptions(), this);
    // Operations are started from the client's side, too, until the owner has no more responses.
    this->AddHold();
    writing_ = true;
    if (kReads) {
      this->StartWrite(&request_);
    } else {
      half_closed_ = true;
      this->StartWriteLast(&request_, grpc::WriteOptions());
    }
    this->StartRead(&response_);
    this->StartCall();
  }

  // The following are called with the mutex held.

  void ReadNext() {
    if constexpr (kReads) {
      reactor_->StartRead(&request_);
    }
  }

  void HalfClose() {
    if (std::exchange(half_closed_, true)) return;
    this->StartWritesDone();
  }

  const NodeForwarder::Passage passage_;
  grpc::TemplatedGenericStub<Request, Response> stub_;
  grpc::CallbackServerContext& call_;
  std::shared_ptr<StreamRelay> self_;  // until the owner's call has ended

  std::mutex mutex_;
  Reactor* reactor_;  // null when it is finished
  Request request_;   // belongs to gRPC while it is read from the client or written to the owner
  Response response_;
  bool writing_ = false;  // a request, to the owner
  bool half_closed_ = false;
  bool draining_ = false;
  bool ended_ = false;  // whether the owner sends no more responses
};

}  // namespace polyest::internal
