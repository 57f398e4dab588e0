// Tests sessions whose rows may arrive out of order. The oracle is the same record in time order.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/estimator/record/memory_store.h"
#include "proto/wire/convert/problem.h"
#include "server/digest/digest.h"
#include "server/journal/memory_journal.h"
#include "server/sessions/session.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

constexpr double kReorderWindow_s = 0.5;
constexpr double kStep_s = 0.01;

// Returns a problem with two measured outputs, the noise of one of which depends on the largest
// sample before it, and with a streamed input.
v1::Problem ForcedProblem() {
  return ProblemFromJson(R"({
    "model": {"builtin": "mass_spring_damper"},
    "fixed": {"m": 1, "c": 0.2},
    "uncertain": [{"name": "k", "uniform": {"lower": 30, "upper": 50}}],
    "inputs": [{"name": "force", "streamed": {}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01, "relativeToMax": 0.01}},
                 {"output": "v", "noise": {"absolute": 0.05}}]
  })");
}

// Returns the time steps between the samples of each channel.
std::map<std::string, int> Strides() { return {{"x", 1}, {"v", 2}, {"force", 3}}; }

double SampleOf(const std::string& channel, int step) {
  const double t = kStep_s * step;
  if (channel == "force") return std::sin(3 * t);
  const double size = std::exp(-0.1 * t);
  return channel == "x" ? size * std::cos(6.3 * t) : -6.3 * size * std::sin(6.3 * t);
}

// Returns the samples of some channels at the steps [first, end) of a run.
v1::Measurements Steps(const std::vector<std::string>& channels, int first, int end, int run = 0) {
  v1::Measurements batch;
  for (const std::string& name : channels) batch.add_channels()->set_name(name);
  for (int step = first; step < end; ++step) {
    const auto has = [&](const std::string& name) { return step % Strides()[name] == 0; };
    if (std::ranges::none_of(channels, has)) continue;
    const int row = batch.time_s_size();
    batch.add_time_s(kStep_s * step);
    batch.add_run(run);
    for (auto& channel : *batch.mutable_channels()) {
      channel.add_values(has(channel.name()) ? SampleOf(channel.name(), step) : 0);
      if (!has(channel.name())) channel.add_missing(row);
    }
  }
  return batch;
}

v1::Measurements EndOfRun() {
  v1::Measurements end;
  end.set_end_of_run(true);
  return end;
}

// Returns a run in time order, and channel by channel with the latest times first.
std::vector<v1::Measurements> InOrder(int steps, int run) {
  std::vector<v1::Measurements> batches;
  for (int first = 0; first < steps; first += 25) {
    batches.push_back(Steps({"x", "v", "force"}, first, std::min(steps, first + 25), run));
  }
  batches.push_back(EndOfRun());
  return batches;
}
std::vector<v1::Measurements> OutOfOrder(int steps, int run) {
  std::vector<v1::Measurements> batches;
  for (int first = 0; first < steps; first += 50) {
    const int middle = std::min(steps, first + 25), end = std::min(steps, first + 50);
    batches.push_back(Steps({"v"}, middle, end, run));
    batches.push_back(Steps({"x", "v"}, first, middle, run));
    batches.push_back(Steps({"x"}, middle, end, run));
    batches.push_back(Steps({"force"}, first, end, run));
  }
  std::erase_if(batches, [](const v1::Measurements& batch) { return batch.time_s_size() == 0; });
  batches.push_back(EndOfRun());
  return batches;
}

class ReorderingSessionTest : public testing::Test {
 protected:
  std::shared_ptr<Session> Create(const std::string& name, double window_s) {
    SessionHead head;
    head.name = name;
    head.reorder_window_s = window_s;
    EXPECT_TRUE(journal_.Create(head, ForcedProblem(), /*hidden=*/false).ok());
    return Restart(name);
  }
  // Acts as if the daemon had ended: only the journal remains.
  std::shared_ptr<Session> Restart(const std::string& name) {
    const std::vector<SessionHead> heads = journal_.Heads().value();
    const auto head = std::ranges::find(heads, name, &SessionHead::name);
    return std::make_shared<Session>(SessionServices{executor_, journal_, models_}, *head);
  }
  static absl::Status Add(Session& session, const v1::Measurements& batch) {
    const absl::Status loaded = session.Load({});
    if (!loaded.ok()) return loaded;
    return session.Add(session.place().sequence + 1, batch).status();
  }
  static void AddAll(Session& session, const std::vector<v1::Measurements>& batches) {
    for (const v1::Measurements& batch : batches) {
      const absl::Status added = Add(session, batch);
      ASSERT_TRUE(added.ok()) << added;
    }
  }
  static std::string Bits(Session& session) {
    const auto estimate = session.CurrentEstimate({});
    EXPECT_TRUE(estimate.ok()) << estimate.status();
    if (!estimate.ok()) return "";
    v1::Estimate bits = **estimate;
    bits.clear_sequence();
    return DeterministicBytes(bits);
  }

