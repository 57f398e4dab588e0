#include "server/sessions/writer_lease.h"

#include <gtest/gtest.h>

#include "proto/wire/refusal/refusal.h"
#include "tests/unit/server/sessions/counting_observer.h"

namespace polyest::internal {
namespace {

class WriterLeaseTest : public testing::Test {
 protected:
  WriterLease lease_{"sessions/a"};
  const std::shared_ptr<CountingObserver> first_ = std::make_shared<CountingObserver>();
  const std::shared_ptr<CountingObserver> second_ = std::make_shared<CountingObserver>();
};

TEST_F(WriterLeaseTest, IsForOneWriterUntilItGivesItBack) {
  EXPECT_FALSE(lease_.is_held());
  ASSERT_TRUE(lease_.Claim(first_, "").ok());
  EXPECT_TRUE(lease_.is_held());
  const absl::Status refused = lease_.Claim(second_, "");
  EXPECT_EQ(refused.code(), absl::StatusCode::kAborted);
  EXPECT_EQ(refused.message(), "sessions/a has a writer already; one at a time");
  EXPECT_EQ(RefusalOf(refused), Refusal{.reason = kAnotherWriter});
  EXPECT_FALSE(lease_.Release(second_.get()));
  EXPECT_TRUE(lease_.Release(first_.get()));
  EXPECT_FALSE(lease_.Release(first_.get()));
  EXPECT_TRUE(lease_.Claim(second_, "").ok());
}

TEST_F(WriterLeaseTest, GoesToTheSameWriterOnAnotherConnectionWhichTheFirstIsToldOf) {
  ASSERT_TRUE(lease_.Claim(first_, "rig").ok());
  EXPECT_EQ(lease_.Claim(second_, "other").code(), absl::StatusCode::kAborted);
  ASSERT_TRUE(lease_.Claim(second_, "rig").ok());
  EXPECT_EQ(first_->replaced, 1);
  EXPECT_EQ(second_->replaced, 0);
  // The end of the first writer does not affect the second.
  EXPECT_FALSE(lease_.Release(first_.get()));
  EXPECT_TRUE(lease_.is_held());
}

TEST_F(WriterLeaseTest, IsForNobodyOnceClosed) {
  ASSERT_TRUE(lease_.Claim(first_, "rig").ok());
  EXPECT_EQ(lease_.Close(), first_);
  EXPECT_EQ(first_->closed, 0);  // The session tells it.
  EXPECT_EQ(lease_.Claim(second_, "rig"), absl::NotFoundError("sessions/a has been deleted"));
  EXPECT_TRUE(lease_.Release(first_.get()));
  EXPECT_EQ(lease_.Close(), nullptr);
}

}  // namespace
}  // namespace polyest::internal
