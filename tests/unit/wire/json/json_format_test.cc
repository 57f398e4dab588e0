#include "proto/wire/json/json_format.h"

#include <gtest/gtest.h>

#include "polyest/v1/session_service.pb.h"

namespace polyest::internal {
namespace {

TEST(TryToJson, RefusesATimeBeyondTheYear9999) {
  v1::Session session;
  session.mutable_create_time()->set_seconds(253'402'300'799);
  const auto last = TryToJson(session, /*several_lines=*/false);
  ASSERT_TRUE(last.ok()) << last.status();
  EXPECT_EQ(*last, ToJson(session, /*several_lines=*/false));
  session.mutable_create_time()->set_seconds(253'402'300'800);
  EXPECT_EQ(TryToJson(session, /*several_lines=*/false).status().code(),
            absl::StatusCode::kInternal);
}

TEST(FromJson, RefusesTextThatIsNotUtf8) {
  for (const char* name : {"\xff", "\xed\xa0\x80", "\xc0\x80", "\\ud800", "\\udc00"}) {
    v1::Session session;
    EXPECT_EQ(FromJson(std::string(R"({"name": ")") + name + "\"}", session).code(),
              absl::StatusCode::kInvalidArgument)
        << name;
  }
}

}  // namespace
}  // namespace polyest::internal
