#pragma once

// Sends records to a client as fast as it takes them: those that a function returns, piece by
// piece. What the client has not read is weighed (StreamMemory); while the streams of its tenant
// hold too much, no further piece is read, and the call ends RESOURCE_EXHAUSTED.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/message_lite.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "polyest/stop.h"
#include "server/execution/executor.h"
#include "server/execution/guarded.h"
#include "server/service/open_calls.h"
#include "server/service/status_mapping.h"
#include "server/service/stream_memory.h"
#include "server/service/stream_relay.h"

namespace polyest::internal {

// Holds the state of one call. It outlives its reactor, because the executor may still hold it.
template <typename Record>
class RecordFlow final : public Drainable, public std::enable_shared_from_this<RecordFlow<Record>> {
 public:
  using Reactor = grpc::ServerWriteReactor<Record>;
  // Returns the next records; none at the end. Runs on the executor, once at a time.
  using Next = std::function<absl::StatusOr<std::vector<Record>>(const Stop&)>;

  // Passes the call on to another daemon if the first records are refused because they are that
  // one's; returns null if they are not.
  using PassOn = std::function<std::shared_ptr<PassedOnStream>(Reactor*, const absl::Status&)>;

  RecordFlow(Executor& executor, StreamMemory& memory, PassOn pass_on = nullptr)
      : executor_(executor), memory_(memory), pass_on_(std::move(pass_on)) {}

  // Begins to send what `next` returns, in the lane of the tenant's calls, or ends the call at
  // once.
  void OnStart(Reactor* reactor, const std::string& tenant, absl::StatusOr<Next> next) {
    const std::lock_guard lock(mutex_);
    reactor_ = reactor;
    lane_ = absl::StrCat(tenant, "/calls");
    held_.emplace(memory_, tenant);
    absl::Status begun = next.status();
    if (begun.ok()) {
      next_ = *std::move(next);
      begun = StartReading(Admission::kIfRoom);
    }
    if (!begun.ok()) End(begun);
    Advance();
  }

  void OnWritten(bool ok) {
    const std::lock_guard lock(mutex_);
    if (passed_on_ != nullptr) return passed_on_->OnWritten(ok);
    writing_ = false;
    held_->Add(-records_.front().bytes);
    records_.pop_front();
    if (!ok) End(absl::CancelledError("the client does not read any more"));
    Advance();
  }

  void OnCancelled() {
    const std::lock_guard lock(mutex_);
    if (passed_on_ != nullptr) return passed_on_->OnCancelled();
    End(absl::CancelledError("the call was cancelled"));
    Advance();
  }

  void OnDone() {
    const std::lock_guard lock(mutex_);
    reactor_ = nullptr;
  }

  void Drain() override {
    const std::lock_guard lock(mutex_);
    if (passed_on_ != nullptr) return passed_on_->Drain();
    End(ShuttingDown());
    Advance();
  }

 private:
  // A record that waits to be written, and its weight.
  struct Waiting {
    Record record;
    int64_t bytes = 0;
  };

  // A record waits as a message and, while it is being written, serialized.
  static int64_t BytesOf(const Record& record) {
    if constexpr (std::is_base_of_v<google::protobuf::MessageLite, Record>) {
      return 2 * static_cast<int64_t>(record.ByteSizeLong());
    }
    return sizeof(record);
  }

  // The following are called with the mutex held.

  // Begins to read the next records; none wait.
  absl::Status StartReading(Admission admission) {
    POLYEST_RETURN_IF_ERROR(held_->CheckRoom());
    reading_ = true;
    const absl::Status accepted = executor_.Submit(
        lane_, [flow = this->shared_from_this()] { flow->Read(); }, admission);
    if (!accepted.ok()) reading_ = false;
    return accepted;
  }

  // Sets how the call ends. After an error, records that wait are dropped; the one being written
  // belongs to gRPC until OnWritten. An end in good order writes the rest first.
  void End(const absl::Status& status) {
    if (!end_) end_ = status;
    if (status.ok()) return;
    stop_.request_stop();
    while (records_.size() > (writing_ ? 1 : 0)) {
      held_->Add(-records_.back().bytes);
      records_.pop_back();
    }
  }

  void Advance() {
    if (finished_ || reactor_ == nullptr || writing_ || reading_) return;
    if (!records_.empty()) {
      writing_ = true;
      reactor_->StartWrite(&records_.front().record);
      return;
    }
    if (!end_) {
      // A full queue refuses new calls, not those that have begun: each has one task at a time.
      const absl::Status accepted = StartReading(Admission::kAlways);
      if (accepted.ok()) return;
      End(accepted);
    }
    finished_ = true;
    next_ = nullptr;
    reactor_->Finish(ToGrpc(*end_));
  }

  // Reads the next records; runs on the executor, without the mutex.
  void Read() {
    absl::StatusOr<std::vector<Record>> next;
    const absl::Status read = Guarded([&] {
      next = next_(Stop(stop_.get_token()));
      return next.status();
    });
    const std::lock_guard lock(mutex_);
    reading_ = false;
    const PassOn pass_on = std::exchange(pass_on_, nullptr);
    if (!read.ok() && !end_ && pass_on != nullptr) {
      passed_on_ = pass_on(reactor_, read);
      finished_ = passed_on_ != nullptr;
      if (finished_) return;
    }
    if (!read.ok()) {
      End(read);
    } else if (next->empty()) {
      End(absl::OkStatus());
    } else if (!end_) {
      const absl::Status taken = Guarded([&] {
        for (Record& record : *next) {
          const int64_t bytes = BytesOf(record);
          records_.push_back({std::move(record), bytes});
          held_->Add(bytes);
        }
        return absl::OkStatus();
      });
      if (!taken.ok()) End(taken);
    }
    Advance();
  }

  Executor& executor_;
  StreamMemory& memory_;
  std::string lane_;
  Next next_;
  std::stop_source stop_;

  std::mutex mutex_;
  Reactor* reactor_ = nullptr;
  PassOn pass_on_;                             // until the first records have been read
  std::shared_ptr<PassedOnStream> passed_on_;  // set if another daemon has the records
  std::deque<Waiting> records_;                // the first one is being written or is the next
  std::optional<StreamMemory::Share> held_;    // by records_; set from the start
  bool reading_ = false;
  bool writing_ = false;
  bool finished_ = false;
  std::optional<absl::Status> end_;  // how the call ends, once no more records are read
};

}  // namespace polyest::internal
