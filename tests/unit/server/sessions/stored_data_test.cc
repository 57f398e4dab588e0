#include "server/sessions/stored_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

SessionLimits Limits(int64_t rows_per_tenant, int64_t total_rows, int64_t disk_mb = 0) {
  SessionLimits limits;
  limits.rows_per_tenant = rows_per_tenant;
  limits.total_rows = total_rows;
  limits.disk_mb_per_tenant = disk_mb;
  return limits;
}

TEST(StoredData, ReachTheBytesOfATenantAndNoFurther) {
  StoredData stored(Limits(10, 10, /*disk_mb=*/1));
  ASSERT_TRUE(stored.Take(1, "a", {0, 1 << 20}).ok());
  const absl::Status refused = stored.Take(2, "a", {0, 1});
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(RefusalOf(refused)->limit, "--max-tenant-disk-mb");
  EXPECT_EQ(
      refused.message(),
      "1 bytes beside the 1048576 that the tenant has stored are more than it may have, 1 MiB "
      "(--max-tenant-disk-mb); delete a session");
  EXPECT_TRUE(stored.Take(3, "b", {0, 1 << 20}).ok());
  EXPECT_EQ(stored.InAll().bytes, 2 << 20);
  stored.Forget(1);
  EXPECT_TRUE(stored.Take(2, "a", {0, 1}).ok());
}

TEST(StoredData, HaveOneSnapshotOfASession) {
  constexpr int64_t kHalf = 1 << 19;
  StoredData stored(Limits(10, 10, /*disk_mb=*/1));
  EXPECT_FALSE(stored.TakeSnapshot(1, "a", 1));  // There is no such session.
  stored.Count(1, "a", {1, 100}, kHalf);
  EXPECT_EQ(stored.OfTenant("a"), (StoredAmount{1, 100 + kHalf}));
  EXPECT_TRUE(stored.TakeSnapshot(1, "a", kHalf + 1));
  EXPECT_EQ(stored.OfTenant("a").bytes, 101 + kHalf);
  EXPECT_FALSE(stored.TakeSnapshot(1, "a", 2 * kHalf));
  EXPECT_EQ(stored.OfTenant("a").bytes, 101 + kHalf);
  EXPECT_TRUE(stored.TakeSnapshot(1, "a", 7));
  EXPECT_EQ(stored.OfTenant("a").bytes, 107);
  stored.Forget(1);
  EXPECT_EQ(stored.InAll(), StoredAmount());
}

TEST(StoredData, ReachTheLimitOfATenantAndNoFurther) {
  StoredData rows(Limits(10, 100));
  ASSERT_TRUE(rows.Take(1, "a", {6, 0}).ok());
  ASSERT_TRUE(rows.Take(2, "a", {4, 0}).ok());
  const absl::Status refused = rows.Take(1, "a", {1, 0});
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(RefusalOf(refused)->limit, "--max-tenant-rows");
  EXPECT_EQ(rows.OfTenant("a").rows, 10);
  EXPECT_TRUE(rows.Take(1, "a", {0, 0}).ok());
  EXPECT_TRUE(rows.Take(3, "b", {10, 0}).ok());
}

TEST(StoredData, ReachTheLimitOfAllWithoutTellingWhatOthersHave) {
  StoredData rows(Limits(10, 15));
  ASSERT_TRUE(rows.Take(1, "a", {9, 0}).ok());
  const absl::Status refused = rows.Take(2, "b", {7, 0});
  EXPECT_EQ(RefusalOf(refused)->limit, "--max-total-rows");
  EXPECT_THAT(std::string(refused.message()), testing::Not(HasSubstr("9")));
  EXPECT_TRUE(rows.Take(2, "b", {6, 0}).ok());
}

TEST(StoredData, GiveBackWhatWasNotStored) {
  StoredData rows(Limits(10, 10));
  ASSERT_TRUE(rows.Take(1, "a", {10, 0}).ok());
  rows.Release(1, {4, 0});
  EXPECT_EQ(rows.OfTenant("a").rows, 6);
  EXPECT_TRUE(rows.Take(2, "b", {4, 0}).ok());
}

TEST(StoredData, ForgetASessionOnceHoweverItsBatchesEnd) {
  StoredData rows(Limits(10, 10));
  ASSERT_TRUE(rows.Take(1, "a", {6, 0}).ok());
  ASSERT_TRUE(rows.Take(2, "a", {3, 0}).ok());
  rows.Forget(1);
  rows.Release(1, {6, 0});  // from a batch that was under way
  rows.Forget(1);
  EXPECT_EQ(rows.OfTenant("a").rows, 3);
}

TEST(StoredData, CountWhatIsThereBeyondTheLimitToo) {
  StoredData rows(Limits(10, 10));
  rows.Count(1, "a", {12, 0});
  EXPECT_EQ(rows.OfTenant("a").rows, 12);
  EXPECT_FALSE(rows.Take(1, "a", {1, 0}).ok());
}

}  // namespace
}  // namespace polyest::internal
