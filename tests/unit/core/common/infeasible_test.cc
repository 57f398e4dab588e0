// What cannot be done where it was tried is told from errors of the same code.

#include "core/common/infeasible.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(Infeasible, IsAFailedPreconditionWithItsSentence) {
  const absl::Status status = InfeasibleError("only 3 of 8 trajectories are left");
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(), "only 3 of 8 trajectories are left");
  EXPECT_TRUE(IsInfeasible(status));
}

TEST(Infeasible, IsNoErrorOfTheSameCodeFromElsewhere) {
  EXPECT_FALSE(IsInfeasible(absl::FailedPreconditionError("the worker is dead")));
  EXPECT_FALSE(IsInfeasible(absl::OkStatus()));
}

}  // namespace
}  // namespace polyest::internal
