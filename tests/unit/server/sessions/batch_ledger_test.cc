#include "server/sessions/batch_ledger.h"

#include <gtest/gtest.h>

#include <stop_token>
#include <thread>

namespace polyest::internal {
namespace {

SessionPlace At(int64_t sequence) { return {sequence, 10 * sequence, sequence, {}}; }

class BatchLedgerTest : public testing::Test {
 protected:
  absl::StatusOr<BatchLedger::Kind> Check(int64_t sequence, const std::string& digest) {
    return ledger_.Check(sequence, digest, ledger_.losses(),
                         [](int64_t kept) { return "digest " + std::to_string(kept); });
  }
  void Take(int64_t sequence) {
    ASSERT_TRUE(
        ledger_.Take(At(sequence), "digest " + std::to_string(sequence), ledger_.losses()).ok());
  }
  void Keep(int64_t sequence) { ledger_.Settle(ledger_.losses(), sequence, absl::OkStatus()); }

  BatchLedger ledger_{At(3)};
};

TEST_F(BatchLedgerTest, GoesUpByOneFromWhereItStands) {
  EXPECT_EQ(*Check(4, "new"), BatchLedger::Kind::kNext);
  Take(4);
  EXPECT_EQ(ledger_.taken().sequence, 4);
  EXPECT_EQ(ledger_.kept().sequence, 3);
  EXPECT_FALSE(ledger_.all_kept());
  EXPECT_EQ(*Check(5, "new"), BatchLedger::Kind::kNext);
  Keep(4);
  EXPECT_EQ(ledger_.kept().samples, 40);
  EXPECT_TRUE(ledger_.all_kept());
}

TEST_F(BatchLedgerTest, KnowsAnyBatchAgainByItsContent) {
  Take(4);
  Take(5);
  for (const int64_t sequence : {1, 2, 3, 4, 5}) {
    EXPECT_EQ(*Check(sequence, "digest " + std::to_string(sequence)), BatchLedger::Kind::kRepeat);
    const absl::Status other = Check(sequence, "other").status();
    EXPECT_EQ(other.code(), absl::StatusCode::kAlreadyExists);
    EXPECT_EQ(other.message(), "sequence: " + std::to_string(sequence) +
                                   " was taken with other measurements; the next batch must be 6");
  }
}

TEST_F(BatchLedgerTest, RefusesGapsAndNumbersThatAreNone) {
  const absl::Status gap = Check(5, "").status();
  EXPECT_EQ(gap.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(gap.message(), "sequence: 5 leaves a gap; the next batch must be 4");
  for (const int64_t none : {int64_t{0}, int64_t{-1}, INT64_MIN}) {
    EXPECT_EQ(Check(none, "").status().code(), absl::StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(Check(INT64_MAX, "").status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(BatchLedgerTest, TellsWhenABatchIsKeptAndNotBefore) {
  Take(4);
  Take(5);
  std::vector<int64_t> told;
  for (const int64_t sequence : {5, 3, 4}) {
    ledger_.WhenKept(sequence, ledger_.losses(), [&told, sequence](const absl::Status& kept) {
      EXPECT_TRUE(kept.ok());
      told.push_back(sequence);
    });
  }
  EXPECT_EQ(told, (std::vector<int64_t>{3}));
  Keep(4);
  EXPECT_EQ(told, (std::vector<int64_t>{3, 4}));
  Keep(5);
  EXPECT_EQ(told, (std::vector<int64_t>{3, 4, 5}));
}

TEST_F(BatchLedgerTest, SaysThatNotAllIsKeptHoweverSoonABatchIsLost) {
  std::vector<absl::StatusCode> told;
  const auto tell = [&](const absl::Status& kept) { told.push_back(kept.code()); };
  const uint64_t losses = ledger_.losses();
  ledger_.WhenAllKept(losses, tell);
  Take(4);
  ledger_.WhenAllKept(losses, tell);
  EXPECT_EQ(told, (std::vector{absl::StatusCode::kOk}));
  ledger_.Settle(losses, 4, absl::ResourceExhaustedError("full"));
  ledger_.WhenAllKept(losses, tell);
  ledger_.WhenAllKept(ledger_.losses(), tell);
  EXPECT_EQ(told, (std::vector{absl::StatusCode::kOk, absl::StatusCode::kResourceExhausted,
                               absl::StatusCode::kResourceExhausted, absl::StatusCode::kOk}));
}

TEST_F(BatchLedgerTest, LosesWithABatchAllThatCameAfterIt) {
  Take(4);
  Take(5);
  Take(6);
  std::vector<absl::StatusCode> told;
  const auto tell = [&](const absl::Status& kept) { told.push_back(kept.code()); };
  const uint64_t losses = ledger_.losses();
  ledger_.WhenKept(4, losses, tell);
  ledger_.WhenKept(6, losses, tell);
  ledger_.Settle(losses, 4, absl::OkStatus());
  ledger_.Settle(losses, 5, absl::ResourceExhaustedError("full"));
  ledger_.Settle(losses, 6, absl::FailedPreconditionError("does not follow"));
  EXPECT_EQ(told, (std::vector{absl::StatusCode::kOk, absl::StatusCode::kResourceExhausted}));
  EXPECT_EQ(ledger_.taken().sequence, 4);
  EXPECT_EQ(ledger_.losses(), losses + 1);
  // A writer that has not seen the loss cannot add more, and is told the reason, not that there is
  // a gap.
  EXPECT_EQ(ledger_.Take(At(5), "", losses).code(), absl::StatusCode::kResourceExhausted);
  for (const int64_t sequence : {4, 5, 6, 7}) {
    EXPECT_EQ(ledger_.Check(sequence, "", losses, {}).status(),
              absl::ResourceExhaustedError("full"));
  }
  ledger_.WhenKept(6, losses, tell);
  EXPECT_EQ(told.back(), absl::StatusCode::kResourceExhausted);
  Take(5);
  Keep(5);
  EXPECT_EQ(ledger_.kept().sequence, 5);
}

TEST_F(BatchLedgerTest, SendsThoseAwayWhoLackBatchesOfOthers) {
  const uint64_t losses = ledger_.losses();
  ledger_.Restart(At(5), /*anew=*/true);
  EXPECT_EQ(ledger_.kept().sequence, 5);
  EXPECT_EQ(ledger_.losses(), losses + 1);
  std::vector<absl::StatusCode> told;
  ledger_.WhenKept(5, losses, [&](const absl::Status& kept) { told.push_back(kept.code()); });
  EXPECT_EQ(told, std::vector{absl::StatusCode::kUnavailable});
}

TEST_F(BatchLedgerTest, GoesOnFromThePlaceThatTheJournalTells) {
  const uint64_t losses = ledger_.losses();
  ledger_.Restart(At(5));
  EXPECT_EQ(ledger_.kept().sequence, 5);
  EXPECT_EQ(ledger_.taken().sequence, 5);
  EXPECT_EQ(ledger_.losses(), losses);  // nothing was under way
  Take(6);
  std::vector<absl::StatusCode> told;
  ledger_.WhenKept(6, losses, [&](const absl::Status& kept) { told.push_back(kept.code()); });
  ledger_.Restart(At(7));
  EXPECT_EQ(told, (std::vector{absl::StatusCode::kUnavailable}));
  EXPECT_EQ(ledger_.losses(), losses + 1);
  // The journal settles the lost batch afterwards, which changes nothing.
  ledger_.Settle(losses, 6, absl::OkStatus());
  EXPECT_EQ(ledger_.kept().sequence, 7);
  EXPECT_TRUE(ledger_.all_kept());
  EXPECT_EQ(*Check(8, "new"), BatchLedger::Kind::kNext);
}

TEST_F(BatchLedgerTest, DoesNotTakeALaterBatchForALostOneOfTheSameNumber) {
  std::vector<absl::StatusCode> told;
  const auto tell = [&](const absl::Status& kept) { told.push_back(kept.code()); };
  const uint64_t losses = ledger_.losses();
  Take(4);
  ledger_.Settle(losses, 4, absl::ResourceExhaustedError("full"));
  Take(4);
  ledger_.WhenKept(4, losses, tell);
  ledger_.WhenKept(4, ledger_.losses(), tell);
  EXPECT_EQ(told, (std::vector{absl::StatusCode::kResourceExhausted}));
  Keep(4);
  ledger_.WhenKept(4, losses, tell);
  EXPECT_EQ(told, (std::vector{absl::StatusCode::kResourceExhausted, absl::StatusCode::kOk,
                               absl::StatusCode::kResourceExhausted}));
}

TEST_F(BatchLedgerTest, WaitsUntilABatchIsKeptOrLost) {
  EXPECT_TRUE(ledger_.AwaitKept(3, 0, {}).ok());
  Take(4);
  std::thread keeping([this] { Keep(4); });
  EXPECT_TRUE(ledger_.AwaitKept(4, 0, {}).ok());
  keeping.join();
  Take(5);
  std::thread losing([this] { ledger_.Settle(0, 5, absl::DataLossError("broken")); });
  EXPECT_TRUE(absl::IsDataLoss(ledger_.AwaitKept(5, 0, {})));
  losing.join();
}

TEST_F(BatchLedgerTest, WaitsNoLongerThanItMay) {
  Take(4);
  std::stop_source source;
  source.request_stop();
  EXPECT_TRUE(absl::IsCancelled(ledger_.AwaitKept(4, 0, Stop(source.get_token()))));
  const Stop past(std::stop_token(), Stop::Clock::time_point::min());
  EXPECT_TRUE(absl::IsDeadlineExceeded(ledger_.AwaitKept(4, 0, past)));
  Keep(4);  // nobody waits any more
  EXPECT_TRUE(ledger_.AwaitKept(4, 0, past).ok());
}

}  // namespace
}  // namespace polyest::internal