  // The test's own thread acts as the strand: nothing else touches the sessions.
  MemoryJournal journal_;
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
  ModelLibrary models_;
};

TEST_F(ReorderingSessionTest, EstimatesTheSameBitsAsFromDataInOrder) {
  const auto ordered = Create("sessions/ordered", 0);
  const auto reordering = Create("sessions/reordering", kReorderWindow_s);
  for (const int run : {0, 1}) {
    AddAll(*ordered, InOrder(210, run));
    AddAll(*reordering, OutOfOrder(210, run));
    EXPECT_EQ(Bits(*reordering), Bits(*ordered));
  }
  EXPECT_EQ(reordering->place().samples, ordered->place().samples);
  EXPECT_EQ(Bits(*Restart("sessions/reordering")), Bits(*ordered));
}

TEST_F(ReorderingSessionTest, GoesOnAfterARestartInTheMiddleOfTheWindow) {
  const auto ordered = Create("sessions/ordered", 0);
  AddAll(*ordered, InOrder(400, 0));
  auto reordering = Create("sessions/reordering", kReorderWindow_s);
  const std::vector<v1::Measurements> batches = OutOfOrder(400, 0);
  for (size_t i = 0; i < batches.size(); ++i) {
    AddAll(*reordering, {batches[i]});
    if (i % 5 != 2) continue;
    const std::string before = Bits(*reordering);
    reordering = Restart("sessions/reordering");
    ASSERT_EQ(Bits(*reordering), before) << i;
  }
  EXPECT_EQ(Bits(*reordering), Bits(*ordered));
}

