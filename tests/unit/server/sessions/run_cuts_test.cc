#include "server/sessions/run_cuts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/sessions/session.h"
#include "tests/testing/faulty_journal.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// ẋ = k x² from x = 1 reaches infinity at t = 1/k, which is before 20 s for every k of the prior.
v1::Problem GrowthProblem() {
  return ProblemFromJson(R"({
    "model": {"equations": {"states": {"x": "k * x^2"}, "outputs": {"x": "x"},
                            "parameters": {"x_0": 1}}},
    "uncertain": [{"name": "k", "uniform": {"lower": 0.06, "upper": 0.3}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })");
}

// Returns rows of a run with k = 0.1, for which x = 1/(1 − k t).
v1::Measurements Rows(int run, std::initializer_list<double> times) {
  v1::Measurements rows;
  auto& x = *rows.add_channels();
  x.set_name("x");
  for (const double t : times) {
    rows.add_time_s(t);
    rows.add_run(run);
    x.add_values(t < 10 ? 1 / (1 - 0.1 * t) : 0);
  }
  return rows;
}

const std::initializer_list<double> kGood = {0.5, 1, 1.5, 2, 2.5};

class FailingModelTest : public testing::Test {
 protected:
  void SetUp() override { Begin(); }
  void Begin() {
    SessionHead head;
    head.name = "sessions/a";
    number_ = journal_.Create(head, GrowthProblem(), /*hidden=*/true).value();
    head.number = number_;
    last_ = 0;
    Open(head);
  }
  void Open(SessionHead head) {
    session_ = std::make_shared<Session>(SessionServices{executor_, journal_, models_}, head);
  }
  // Acts as if the daemon had ended: only the journal remains.
  void Restart() {
    SessionHead head;
    head.name = "sessions/a";
    head.number = number_;
    head.place = session_->place();
    Open(head);
  }
  void Add(const v1::Measurements& rows) {
    ASSERT_TRUE(session_->Load({}).ok());
    const auto added = session_->Add(++last_, rows);
    ASSERT_TRUE(added.ok()) << added.status();
  }
  v1::Estimate CurrentEstimate() {
    const auto estimate = session_->CurrentEstimate({});
    EXPECT_TRUE(estimate.ok()) << estimate.status();
    return estimate.ok() ? **estimate : v1::Estimate();
  }
  // Returns the messages of POINTS_FAILED.
  static std::vector<std::string> Failures(const v1::Estimate& estimate) {
    std::vector<std::string> messages;
    for (const v1::Diagnostic& one : estimate.diagnostics()) {
      if (one.code() == v1::Diagnostic::POINTS_FAILED) messages.push_back(one.message());
    }
    return messages;
  }
  static v1::Estimate WithoutWarnings(v1::Estimate estimate) {
    estimate.clear_diagnostics();
    estimate.clear_sequence();
    estimate.mutable_expansion()->clear_trajectories();
    return estimate;
  }

  FaultyJournal journal_;
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
  ModelLibrary models_;
  int64_t number_ = 0;
  int64_t last_ = 0;  // number of the last batch
  std::shared_ptr<Session> session_;
};

TEST_F(FailingModelTest, EndsTheRunAndSaysSoInTheEstimate) {
  Add(Rows(0, kGood));
  const v1::Estimate before = CurrentEstimate();
  EXPECT_THAT(Failures(before), IsEmpty());
  Add(Rows(0, {3, 40}));
  // Whoever asks first for the rows left out has what was added computed.
  EXPECT_FALSE(session_->Cuts({}).value().empty());
  for (int attempt = 0; attempt < 2; ++attempt) {
    const v1::Estimate after = CurrentEstimate();
    EXPECT_EQ(after.sequence(), 2);
    EXPECT_EQ(after.samples(), before.samples() + 1);
    EXPECT_THAT(Failures(after),
                ElementsAre(AllOf(HasSubstr("the rows of run 0 from t = 40 s on were left out"),
                                  HasSubstr("could be integrated to t = 40 s"))));
  }
  Add(Rows(0, {41}));  // the run has ended
  EXPECT_EQ(CurrentEstimate().samples(), before.samples() + 1);
}

// Whoever streams inputs ends the record without rows.
TEST_F(FailingModelTest, TakesTheEndOfARunOfWhichNoRowCanBeUsed) {
  Add(Rows(0, {40}));
  EXPECT_THAT(Failures(CurrentEstimate()), ElementsAre(HasSubstr("not even the first one")));
  v1::Measurements end;
  end.set_end_of_run(true);
  Add(end);
  EXPECT_THAT(Failures(CurrentEstimate()), ElementsAre(HasSubstr("not even the first one")));
  Restart();
  ASSERT_TRUE(session_->Load({}).ok());
  EXPECT_THAT(Failures(CurrentEstimate()), ElementsAre(HasSubstr("not even the first one")));
}

TEST_F(FailingModelTest, GoesOnWithTheNextRunAsIfTheRowsHadNotCome) {
  Add(Rows(0, kGood));
  Add(Rows(0, {40}));
  CurrentEstimate();
  Add(Rows(1, kGood));
  const v1::Estimate after = CurrentEstimate();
  EXPECT_EQ(after.samples(), 10);
  EXPECT_NEAR(after.parameters(0).map(), 0.1, 3 * after.parameters(0).std_dev());
  Restart();
  EXPECT_EQ(CurrentEstimate().SerializeAsString(), after.SerializeAsString());

  Begin();
  Add(Rows(0, kGood));
  Add(Rows(1, kGood));
  const v1::Estimate without = CurrentEstimate();
  EXPECT_EQ(WithoutWarnings(after).SerializeAsString(),
            WithoutWarnings(without).SerializeAsString());
}

TEST_F(FailingModelTest, DoesNotDependOnHowTheRowsWereCutIntoBatches) {
  Add(Rows(0, kGood));
  Add(Rows(0, {40}));
  Add(Rows(0, {41}));
  Add(Rows(1, kGood));
  const v1::Estimate many = CurrentEstimate();
  Begin();
  v1::Measurements all = Rows(0, {0.5, 1, 1.5, 2, 2.5, 40, 41});
  all.MergeFrom(Rows(1, kGood));
  all.mutable_channels(0)->mutable_values()->MergeFrom(all.channels(1).values());
  all.mutable_channels()->RemoveLast();
  Add(all);
  v1::Estimate one = CurrentEstimate();
  one.set_sequence(many.sequence());
  EXPECT_EQ(one.SerializeAsString(), many.SerializeAsString());
}

TEST_F(FailingModelTest, CutsEachRunThatFails) {
  Add(Rows(0, kGood));
  Add(Rows(0, {40}));
  Add(Rows(1, {0.5, 50}));
  Add(Rows(2, {0.5, 1}));
  const v1::Estimate estimate = CurrentEstimate();
  EXPECT_EQ(estimate.samples(), 8);
  EXPECT_THAT(Failures(estimate),
              ElementsAre(HasSubstr("the same happened in 1 more of the runs")));
}

TEST_F(FailingModelTest, ShowsThePriorWhereNoRowCanBeUsed) {
  Add(Rows(0, {40}));
  Add(Rows(1, kGood));
  const v1::Estimate estimate = CurrentEstimate();
  EXPECT_EQ(estimate.sequence(), 2);
  EXPECT_EQ(estimate.samples(), 0);
  EXPECT_NEAR(estimate.parameters(0).mean(), 0.18, 1e-3);
  EXPECT_THAT(Failures(estimate), ElementsAre(HasSubstr("no row could be used")));
}

TEST_F(FailingModelTest, WaitsForTheBatchesThatTheJournalDoesNotKeepYet) {
  Add(Rows(0, kGood));
  journal_.Hold();
  Add(Rows(0, {40}));
  std::jthread estimating([&] { EXPECT_EQ(CurrentEstimate().samples(), 5); });
  journal_.Release();
}

// Many rows of a second run, so that there is a snapshot after the cut.
TEST_F(FailingModelTest, ComesBackFromASnapshotWithItsCuts) {
  Add(Rows(0, {0.5, 1, 40}));
  CurrentEstimate();
  v1::Measurements rows = Rows(1, {});
  for (int k = 1; k <= 6000; ++k) {
    rows.add_time_s(0.0005 * k);
    rows.add_run(1);
    rows.mutable_channels(0)->add_values(1 / (1 - 0.1 * 0.0005 * k));
  }
  Add(rows);
  const v1::Estimate before = CurrentEstimate();
  const auto snapshot = journal_.ReadSnapshot(number_);
  ASSERT_TRUE(snapshot.ok() && snapshot->has_value());
  EXPECT_THAT((*snapshot)->state.substr(0, 16), "polyest run cuts");
  Restart();
  EXPECT_EQ(CurrentEstimate().SerializeAsString(), before.SerializeAsString());
  // A snapshot that cannot be used takes its cuts with it.
  journal_.SaveSnapshot(number_, {2, 1000, "polyest run cuts\n1 0\n1 0.25 wrong\nnonsense"});
  Restart();
  EXPECT_EQ(CurrentEstimate().SerializeAsString(), before.SerializeAsString());
}

TEST(RunCuts, LeaveOutTheRestOfARunFromEveryColumn) {
  RunCuts cuts;
  cuts.Add({1, 0.2}, /*first_of_record=*/false, "why");
  Samples samples;
  samples.time_s = {0.1, 0.1, 0.2, 0.3, 0.1};
  samples.run = {0, 1, 1, 1, 2};
  samples.columns = {{"x", {1, 2, 3, 4, 5}, {false, true, false, true, false}},
                     {"f", {6, 7, 8, 9, 10}, {}}};
  samples.end_of_run = true;
  const Samples kept = cuts.Keep(samples);
  EXPECT_THAT(kept.time_s, ElementsAre(0.1, 0.1, 0.1));
  EXPECT_THAT(kept.run, ElementsAre(0, 1, 2));
  EXPECT_THAT(kept.columns[0].value, ElementsAre(1, 2, 5));
  EXPECT_THAT(kept.columns[0].missing, ElementsAre(false, true, false));
  EXPECT_THAT(kept.columns[1].value, ElementsAre(6, 7, 10));
  EXPECT_TRUE(kept.end_of_run);
}

TEST(RunCuts, AreReadBackFromBeforeAStateAndRefusedWhereTheyBreakOff) {
  RunCuts cuts;
  cuts.Add({3, 0.1}, /*first_of_record=*/false, "two\nlines");
  const std::string state = cuts.Prepend("state\n");
  std::string rest = state;
  const auto read = RunCuts::Split(rest);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(rest, "state\n");
  EXPECT_EQ(read->Describe().message, cuts.Describe().message);
  EXPECT_EQ(read->Prepend("state\n"), state);
  for (size_t length = 16; length < state.size() - 6; ++length) {
    std::string part = state.substr(0, length);
    EXPECT_TRUE(absl::IsDataLoss(RunCuts::Split(part).status())) << length;
  }
  std::string alone = "state";
  EXPECT_TRUE(RunCuts::Split(alone)->empty());
  EXPECT_EQ(alone, "state");
}

}  // namespace
}  // namespace polyest::internal
