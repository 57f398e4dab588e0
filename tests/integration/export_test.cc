#include <google/protobuf/util/message_differencer.h>

#include <functional>

#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

class ExportTest : public DaemonTest {
 protected:
  explicit ExportTest(std::vector<std::string> arguments = {}) : DaemonTest(std::move(arguments)) {}
  grpc::Status Export(const std::string& name, std::vector<v1::SessionRecord>& records) {
    grpc::ClientContext context;
    v1::ExportSessionRequest request;
    request.set_name(name);
    const auto reader = sessions_->ExportSession(&context, request);
    v1::SessionRecord record;
    while (reader->Read(&record)) records.push_back(record);
    return reader->Finish();
  }
  grpc::Status Import(const std::string& id, const std::vector<v1::SessionRecord>& records,
                      v1::Session* session = nullptr) {
    grpc::ClientContext context;
    v1::Session imported;
    const auto writer = sessions_->ImportSession(&context, &imported);
    v1::ImportSessionRequest request;
    request.set_session_id(id);
    for (const v1::SessionRecord& record : records) {
      *request.mutable_record() = record;
      if (!writer->Write(request)) break;
    }
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    if (session != nullptr) *session = imported;
    return status;
  }
  v1::EstimateHistory History(const std::string& session) {
    grpc::ClientContext context;
    v1::GetHistoryRequest request;
    request.set_session(session);
    v1::GetHistoryResponse response;
    const grpc::Status status = sessions_->GetHistory(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.history();
  }
  // Returns an exported session of three batches.
  std::vector<v1::SessionRecord> Exported() {
    EXPECT_TRUE(Create("rig").ok());
    for (const int batch : {1, 2, 3}) {
      EXPECT_TRUE(Add("sessions/rig", batch, OscillatorRows(10 * (batch - 1), 10 * batch)).ok());
      // Past estimates are kept with the commit of the next batch, or later.
      EstimateOf("sessions/rig");
    }
    std::vector<v1::SessionRecord> records;
    const grpc::Status status = Export("sessions/rig", records);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return records;
  }
};

TEST_F(ExportTest, BringsASessionBackToTheSameBits) {
  const auto records = Exported();
  ASSERT_GE(records.size(), 4u);
  EXPECT_EQ(records[0].head().batch_count(), 3);
  v1::Problem problem;
  ASSERT_TRUE(problem.ParseFromString(records[0].head().problem()));
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(problem, Oscillator()));
  EXPECT_EQ(records[3].batch().sequence(), 3);
  v1::Session imported;
  const grpc::Status status = Import("copy", records, &imported);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(imported.name(), "sessions/copy");
  EXPECT_EQ(imported.last_sequence(), 3);
  EXPECT_EQ(imported.sample_count(), 30);
  EXPECT_EQ(WithoutSequence(EstimateOf("sessions/copy")),
            WithoutSequence(EstimateOf("sessions/rig")));
  // The copy continues as the first session would.
  EXPECT_TRUE(Add("sessions/copy", 4, OscillatorRows(30, 40)).ok());
  EXPECT_TRUE(Add("sessions/copy", 2, OscillatorRows(10, 20)).ok());
}

TEST_F(ExportTest, GivesAnImportTheNameThatItHadUnlessThatIsTaken) {
  const auto records = Exported();
  EXPECT_EQ(Import("", records).error_code(), grpc::StatusCode::ALREADY_EXISTS);
  ASSERT_TRUE(Delete("sessions/rig").ok());
  EXPECT_TRUE(Import("", records).ok());
  EXPECT_EQ(EstimateOf("sessions/rig").samples(), 30);
}

