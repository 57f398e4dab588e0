#pragma once

// A session of a small problem whose journal can fail.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <optional>

#include "server/sessions/session.h"
#include "tests/testing/faulty_journal.h"
#include "tests/testing/problem_json.h"
#include "tests/unit/server/sessions/counting_observer.h"

namespace polyest::internal {

// Returns samples of a nearly undamped motion: x = v0/ω sin ωt at ω = 2π, near v0 = 1.
inline v1::Measurements Batch(std::initializer_list<double> times) {
  v1::Measurements batch;
  auto& x = *batch.add_channels();
  x.set_name("x");
  for (const double t : times) {
    batch.add_time_s(t);
    x.add_values(std::sin(2 * M_PI * t) * std::exp(-0.1 * t) / (2 * M_PI));
  }
  return batch;
}

class SessionTest : public testing::Test {
 protected:
  void SetUp() override {
    SessionHead head;
    head.name = "sessions/a";
    const auto number = journal_.Create(head, SmallProblem(), /*hidden=*/false);
    ASSERT_TRUE(number.ok()) << number.status();
    Restart();
  }
  // Acts as if the daemon had ended: only the journal remains.
  void Restart() {
    session_ = std::make_shared<Session>(SessionServices{executor_, journal_, models_, limits_},
                                         journal_.Heads()->front());
  }
  absl::StatusOr<v1::Acknowledgement> Add(int64_t sequence, const v1::Measurements& batch) {
    const absl::Status loaded = session_->Load({});
    if (!loaded.ok()) return loaded;
    return session_->Add(sequence, batch);
  }
  // Returns what is known so far of whether the batch is kept.
  std::shared_ptr<std::optional<absl::Status>> Kept(int64_t sequence) {
    auto kept = std::make_shared<std::optional<absl::Status>>();
    session_->WhenKept(sequence, losses_, [kept](const absl::Status& status) { *kept = status; });
    return kept;
  }

  // Waits until the observers have been told.
  void AwaitNews() { executor_.AwaitIdle(std::chrono::steady_clock::time_point::max()); }

  // The test's own thread acts as the strand: nothing else touches the session.
  FaultyJournal journal_;
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
  ModelLibrary models_;
  SessionLimits limits_{.batch_rows = 4, .rows = 6};
  std::shared_ptr<Session> session_;
  uint64_t losses_ = 0;  // The number of losses that the caller of Kept has seen.
};

}  // namespace polyest::internal
