// Tests sessions whose channels may arrive out of order, against a daemon.

#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

constexpr double kReorderWindow_s = 0.6;

// Returns the oscillator with a second output.
v1::Problem TwoOutputs() {
  v1::Problem problem = Oscillator();
  *problem.add_measured() = problem.measured(0);
  problem.mutable_measured(1)->set_output("v");
  return problem;
}

// Returns rows [first, last) with both outputs, as OscillatorRows does; v ripples around 0.
v1::Measurements BothOutputs(int first, int last) {
  v1::Measurements rows = OscillatorRows(first, last);
  auto& v = *rows.add_channels();
  v.set_name("v");
  for (int row = first; row < last; ++row) v.add_values(0.01 * std::cos(12.9898 * row));
  return rows;
}

v1::Measurements Only(int channel, v1::Measurements rows) {
  const v1::Measurements::Channel kept = rows.channels(channel);
  rows.clear_channels();
  *rows.add_channels() = kept;
  return rows;
}

class ReorderingTest : public DaemonTest {
 protected:
  grpc::Status CreateWithWindow(const std::string& id, double window_s,
                                v1::Session* session = nullptr) {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    request.set_session_id(id);
    *request.mutable_session()->mutable_problem() = TwoOutputs();
    request.mutable_session()->set_reorder_window_s(window_s);
    v1::Session created;
    const grpc::Status status = sessions_->CreateSession(&context, request, &created);
    if (session != nullptr) *session = created;
    return status;
  }
  // Fills one session in time order, and another with v half a second before x.
  void Fill() {
    ASSERT_TRUE(CreateWithWindow("ordered", 0).ok());
    ASSERT_TRUE(CreateWithWindow("reordering", kReorderWindow_s).ok());
    int64_t batch = 0;
    for (int row = 0; row < 40; row += 10) {
      const v1::Measurements rows = BothOutputs(row, row + 10);
      ASSERT_TRUE(Add("sessions/ordered", row / 10 + 1, rows).ok());
      for (const int channel : {1, 0}) {
        const grpc::Status added = Add("sessions/reordering", ++batch, Only(channel, rows));
        ASSERT_TRUE(added.ok()) << added.error_message();
      }
    }
    v1::Measurements end;
    end.set_end_of_run(true);
    ASSERT_TRUE(Add("sessions/ordered", 5, end).ok());
    ASSERT_TRUE(Add("sessions/reordering", 9, end).ok());
  }
  // Returns the estimate from all rows, without the number of the batch.
  std::string OfAllRows(const std::string& session) {
    const v1::Estimate estimate = EstimateOf(session);
    EXPECT_EQ(estimate.samples(), 80);
    return WithoutSequence(estimate);
  }
};

TEST_F(ReorderingTest, EstimatesAndStudiesAreThoseOfTheRecordInOrder) {
  Fill();
  EXPECT_EQ(OfAllRows("sessions/reordering"), OfAllRows("sessions/ordered"));
  std::vector<v1::ComputeCostGridResponse> grids(2);
  for (const size_t i : {0u, 1u}) {
    grpc::ClientContext context;
    v1::ComputeCostGridRequest request;
    request.set_point_count(4);
    request.mutable_subject()->set_session(i == 0 ? "sessions/ordered" : "sessions/reordering");
    const grpc::Status status = studies_->ComputeCostGrid(&context, request, &grids[i]);
    ASSERT_TRUE(status.ok()) << status.error_message();
    grids[i].clear_sequence();
  }
  EXPECT_EQ(grids[0].SerializeAsString(), grids[1].SerializeAsString());
}

TEST_F(ReorderingTest, KeepsTheWindowInItsExport) {
  Fill();
  grpc::ClientContext exporting, importing, getting;
  v1::ExportSessionRequest request;
  request.set_name("sessions/reordering");
  const auto reader = sessions_->ExportSession(&exporting, request);
  v1::Session imported;
  const auto writer = sessions_->ImportSession(&importing, &imported);
  v1::ImportSessionRequest piece;
  piece.set_session_id("copy");
  while (reader->Read(piece.mutable_record())) ASSERT_TRUE(writer->Write(piece));
  ASSERT_TRUE(reader->Finish().ok());
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(imported.reorder_window_s(), kReorderWindow_s);
  EXPECT_EQ(OfAllRows("sessions/copy"), OfAllRows("sessions/reordering"));
}

TEST_F(ReorderingTest, ShowsTheWindowAndRefusesOneOutOfItsRange) {
  v1::Session session;
  ASSERT_TRUE(CreateWithWindow("rig", 2.5, &session).ok());
  EXPECT_EQ(session.reorder_window_s(), 2.5);
  const grpc::Status refused = CreateWithWindow("other", -1);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(refused.error_message(),
            "session.reorderWindowS: -1 must be from 0 to 3600 s; 0 means that rows come in time "
            "order");
}

TEST_F(ReorderingTest, RefusesWhatComesLaterThanTheWindow) {
  ASSERT_TRUE(CreateWithWindow("rig", kReorderWindow_s).ok());
  ASSERT_TRUE(Add("sessions/rig", 1, Only(0, BothOutputs(0, 40))).ok());
  const grpc::Status late = Add("sessions/rig", 2, Only(1, BothOutputs(20, 40)));
  EXPECT_EQ(late.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(late.error_message(), HasSubstr("row 0 (counted from 0), column v: t = 1.05"));
  const grpc::Status again = Add("sessions/rig", 2, Only(1, BothOutputs(30, 40)));
  EXPECT_TRUE(again.ok()) << again.error_message();
}

}  // namespace
}  // namespace polyest::internal