TEST_F(ExportTest, KeepsNothingOfAnImportThatIsNoGood) {
  const auto records = Exported();
  struct Case {
    std::string what;
    std::vector<v1::SessionRecord> records;
    std::string message;
  };
  std::vector<v1::SessionRecord> twice_ended = records;
  twice_ended.push_back(records.back());
  v1::SessionRecord bad = records[2];
  bad.mutable_batch()->mutable_measurements()->set_time_s(0, 0);
  for (const Case& one : {
           Case{"nothing", {}, "breaks off after batch 0 of 0"},
           Case{"no head", {records[1]}, "the first must be a session's head"},
           Case{"two heads", {records[0], records[0]}, "there is one already"},
           Case{"a batch too few", {records[0], records[1], records[2]}, "after batch 2 of 3"},
           Case{"a gap", {records[0], records[1], records[3]}, "3 must be 2"},
           Case{"a batch too many",
                {records[0], records[1], records[2], records[3], records[3]},
                "3 must be 4, and the head promises 3 batches"},
           Case{"a bad batch", {records[0], records[1], bad}, "times must increase"},
           Case{"no end", {records.begin(), records.end() - 1}, "breaks off before its end"},
           Case{"an early end", {records[0], records[1], records.back()}, "after batch 1 of 3"},
           Case{"nothing but the end", {records.back()}, "after batch 0 of 0"},
           Case{"more after the end", twice_ended, "must not follow the end"},
           Case{"an empty record",
                {v1::SessionRecord()},
                "must be a head, a batch, a past estimate or the end"},
       }) {
    const grpc::Status status = Import("copy", one.records);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << one.what;
    EXPECT_THAT(status.error_message(), HasSubstr(one.message)) << one.what;
    EXPECT_EQ(Delete("sessions/copy").error_code(), grpc::StatusCode::NOT_FOUND) << one.what;
  }
  EXPECT_TRUE(Import("copy", records).ok());
}

TEST_F(ExportTest, BringsTheHistoryAlong) {
  const auto records = Exported();
  ASSERT_GE(records.size(), 7u);  // the head, three batches, two past estimates, the end
  ASSERT_TRUE(Import("copy", records).ok());
  const v1::EstimateHistory was = History("sessions/rig"), is = History("sessions/copy");
  ASSERT_GE(is.points_size(), 2);
  ASSERT_LE(is.points_size(), was.points_size());
  for (int i = 0; i < is.points_size(); ++i) {
    EXPECT_EQ(is.points(i).SerializeAsString(), was.points(i).SerializeAsString());
  }
  // It goes on.
  ASSERT_TRUE(Add("sessions/copy", 4, OscillatorRows(30, 40)).ok());
  EXPECT_EQ(EstimateOf("sessions/copy").samples(), 40);
  EXPECT_EQ(History("sessions/copy").points().rbegin()->sequence(), 4);
}

TEST_F(ExportTest, RefusesAHistoryThatIsNone) {
  auto records = Exported();
  ASSERT_GE(records.size(), 7u);
  const auto refusal = [&](const std::function<void(v1::SessionRecord::PastEstimate&)>& change) {
    std::vector<v1::SessionRecord> changed = records;
    change(*changed[5].mutable_past_estimate());
    const grpc::Status status = Import("copy", changed);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    return status.error_message();
  };
  EXPECT_THAT(refusal([](auto& past) { past.set_ordinal(0); }), HasSubstr("greater than that"));
  EXPECT_THAT(refusal([](auto& past) { past.set_ordinal(int64_t{1} << 60); }),
              HasSubstr("pastEstimate.ordinal"));
  EXPECT_THAT(refusal([](auto& past) { past.mutable_estimate()->set_sequence(4); }),
              HasSubstr("4 must be greater than that before and at most 3"));
  EXPECT_THAT(refusal([](auto& past) {
                past.mutable_estimate()->add_parameters()->set_name(std::string(70'000, 'k'));
              }),
              HasSubstr("bytes are more than there may be, 65536"));
  std::swap(records[3], records[4]);
  EXPECT_THAT(Import("copy", records).error_message(),
              HasSubstr("must follow the head and all batches"));
}

class FewRowsTest : public ExportTest {
 protected:
  FewRowsTest() : ExportTest({"--max-session-rows", "30"}) {}
};

TEST_F(FewRowsTest, AreTheLimitOfAnImportToo) {
  auto records = Exported();
  ASSERT_GE(records.size(), 4u);
  records.resize(4);  // without past estimates
  records[0].mutable_head()->set_batch_count(4);
  v1::SessionRecord::Batch& more = *records.emplace_back().mutable_batch();
  more.set_sequence(4);
  *more.mutable_measurements() = OscillatorRows(30, 31);
  const grpc::Status status = Import("copy", records);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("(--max-session-rows)"));
}

TEST_F(ExportTest, NamesASessionThatIsNotThere) {
  std::vector<v1::SessionRecord> none;
  EXPECT_EQ(Export("sessions/none", none).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(Export("none", none).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(none.empty());
}

}  // namespace
}  // namespace polyest::internal
