#include "server/service/record_flow.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <new>

namespace polyest::internal {
namespace {

// A record that cannot be moved for lack of memory.
struct Record {
  Record() = default;
  Record(const Record&) { throw std::bad_alloc(); }
  Record& operator=(const Record&) { throw std::bad_alloc(); }
};

template <typename Record>
class Reactor final : public grpc::ServerWriteReactor<Record> {
 public:
  void OnDone() override {}
};

// Plays gRPC's side of the call.
template <typename Record>
class Writer final : public grpc::ServerCallbackWriter<Record> {
 public:
  explicit Writer(Reactor<Record>& reactor) : reactor_(reactor) { this->BindReactor(&reactor); }

  void Finish(grpc::Status status) override { finished.set_value(status); }
  void SendInitialMetadata() override {}
  void Write(const Record*, grpc::WriteOptions) override { written.set_value(); }
  void WriteAndFinish(const Record*, grpc::WriteOptions, grpc::Status) override {}

  std::promise<void> written;  // set once
  std::promise<grpc::Status> finished;

 private:
  grpc::internal::ServerReactor* reactor() override { return &reactor_; }
  void CallOnDone() override {}

  Reactor<Record>& reactor_;
};

TEST(RecordFlow, GoesOnWhileTheQueueRefusesNewCalls) {
  Reactor<int> reactor;
  Writer<int> writer(reactor);
  StreamMemory memory;
  Executor executor({.threads_per_lane = 1, .threads = 1, .capacity = 1, .capacity_per_lane = 1});
  const auto flow = std::make_shared<RecordFlow<int>>(executor, memory);
  flow->OnStart(&reactor, "t", [left = 1](const Stop&) mutable -> absl::StatusOr<std::vector<int>> {
    return std::vector<int>(static_cast<size_t>(left-- > 0 ? 1 : 0));
  });
  writer.written.get_future().get();
  ASSERT_TRUE(executor.AwaitIdle(std::chrono::steady_clock::time_point::max()));
  std::promise<void> free;
  ASSERT_TRUE(executor.Submit("t", [&] { free.get_future().wait(); }).ok());
  const auto late = std::make_shared<RecordFlow<int>>(executor, memory);
  Reactor<int> late_reactor;
  Writer<int> late_writer(late_reactor);
  late->OnStart(&late_reactor, "t",
                [](const Stop&) -> absl::StatusOr<std::vector<int>> { return std::vector<int>(); });
  EXPECT_EQ(late_writer.finished.get_future().get().error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  flow->OnWritten(true);
  free.set_value();
  const grpc::Status finished = writer.finished.get_future().get();
  EXPECT_TRUE(finished.ok()) << finished.error_message();
  flow->OnDone();
  late->OnDone();
}

TEST(RecordFlow, EndsTheCallThatLacksMemoryForItsRecords) {
  Reactor<Record> reactor;
  Writer<Record> writer(reactor);
  StreamMemory memory;
  Executor executor({.threads_per_lane = 1, .threads = 1, .capacity = 1, .capacity_per_lane = 1});
  const auto flow = std::make_shared<RecordFlow<Record>>(executor, memory);
  flow->OnStart(&reactor, "t", [](const Stop&) -> absl::StatusOr<std::vector<Record>> {
    return std::vector<Record>(1);
  });
  EXPECT_EQ(writer.finished.get_future().get().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  flow->OnDone();
}

TEST(RecordFlow, ReadsNothingMoreWhileTheTenantsStreamsHoldTooMuch) {
  StreamMemory memory({.tenant = 2 * sizeof(int), .all = 100});
  Executor executor({.threads_per_lane = 1, .threads = 1, .capacity = 9, .capacity_per_lane = 9});
  const auto two = [](const Stop&) -> absl::StatusOr<std::vector<int>> {
    return std::vector<int>(2);
  };
  Reactor<int> slow, late, other;
  Writer<int> slow_writer(slow), late_writer(late), other_writer(other);
  const auto slow_flow = std::make_shared<RecordFlow<int>>(executor, memory);
  slow_flow->OnStart(&slow, "t", two);
  slow_writer.written.get_future().get();
  const auto late_flow = std::make_shared<RecordFlow<int>>(executor, memory);
  late_flow->OnStart(&late, "t", two);
  EXPECT_EQ(late_writer.finished.get_future().get().error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  const auto other_flow = std::make_shared<RecordFlow<int>>(executor, memory);
  other_flow->OnStart(&other, "u", two);
  other_writer.written.get_future().get();  // another tenant's
  // What is dropped or has been read is held no more.
  slow_flow->OnCancelled();
  slow_flow->OnWritten(true);
  EXPECT_TRUE(StreamMemory::Share(memory, "t").HasRoom());
  other_flow->OnCancelled();
  other_flow->OnWritten(false);
  for (const auto& flow : {slow_flow, late_flow, other_flow}) flow->OnDone();
}

}  // namespace
}  // namespace polyest::internal
