#include "server/service/record_flow.h"

#include <gtest/gtest.h>

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

class Reactor final : public grpc::ServerWriteReactor<Record> {
 public:
  void OnDone() override {}
};

// Plays gRPC's side of the call.
class Writer final : public grpc::ServerCallbackWriter<Record> {
 public:
  explicit Writer(Reactor& reactor) : reactor_(reactor) { BindReactor(&reactor); }

  void Finish(grpc::Status status) override { finished.set_value(status); }
  void SendInitialMetadata() override {}
  void Write(const Record*, grpc::WriteOptions) override {}
  void WriteAndFinish(const Record*, grpc::WriteOptions, grpc::Status) override {}

  std::promise<grpc::Status> finished;

 private:
  grpc::internal::ServerReactor* reactor() override { return &reactor_; }
  void CallOnDone() override {}

  Reactor& reactor_;
};

TEST(RecordFlow, EndsTheCallThatLacksMemoryForItsRecords) {
  Reactor reactor;
  Writer writer(reactor);
  Executor executor({.threads_per_lane = 1, .threads = 1, .capacity = 1, .capacity_per_lane = 1});
  const auto flow = std::make_shared<RecordFlow<Record>>(executor);
  flow->OnStart(&reactor, "t", [](const Stop&) -> absl::StatusOr<std::vector<Record>> {
    return std::vector<Record>(1);
  });
  EXPECT_EQ(writer.finished.get_future().get().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  flow->OnDone();
}

}  // namespace
}  // namespace polyest::internal
