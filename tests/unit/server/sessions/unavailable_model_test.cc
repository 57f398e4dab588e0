// Tests that a session keeps what it has computed while its model cannot be asked, and computes
// anew what an exception has left half done.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <stop_token>

#include "core/common/check.h"
#include "core/propagation/trajectory_ensemble.h"
#include "server/sessions/session.h"
#include "tests/testing/faulty_journal.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

// y = k t, simulated by what may be gone for a time.
class Line final : public SelfPropagatingModel {
 public:
  Line() {
    description_.name = "line";
    description_.parameters.emplace_back().name = "k";
    description_.outputs.emplace_back().name = "y";
  }
  const ModelDescription& description() const override { return description_; }
  std::unique_ptr<TrajectoryEnsemble> StartEnsemble(EnsembleSpecification specification,
                                                    const InputSignals* inputs) const override;

  // Simulations fail after so many more calls; < 0: they never do.
  mutable std::atomic<int> calls_left = -1;

 private:
  ModelDescription description_;
};

class Lines final : public TrajectoryEnsemble {
 public:
  Lines(Matrix k, const Line& line) : k_(std::move(k)), line_(line) {}
  int points() const override { return static_cast<int>(k_.rows()); }
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs, const Stop&) override {
    POLYEST_CHECK(!lost_);  // Advance must not be called again after an error
    lost_ = line_.calls_left == 0;
    if (lost_) return absl::UnavailableError("no server could be reached");
    if (line_.calls_left > 0) --line_.calls_left;
    for (Eigen::Index j = 0; j < outputs.cols(); ++j) {
      outputs.col(j) = k_.col(0) * times_s[static_cast<size_t>(j)];
    }
    return absl::OkStatus();
  }
  const std::vector<PointFailure>& failures() const override { return failures_; }

 private:
  const Matrix k_;
  const Line& line_;
  bool lost_ = false;
  std::vector<PointFailure> failures_;
};

std::unique_ptr<TrajectoryEnsemble> Line::StartEnsemble(EnsembleSpecification specification,
                                                        const InputSignals*) const {
  return std::make_unique<Lines>(std::move(specification.parameters), *this);
}

class UnavailableModelTest : public testing::Test {
 protected:
  UnavailableModelTest() {
    folder_.Write("line.test", "");
    models_ = ModelLibrary(
        std::nullopt, *ModelFolder::Open(
                          folder_.path(),
                          {.noun = "line",
                           .suffix = ".test",
                           .read = [this](const std::filesystem::path&, const std::string&)
                               -> absl::StatusOr<std::shared_ptr<const Model>> { return line_; }}));
    Begin();
  }
  void Begin() {
    SessionHead head;
    head.name = "sessions/a";
    head.number = journal_
                      .Create(head, ProblemFromJson(R"({
                        "model": {"umbridge": "line"},
                        "uncertain": [{"name": "k", "uniform": {"lower": 0, "upper": 10}}],
                        "measured": [{"output": "y", "noise": {"absolute": 0.01}}]
                      })"),
                              /*hidden=*/true)
                      .value();
    session_ = std::make_shared<Session>(SessionServices{executor_, journal_, models_}, head);
  }
  static v1::Measurements Rows(int first_row, int rows) {
    v1::Measurements batch;
    auto& y = *batch.add_channels();
    y.set_name("y");
    for (int row = first_row; row < first_row + rows; ++row) {
      batch.add_time_s(0.01 * row);
      y.add_values(3 * 0.01 * row);
    }
    return batch;
  }
  void Add(int64_t sequence, int first_row, int rows) {
    ASSERT_TRUE(session_->Load({}).ok());
    ASSERT_TRUE(session_->Add(sequence, Rows(first_row, rows)).ok());
  }
  v1::Estimate CurrentEstimate() {
    const auto estimate = session_->CurrentEstimate({});
    EXPECT_TRUE(estimate.ok()) << estimate.status();
    return estimate.ok() ? **estimate : v1::Estimate();
  }

  const TestFolder folder_;
  const std::shared_ptr<Line> line_ = std::make_shared<Line>();
  FaultyJournal journal_;
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
  ModelLibrary models_;
  std::shared_ptr<Session> session_;
};

TEST_F(UnavailableModelTest, CostsNoRowAndTheEstimateGoesOnOnceItIsBack) {
  Add(1, 1, 20);
  Add(2, 21, 300);
  const v1::Estimate undisturbed = CurrentEstimate();
  for (const int calls : {0, 1, 2}) {
    Begin();
    Add(1, 1, 20);
    CurrentEstimate();
    Add(2, 21, 300);
    line_->calls_left = calls;
    for (int attempt = 0; attempt < 2; ++attempt) {
      const absl::Status gone = session_->CurrentEstimate({}).status();
      EXPECT_EQ(gone.code(), absl::StatusCode::kUnavailable) << gone;
      EXPECT_THAT(gone.message(), HasSubstr("no server could be reached"));
    }
    line_->calls_left = -1;
    const v1::Estimate back = CurrentEstimate();
    EXPECT_EQ(back.samples(), 320);
    EXPECT_EQ(back.diagnostics_size(), undisturbed.diagnostics_size());
    EXPECT_EQ(back.parameters(0).SerializeAsString(),
              undisturbed.parameters(0).SerializeAsString());
  }
}

TEST_F(UnavailableModelTest, LeavesNothingHalfDoneByAnException) {
  Add(1, 1, 20);
  CurrentEstimate();
  const auto half_done = [](Estimator& estimator, int64_t) -> absl::Status {
    Samples row;
    row.time_s = {0.3};
    row.columns = {{.name = "y", .value = {5}, .missing = {}}};
    EXPECT_TRUE(estimator.Append(row).ok());
    throw std::bad_alloc();
  };
  EXPECT_THROW(session_->WithEstimator(half_done, {}).IgnoreError(), std::bad_alloc);
  Add(2, 21, 1);
  const v1::Estimate after = CurrentEstimate();
  EXPECT_EQ(after.samples(), 21);
  EXPECT_NEAR(after.parameters(0).mean(), 3, 0.01);
}

TEST_F(UnavailableModelTest, DoesNotWaitForASlowJournalOnceItsCallerHasGone) {
  Add(1, 1, 20);
  journal_.Hold();
  ASSERT_TRUE(session_->Add(2, Rows(21, 1)).ok());
  const auto half_done = [](Estimator&, int64_t) -> absl::Status { throw std::bad_alloc(); };
  EXPECT_THROW(session_->WithEstimator(half_done, {}).IgnoreError(), std::bad_alloc);
  std::stop_source gone;
  gone.request_stop();
  EXPECT_TRUE(absl::IsCancelled(session_->CurrentEstimate(Stop(gone.get_token())).status()));
  journal_.Release();
  EXPECT_EQ(CurrentEstimate().samples(), 21);
}

}  // namespace
}  // namespace polyest::internal
