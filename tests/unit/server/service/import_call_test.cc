#include "server/service/import_call.h"

#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <semaphore>
#include <utility>

#include "server/digest/digest.h"
#include "server/service/export_call.h"
#include "server/sessions/session_import.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/test_folder.h"
#include "tests/unit/server/service/service_fixture.h"

namespace polyest::internal {
namespace {

// Plays gRPC's side of an import.
class Reader final : public grpc::ServerCallbackReader<v1::ImportSessionRequest> {
 public:
  using OnFinish = std::function<void(const grpc::Status&)>;

  // `on_finish` may be called at once, by another thread.
  Reader(ImportCall& call, OnFinish on_finish) : call_(call), on_finish_(std::move(on_finish)) {
    BindReactor(&call);
  }

  // Gives the import a record that it has asked for.
  void GiveNow(const v1::SessionRecord& record) {
    *request_->mutable_record() = record;
    call_.OnReadDone(true);
  }
  // Waits until the import asks for a record, and gives it this one.
  void Give(const v1::SessionRecord& record) {
    asked_.acquire();
    GiveNow(record);
  }
  // Waits until the import asks for a record, which it is not given.
  void Await() { asked_.acquire(); }
  // Waits until the import asks for a record, and ends the stream.
  void End() {
    asked_.acquire();
    call_.OnReadDone(false);
  }
  void SendInitialMetadata() override {}
  void Read(v1::ImportSessionRequest* request) override {
    request_ = request;
    asked_.release();
  }
  void Finish(grpc::Status status) override { on_finish_(status); }

 private:
  grpc::internal::ServerReactor* reactor() override { return &call_; }
  void CallOnDone() override {}

  ImportCall& call_;
  const OnFinish on_finish_;
  v1::ImportSessionRequest* request_ = nullptr;
  std::binary_semaphore asked_{0};
};

class ImportCallTest : public ServiceTest {
 protected:
  v1::SessionRecord Head() {
    v1::SessionRecord record;
    record.mutable_head()->set_name("sessions/a");
    record.mutable_head()->set_problem(DeterministicBytes(SmallProblem()));
    record.mutable_head()->set_batch_count(2);
    return record;
  }
  v1::SessionRecord Batch() {
    v1::SessionRecord record;
    record.mutable_batch()->set_sequence(1);
    v1::Measurements& rows = *record.mutable_batch()->mutable_measurements();
    rows.add_time_s(0.1);
    rows.add_channels()->set_name("x");
    rows.mutable_channels(0)->add_values(0.1);
    return record;
  }
  // Tells the code of the call's end, before which the session must be gone.
  Reader::OnFinish TellAfterSessionIsGone(std::promise<grpc::StatusCode>& finished) {
    return [this, &finished](const grpc::Status& status) {
      EXPECT_TRUE(absl::IsNotFound(journal_.ReadProblem(1).status()));
      finished.set_value(status.error_code());
    };
  }