TEST_F(ReorderingSessionTest, GoesOnFromASnapshotToTheSameBits) {
  const auto ordered = Create("sessions/ordered", 0);
  AddAll(*ordered, InOrder(4'300, 0));
  const auto reordering = Create("sessions/reordering", kReorderWindow_s);
  for (const v1::Measurements& batch : OutOfOrder(4'300, 0)) {
    AddAll(*reordering, {batch});
    ASSERT_TRUE(reordering->Process({}).ok());
  }
  const auto snapshot = journal_.ReadSnapshot(reordering->number());
  ASSERT_TRUE(snapshot.ok() && snapshot->has_value());
  EXPECT_GT((*snapshot)->rows, 0);
  const auto restarted = Restart("sessions/reordering");
  EXPECT_EQ(Bits(*restarted), Bits(*ordered));
  EXPECT_EQ(Bits(*reordering), Bits(*ordered));
}

TEST_F(ReorderingSessionTest, CountsOnlyReleasedSamplesInItsEstimate) {
  const auto session = Create("sessions/a", kReorderWindow_s);
  AddAll(*session, {Steps({"x", "force"}, 0, 101)});
  auto estimate = session->CurrentEstimate({});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  // The rows from 0 s to 0.49 s are more than 0.5 s before the one at 1 s. Of these, the curve of
  // the force has four samples at or after those up to 0.39 s: at 0.39, 0.42, 0.45 and 0.48 s.
  EXPECT_EQ((*estimate)->samples(), 40);
  EXPECT_EQ((*estimate)->sequence(), 1);
  EXPECT_EQ(session->Describe().sample_count(), 101);
  EXPECT_EQ(session->Describe().last_time_s(), 1);
  AddAll(*session, {EndOfRun()});
  estimate = session->CurrentEstimate({});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ((*estimate)->samples(), 101);
}

TEST_F(ReorderingSessionTest, EstimatesThePriorWhileAllRowsAreHeldBack) {
  const auto session = Create("sessions/a", kReorderWindow_s);
  AddAll(*session, {Steps({"x", "force"}, 0, 10)});
  const auto estimate = session->CurrentEstimate({});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ((*estimate)->samples(), 0);
}

// A batch that is acknowledged can no longer be refused when its rows are released.
TEST_F(ReorderingSessionTest, RefusesBadRowsWhenTheyArriveAndGoesOn) {
  const auto session = Create("sessions/a", kReorderWindow_s);
  AddAll(*session, {Steps({"x"}, 100, 120)});
  v1::Measurements huge = Steps({"v"}, 100, 120);
  huge.mutable_channels(0)->set_values(4, 1e30);
  EXPECT_THAT(Add(*session, huge).message(),
              HasSubstr("row 4 (counted from 0), column v: 1e+30 is more than"));
  v1::Measurements unknown = Steps({"v"}, 100, 120);
  unknown.mutable_channels(0)->set_name("w");
  EXPECT_THAT(Add(*session, unknown).message(), HasSubstr("column \"w\" is neither"));
  v1::Measurements negative = Steps({"v"}, 100, 120);
  negative.set_time_s(0, -0.5);
  EXPECT_THAT(Add(*session, negative).message(), HasSubstr("must be a finite time"));
  EXPECT_THAT(
      Add(*session, Steps({"v"}, 60, 80)).message(),
      HasSubstr("row 0 (counted from 0), column v: t = 0.59999999999999998 s comes too late"));
  EXPECT_EQ(session->Describe().sample_count(), 20);
  AddAll(*session, {Steps({"v"}, 80, 120), Steps({"force"}, 90, 180)});
  AddAll(*session, {EndOfRun()});
  const auto estimate = session->CurrentEstimate({});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ((*estimate)->samples(), 40);
}

TEST_F(ReorderingSessionTest, NeedsRowsInOrderWithoutAWindow) {
  const auto session = Create("sessions/a", 0);
  AddAll(*session, {Steps({"x"}, 100, 120)});
  EXPECT_THAT(Add(*session, Steps({"v"}, 100, 120)).message(),
              HasSubstr("times must increase within a run"));
}

// The store has whole segments of rows in the journal only, which begin and end amid held rows.
TEST_F(ReorderingSessionTest, ReadsRowsOfTheJournalInTheOrderInWhichTheyWereReleased) {
  const ResolvedProblem problem = ToProblem(ForcedProblem(), models_).value();
  const auto session = Create("sessions/a", kReorderWindow_s);
  BatchIntake intake(problem, kReorderWindow_s);
  JournalStore store(problem, kReorderWindow_s);
  store.ReadFrom(journal_, session->number());
  MemoryStore expected;
  SampleChecks checks(problem);
  std::vector<v1::Measurements> batches = OutOfOrder(5'000, 0);
  for (const v1::Measurements& batch : OutOfOrder(10'000, 1)) batches.push_back(batch);
  for (const v1::Measurements& batch : batches) {
    JournalEntry entry{session->number(), DeterministicBytes(batch), "", {}};
    entry.digest = Digest(entry.measurements);
    ASSERT_TRUE(intake.Take(batch).ok());
    const TakenBatch taken = *intake.Oldest(std::numeric_limits<int64_t>::max());
    intake.RemoveOldest();
    entry.place = taken.place;
    journal_.Append(std::move(entry), [](const absl::Status& kept) { ASSERT_TRUE(kept.ok()); });
    store.SetHeldFrom(taken.held_from);
    if (RowReorder::IsNothing(taken.samples)) {
      store.PassOver();
      continue;
    }
    const auto checked = checks.Check(taken.samples);
    ASSERT_TRUE(checked.ok()) << checked.status();
    checks.Accept(*checked);
    ASSERT_TRUE(expected.Append(*checked).ok());
    ASSERT_TRUE(store.Append(*checked).ok());
  }
  store.Release(static_cast<int64_t>(batches.size()));
  ASSERT_EQ(store.rows(), 15'000);
  ASSERT_LT(store.rows_in_memory(), 15'000);
  for (const int64_t first : {0, 4'000, 9'000, 0, 12'000}) {
    RowBlock in_memory, read;
    ASSERT_TRUE(expected.Read(first, 3'000, in_memory).ok());
    const absl::Status status = store.Read(first, 3'000, read);
    ASSERT_TRUE(status.ok()) << status;
    ASSERT_EQ(read.noise, in_memory.noise) << first;
    for (size_t i = 0; i < in_memory.rows.size(); ++i) {
      ASSERT_EQ(read.rows[i].run, in_memory.rows[i].run);
      ASSERT_EQ(read.rows[i].time_s, in_memory.rows[i].time_s);
    }
    for (size_t i = 0; i < in_memory.values.size(); ++i) {
      ASSERT_TRUE(read.values[i] == in_memory.values[i] ||
                  (std::isnan(read.values[i]) && std::isnan(in_memory.values[i])));
    }
  }
}

}  // namespace
}  // namespace polyest::internal
