#include "server/service/status_mapping.h"

#include <gtest/gtest.h>

namespace polyest {
namespace {

TEST(ToGrpc, KeepsCodeAndMessageOfEveryStatus) {
  // The two libraries number the same codes alike; that is the oracle.
  for (int code = 1; code <= 16; ++code) {
    const grpc::Status status = ToGrpc(absl::Status(static_cast<absl::StatusCode>(code), "why"));
    EXPECT_EQ(static_cast<int>(status.error_code()), code);
    EXPECT_EQ(status.error_message(), "why");
  }
}

TEST(ToGrpc, KeepsOk) { EXPECT_TRUE(ToGrpc(absl::OkStatus()).ok()); }

TEST(ToGrpc, CallsACodeFromTheFutureUnknown) {
  EXPECT_EQ(ToGrpc(absl::Status(static_cast<absl::StatusCode>(99), "new")).error_code(),
            grpc::StatusCode::UNKNOWN);
}

}  // namespace
}  // namespace polyest