  grpc::CallbackServerContext call_;
  v1::Session imported_;
};

TEST_F(ImportCallTest, KeepsNothingWhenItIsCancelledWhileARecordIsTaken) {
  ServiceContext context = Context();
  auto* const import = new ImportCall(context, call_, &imported_);
  std::promise<grpc::StatusCode> finished;
  Reader reader(*import, TellAfterSessionIsGone(finished));
  reader.Give(Head());
  journal_.Hold();
  reader.Give(Batch());
  EXPECT_TRUE(journal_.ReadProblem(1).ok());
  import->OnCancel();
  journal_.Release();
  EXPECT_EQ(finished.get_future().get(), grpc::StatusCode::CANCELLED);
  import->OnDone();
}

TEST_F(ImportCallTest, KeepsNothingWhenItIsCancelledBetweenTwoRecords) {
  ServiceContext context = Context();
  auto* const import = new ImportCall(context, call_, &imported_);
  std::promise<grpc::StatusCode> finished;
  Reader reader(*import, TellAfterSessionIsGone(finished));
  reader.Give(Head());
  reader.Await();
  std::promise<void> free;
  EXPECT_TRUE(executor_.Submit("busy", [&] { free.get_future().wait(); }).ok());
  import->OnCancel();
  // The thread that cancels does not wait for the journal.
  EXPECT_TRUE(journal_.ReadProblem(1).ok());
  free.set_value();
  EXPECT_EQ(finished.get_future().get(), grpc::StatusCode::CANCELLED);
  import->OnDone();
}

TEST_F(ImportCallTest, GoesOnWhileTheQueueRefusesNewCalls) {
  ServiceContext context = Context();
  auto* const import = new ImportCall(context, call_, &imported_);
  std::promise<grpc::Status> finished;
  Reader reader(*import, [&](const grpc::Status& status) { finished.set_value(status); });
  v1::SessionRecord head = Head();
  head.mutable_head()->set_batch_count(1);
  reader.Give(head);
  reader.Await();
  std::promise<void> free;
  auto wait = [freed = free.get_future().share()] { freed.wait(); };
  while (executor_.Submit("busy", wait).ok()) {
  }
  v1::SessionRecord end;
  end.mutable_end();
  reader.GiveNow(Batch());
  free.set_value();
  reader.Give(end);
  reader.End();
  const grpc::Status status = finished.get_future().get();
  EXPECT_TRUE(status.ok()) << status.error_message();
  import->OnDone();
}

// gRPC may report the end of a stream that was cancelled before it reports that it was cancelled.
TEST_F(ImportCallTest, KeepsNothingOfAStreamThatEndsAfterTheLastBatchWithoutItsEnd) {
  ServiceContext context = Context();
  auto* const import = new ImportCall(context, call_, &imported_);
  std::promise<grpc::Status> finished;
  Reader reader(*import, [&](const grpc::Status& status) { finished.set_value(status); });
  v1::SessionRecord head = Head();
  head.mutable_head()->set_batch_count(1);
  reader.Give(head);
  reader.Give(Batch());
  reader.End();
  const grpc::Status status = finished.get_future().get();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "record: the session breaks off before its end");
  EXPECT_TRUE(absl::IsNotFound(journal_.ReadProblem(1).status()));
  import->OnDone();
}

TEST_F(ImportCallTest, RefusesATimeThatNoListCouldShow) {
  for (const auto& [seconds, nanos] : {std::pair<int64_t, int32_t>{1'000'000'000'000'000, 0},
                                       {-62'135'596'801, 0},
                                       {0, 1'000'000'000},
                                       {0, -1}}) {
    v1::ImportSessionRequest request;
    *request.mutable_record() = Head();
    v1::SessionRecord::Head& head = *request.mutable_record()->mutable_head();
    head.mutable_create_time()->set_seconds(seconds);
    head.mutable_create_time()->set_nanos(nanos);
    const absl::Status refused = SessionImport(*sessions_, "t").Take(request, {});
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(refused.message().find("record.head.createTime: "), 0u) << refused;
  }
}

TEST_F(ImportCallTest, EndsWhereNothingComes) {
  ServiceContext context = Context();
  context.first_message = std::chrono::milliseconds(0);
  auto* const import = new ImportCall(context, call_, &imported_);
  std::promise<grpc::StatusCode> finished;
  Reader reader(*import,
                [&](const grpc::Status& status) { finished.set_value(status.error_code()); });
  EXPECT_EQ(finished.get_future().get(), grpc::StatusCode::DEADLINE_EXCEEDED);
  import->OnDone();
  EXPECT_EQ(calls_.Count(OpenCalls::Kind::kWriter), 0);
}

TEST_F(ImportCallTest, OccupiesNothingForAStranger) {
  const TestFolder folder;
  const NewToken token = *MakeTokenFor("anna:chassis:admin");
  ServiceContext context = Context(folder.Write("tokens", token.line + "\n"));
  auto* const import = new ImportCall(context, call_, &imported_);
  v1::ExportSessionRequest request;
  request.set_name("sessions/a");
  auto* const exported = new ExportCall(context, call_, request);
  EXPECT_EQ(calls_.Count(OpenCalls::Kind::kWriter), 0);
  EXPECT_EQ(calls_.Count(OpenCalls::Kind::kWatcher), 0);
  import->OnDone();
  exported->OnDone();
}

}  // namespace
}  // namespace polyest::internal
