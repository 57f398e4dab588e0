#include "server/web/call_metadata.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/security/in_process_caller.h"

namespace polyest::internal {
namespace {

using ::testing::Contains;
using ::testing::Key;
using ::testing::Not;
using ::testing::Pair;

TEST(CallMetadata, UnderstandsTheTimeLimitsOfGrpc) {
  EXPECT_EQ(*ParseTimeout("2H"), std::chrono::hours(2));
  EXPECT_EQ(*ParseTimeout("3M"), std::chrono::minutes(3));
  EXPECT_EQ(*ParseTimeout("30S"), std::chrono::seconds(30));
  EXPECT_EQ(*ParseTimeout("1500m"), std::chrono::milliseconds(1'500));
  EXPECT_EQ(*ParseTimeout("99999999u"), std::chrono::microseconds(99'999'999));
  EXPECT_EQ(*ParseTimeout("1n"), std::chrono::microseconds(1));
  EXPECT_EQ(*ParseTimeout("0S"), std::chrono::microseconds(0));
  for (const char* text :
       {"", "S", "30", "30s", "-1S", "+1S", " 1S", "1 S", "1.5S", "123456789S", "1SS", "1S "}) {
    EXPECT_FALSE(ParseTimeout(text).ok()) << text;
  }
}

TEST(CallMetadata, PassesOnWhoAsksAndNothingElse) {
  HttpRequest request;
  request.peer = "ipv4:192.0.2.7:1";
  request.headers = {{"Authorization", "Bearer t"},
                     {"X-Request-ID", "id-1"},
                     {"Grpc-Timeout", "5S"},
                     {"X-Polyest-Web-Peer", "ipv4:198.51.100.1:1"},
                     {"Cookie", "c"}};
  WebCall::Request call;
  ASSERT_TRUE(SetMetadata(request, call).ok());
  EXPECT_THAT(call.metadata, Contains(Pair("authorization", "Bearer t")));
  EXPECT_THAT(call.metadata, Contains(Pair("x-request-id", "id-1")));
  EXPECT_EQ(call.timeout, std::chrono::seconds(5));
  // Those two, and what the daemon itself says of the client.
  EXPECT_EQ(call.metadata.size(), 2 + MetadataOf({request.peer}).size());
  for (const auto& entry : MetadataOf({request.peer})) {
    EXPECT_THAT(call.metadata, Contains(entry));
  }
}

TEST(CallMetadata, LeavesOutARequestIdThatIsNone) {
  HttpRequest request;
  request.headers = {{"X-Request-ID", "with spaces"}};
  WebCall::Request call;
  ASSERT_TRUE(SetMetadata(request, call).ok());
  EXPECT_THAT(call.metadata, Not(Contains(Key("x-request-id"))));
}

TEST(CallMetadata, RefusesWhatGrpcCannotCarry) {
  for (const char* value : {"Bearer \xc3\xa9", "Bearer a\tb", "Bearer \x7f"}) {
    HttpRequest request;
    request.headers = {{"Authorization", value}};
    WebCall::Request call;
    EXPECT_EQ(SetMetadata(request, call).code(), absl::StatusCode::kInvalidArgument) << value;
  }
}

}  // namespace
}  // namespace polyest::internal
