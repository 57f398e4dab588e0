#include "server/sessions/batch_intake.h"

#include <gtest/gtest.h>

#include <new>

#include "server/sessions/loaded_session.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

v1::Measurements Row(double time_s) {
  v1::Measurements batch;
  batch.add_time_s(time_s);
  v1::Measurements::Channel& x = *batch.add_channels();
  x.set_name("x");
  x.add_values(0.1);
  return batch;
}

class BatchIntakeTest : public testing::Test {
 protected:
  void ExpectUntouched() {
    EXPECT_EQ(intake_.place().sequence, 1);
    EXPECT_EQ(intake_.place().rows, 1);
    EXPECT_EQ(intake_.measured_s(), 0);
  }

  ModelLibrary models_;
  const std::unique_ptr<LoadedSession> loaded_ =
      LoadedSession::Make(SmallProblem(), /*reorder_window_s=*/0, {models_}).value();
  BatchIntake& intake_ = loaded_->intake();
};

TEST_F(BatchIntakeTest, TakesOnlyWhatCanBeRecorded) {
  ASSERT_TRUE(intake_.Take(Row(0.1)).ok());
  const auto refuse = [](const SessionPlace&) { return absl::ResourceExhaustedError("full"); };
  EXPECT_EQ(intake_.Take(Row(0.2), {}, refuse), absl::ResourceExhaustedError("full"));
  ExpectUntouched();
  const auto lack_memory = [](const SessionPlace&) -> absl::Status { throw std::bad_alloc(); };
  EXPECT_THROW(intake_.Take(Row(0.2), {}, lack_memory).IgnoreError(), std::bad_alloc);
  ExpectUntouched();
  SessionPlace recorded;
  const auto record = [&](const SessionPlace& place) {
    recorded = place;
    return absl::OkStatus();
  };
  // The intake did not take the batch, so that it can come again.
  ASSERT_TRUE(intake_.Take(Row(0.2), {}, record).ok());
  EXPECT_EQ(recorded.sequence, 2);
  EXPECT_EQ(intake_.Oldest(0), nullptr);
  EXPECT_EQ(intake_.Oldest(2)->place.sequence, 1);
  EXPECT_EQ(intake_.Oldest(2)->place.sequence, 1);  // it stays
  intake_.RemoveOldest();
  EXPECT_EQ(intake_.Oldest(2)->place.sequence, 2);
  intake_.RemoveOldest();
  EXPECT_EQ(intake_.Oldest(2), nullptr);
}

// Times may be those since 1970, and a run may begin long after the time 0 of its model.
TEST_F(BatchIntakeTest, MeasuresARunFromItsFirstRowOn) {
  ASSERT_TRUE(intake_.Take(Row(1.75e9)).ok());
  EXPECT_EQ(intake_.measured_s(), 0);
  ASSERT_TRUE(intake_.Take(Row(1.75e9 + 2)).ok());
  EXPECT_EQ(intake_.measured_s(), 2);
  for (const double time_s : {1.75e9 + 60, 1.75e9 + 61.5}) {
    v1::Measurements next_run = Row(time_s);
    next_run.add_run(1);
    ASSERT_TRUE(intake_.Take(next_run).ok());
  }
  EXPECT_EQ(intake_.measured_s(), 3.5);
}

}  // namespace
}  // namespace polyest::internal
