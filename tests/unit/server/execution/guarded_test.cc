// Tests that exceptions of a request end the request alone.

#include "server/execution/guarded.h"

#include <absl/status/statusor.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

TEST(Guarded, ReturnsWhatTheWorkReturns) {
  EXPECT_TRUE(Guarded([] { return absl::OkStatus(); }).ok());
  EXPECT_TRUE(absl::IsAborted(Guarded([] { return absl::AbortedError("why"); })));
  EXPECT_EQ(Guarded([]() -> absl::StatusOr<int> { return 3; }).value(), 3);
}

TEST(Guarded, TurnsExceptionsIntoStatuses) {
  const auto lacks_memory = []() -> absl::Status { throw std::bad_alloc(); };
  EXPECT_TRUE(absl::IsResourceExhausted(Guarded(lacks_memory)));
  const auto is_wrong = []() -> absl::StatusOr<int> { throw std::out_of_range("vector::at"); };
  EXPECT_TRUE(absl::IsInternal(Guarded(is_wrong).status()));
}

// The daemon hosts other sessions than the one in which a check fails.
TEST(Guarded, TurnsAFailedCheckIntoAFaultOfTheRequest) {
  const auto checks = [](int count) {
    POLYEST_CHECK(count > 0);
    return absl::OkStatus();
  };
  EXPECT_TRUE(Guarded([&] { return checks(1); }).ok());
  EXPECT_TRUE(absl::IsInternal(Guarded([&] { return checks(0); })));
}

}  // namespace
}  // namespace polyest::internal
