#include "server/service/status_mapping.h"

#include <grpcpp/support/error_details.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "core/common/field_error.h"
#include "polyest/rpc/error_details.pb.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

TEST(ToGrpc, KeepsCodeAndMessageOfEveryStatus) {
  // The oracle is that the two libraries give the same codes the same numbers.
  for (int code = 1; code <= 16; ++code) {
    const grpc::Status status = ToGrpc(absl::Status(static_cast<absl::StatusCode>(code), "why"));
    EXPECT_EQ(static_cast<int>(status.error_code()), code);
    EXPECT_EQ(status.error_message(), "why");
  }
}

// Returns the details of one kind, by their standard name; fails if there are none.
template <typename Detail>
Detail Find(const grpc::Status& status) {
  rpc::Status detailed;
  EXPECT_TRUE(grpc::ExtractErrorDetails(status, &detailed).ok());
  EXPECT_EQ(detailed.code(), status.error_code());
  EXPECT_EQ(detailed.message(), status.error_message());
  Detail found;
  const std::string type = "type.googleapis.com/google.rpc." + found.GetDescriptor()->name();
  for (const auto& detail : detailed.details()) {
    if (detail.type_url() == type && found.ParseFromString(detail.value())) return found;
  }
  ADD_FAILURE() << "no " << type << " in " << detailed.ShortDebugString();
  return found;
}

TEST(ToGrpc, TellsTheFieldOfABadRequest) {
  const auto bad = Find<rpc::BadRequest>(
      ToGrpc(InvalidField("uncertain[0].uniform", "lower 5 must be below upper: 3")));
  ASSERT_EQ(bad.field_violations_size(), 1);
  EXPECT_EQ(bad.field_violations(0).field(), "uncertain[0].uniform");
  EXPECT_EQ(bad.field_violations(0).description(), "lower 5 must be below upper: 3");
}

TEST(ToGrpc, TellsTheFieldOfTheCoreUnderItsNameOnTheWire) {
  const grpc::Status status =
      ToGrpc(InvalidField("expansion.points_per_term", "0 must be at least 1"));
  EXPECT_EQ(status.error_message(), "expansion.pointsPerTerm: 0 must be at least 1");
  EXPECT_EQ(Find<rpc::BadRequest>(status).field_violations(0).field(), "expansion.pointsPerTerm");
}

TEST(ToGrpc, TellsTheFieldAlsoWhereTheMessageNamesItInWords) {
  const grpc::Status status = ToGrpc(NamedInWords(
      "measurements.time_s[3]", absl::InvalidArgumentError("row 3, column t: -1 must be ≥ 0")));
  EXPECT_EQ(status.error_message(), "row 3, column t: -1 must be ≥ 0");
  EXPECT_EQ(Find<rpc::BadRequest>(status).field_violations(0).field(), "measurements.timeS[3]");
}

TEST(ToGrpc, ReadsNoFieldOutOfASentence) {
  for (const char* message : {"the journal: is closed", "session: may look like a field", ""}) {
    EXPECT_EQ(ToGrpc(absl::InvalidArgumentError(message)).error_details(), "") << message;
  }
  EXPECT_EQ(ToGrpc(absl::NotFoundError("name: is none")).error_details(), "");
}

TEST(ToGrpc, TellsTheLimitThatWasPassed) {
  const grpc::Status status = ToGrpc(LimitExceeded("--max-sessions", "too many"));
  const auto quota = Find<rpc::QuotaFailure>(status);
  ASSERT_EQ(quota.violations_size(), 1);
  EXPECT_EQ(quota.violations(0).subject(), "--max-sessions");
  EXPECT_EQ(quota.violations(0).description(), "too many");
  const auto info = Find<rpc::ErrorInfo>(status);
  EXPECT_EQ(info.reason(), "LIMIT_EXCEEDED");
  EXPECT_EQ(info.domain(), "polyest");
  EXPECT_EQ(info.metadata().at("limit"), "--max-sessions");
}

TEST(ToGrpc, TellsTheFieldThatIsTooLargeForTheCore) {
  const auto quota = Find<rpc::QuotaFailure>(ToGrpc(FieldError(
      absl::StatusCode::kResourceExhausted, "expansion.order", "order 9 needs too much")));
  EXPECT_EQ(quota.violations(0).subject(), "expansion.order");
}

TEST(ToGrpc, TellsWhenToTryAgain) {
  const auto retry = Find<rpc::RetryInfo>(
      ToGrpc(Refuse(absl::StatusCode::kUnavailable, "later",
                    {.reason = kBusy, .retry_delay = std::chrono::milliseconds(1'500)})));
  EXPECT_EQ(retry.retry_delay().seconds(), 1);
  EXPECT_EQ(retry.retry_delay().nanos(), 500'000'000);
}

TEST(ToGrpc, CutsMessagesThatNoTrailerHasRoomFor) {
  std::string longest;
  while (longest.size() < 100'000) longest += "ü";
  const grpc::Status status = ToGrpc(InvalidField("sessionId", longest));
  EXPECT_LT(3 * status.error_message().size() + status.error_details().size() * 4 / 3, 8'000u);
  EXPECT_TRUE(status.error_message().ends_with("ü…"));
  EXPECT_EQ(Find<rpc::BadRequest>(status).field_violations(0).field(), "sessionId");
}

TEST(ToGrpc, KeepsOk) { EXPECT_TRUE(ToGrpc(absl::OkStatus()).ok()); }

TEST(ToGrpc, CallsACodeFromTheFutureUnknown) {
  EXPECT_EQ(ToGrpc(absl::Status(static_cast<absl::StatusCode>(99), "new")).error_code(),
            grpc::StatusCode::UNKNOWN);
}

}  // namespace
}  // namespace polyest::internal
