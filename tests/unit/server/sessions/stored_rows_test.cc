#include "server/sessions/stored_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

TEST(StoredRows, ReachTheLimitOfATenantAndNoFurther) {
  StoredRows rows(10, 100);
  ASSERT_TRUE(rows.Take(1, "a", 6).ok());
  ASSERT_TRUE(rows.Take(2, "a", 4).ok());
  const absl::Status refused = rows.Take(1, "a", 1);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(RefusalOf(refused)->limit, "--max-tenant-rows");
  EXPECT_EQ(rows.OfTenant("a"), 10);
  EXPECT_TRUE(rows.Take(1, "a", 0).ok());
  EXPECT_TRUE(rows.Take(3, "b", 10).ok());
}

TEST(StoredRows, ReachTheLimitOfAllWithoutTellingWhatOthersHave) {
  StoredRows rows(10, 15);
  ASSERT_TRUE(rows.Take(1, "a", 9).ok());
  const absl::Status refused = rows.Take(2, "b", 7);
  EXPECT_EQ(RefusalOf(refused)->limit, "--max-total-rows");
  EXPECT_THAT(std::string(refused.message()), testing::Not(HasSubstr("9")));
  EXPECT_TRUE(rows.Take(2, "b", 6).ok());
}

TEST(StoredRows, GiveBackWhatWasNotStored) {
  StoredRows rows(10, 10);
  ASSERT_TRUE(rows.Take(1, "a", 10).ok());
  rows.Release(1, 4);
  EXPECT_EQ(rows.OfTenant("a"), 6);
  EXPECT_TRUE(rows.Take(2, "b", 4).ok());
}

TEST(StoredRows, ForgetASessionOnceHoweverItsBatchesEnd) {
  StoredRows rows(10, 10);
  ASSERT_TRUE(rows.Take(1, "a", 6).ok());
  ASSERT_TRUE(rows.Take(2, "a", 3).ok());
  rows.Forget(1);
  rows.Release(1, 6);  // from a batch that was under way
  rows.Forget(1);
  EXPECT_EQ(rows.OfTenant("a"), 3);
}

TEST(StoredRows, CountWhatIsThereBeyondTheLimitToo) {
  StoredRows rows(10, 10);
  rows.Count(1, "a", 12);
  EXPECT_EQ(rows.OfTenant("a"), 12);
  EXPECT_FALSE(rows.Take(1, "a", 1).ok());
}

}  // namespace
}  // namespace polyest::internal
