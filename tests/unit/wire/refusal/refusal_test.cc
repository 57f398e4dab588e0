#include "proto/wire/refusal/refusal.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(Refusal, TravelsWithTheStatusAndIsNotPartOfItsMessage) {
  const Refusal refusal{"BUSY", "--max-x", std::chrono::milliseconds(1'500)};
  const absl::Status status = Refuse(absl::StatusCode::kUnavailable, "come back", refusal);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(status.message(), "come back");
  const absl::Status copy = status;
  EXPECT_EQ(RefusalOf(copy), refusal);
}

TEST(Refusal, OfALimitIsNotCuredByWaiting) {
  const absl::Status status = LimitExceeded("--max-x", "too many");
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(RefusalOf(status), (Refusal{kLimitExceeded, "--max-x", std::nullopt}));
}

TEST(Refusal, IsNothingThatAnyStatusHas) {
  EXPECT_EQ(RefusalOf(absl::OkStatus()), std::nullopt);
  EXPECT_EQ(RefusalOf(absl::ResourceExhaustedError("full")), std::nullopt);
}

}  // namespace
}  // namespace polyest::internal
