#include "server/daemon/connection_table.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <utility>
#include <vector>

namespace polyest::internal {
namespace {

using Verdict = ConnectionTable::Verdict;

// Two connected sockets, which gRPC might own.
class Pair {
 public:
  Pair() { EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends_), 0); }
  ~Pair() {
    Close();
    close(ends_[1]);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;

  int number() const { return ends_[0]; }
  void Close() {
    if (ends_[0] >= 0) close(std::exchange(ends_[0], -1));
  }

 private:
  int ends_[2];
};

class ConnectionTableTest : public testing::Test {
 protected:
  // Admits a connection long after the last one.
  Verdict Admit(const Pair& pair, const std::string& peer) {
    now_ += std::chrono::seconds(1);
    return table_.Admit(pair.number(), peer, now_);
  }

  ConnectionTable table_{{.total = 3, .per_peer = 2}};
  ConnectionTable::Clock::time_point now_ = ConnectionTable::Clock::now();
};

TEST_F(ConnectionTableTest, HasRoomForSoManyInAllAndOfAPeer) {
  Pair a, b, c, d;
  EXPECT_EQ(Admit(a, "one"), Verdict::kAdmitted);
  EXPECT_EQ(Admit(b, "one"), Verdict::kAdmitted);
  EXPECT_EQ(Admit(c, "one"), Verdict::kTooManyOfPeer);
  EXPECT_EQ(Admit(c, "two"), Verdict::kAdmitted);
  EXPECT_EQ(Admit(d, "three"), Verdict::kTooMany);
  EXPECT_EQ(table_.Count(), 3);
}

TEST_F(ConnectionTableTest, HasRoomAgainWhenConnectionsAreClosedByWhoeverOwnsThem) {
  Pair a, b, c;
  Admit(a, "one");
  Admit(b, "one");
  a.Close();
  EXPECT_EQ(table_.Count(), 1);
  EXPECT_EQ(Admit(c, "one"), Verdict::kAdmitted);
}

TEST_F(ConnectionTableTest, NoticesThatADescriptorLeadsElsewhereNow) {
  Pair a, other;
  Admit(a, "one");
  // What gRPC closes may be opened again as anything else, under the same number.
  ASSERT_EQ(dup2(other.number(), a.number()), a.number());
  EXPECT_EQ(table_.Count(), 0);
  Admit(a, "one");
  Admit(a, "two");
  EXPECT_EQ(table_.Count(), 1);
}

TEST_F(ConnectionTableTest, DoesNotLookAtAllForEveryConnectionThatItRefuses) {
  Pair a, b, c;
  Admit(a, "one");
  Admit(b, "one");
  EXPECT_EQ(Admit(c, "one"), Verdict::kTooManyOfPeer);
  a.Close();
  EXPECT_EQ(table_.Admit(c.number(), "one", now_), Verdict::kTooManyOfPeer);
  EXPECT_EQ(Admit(c, "one"), Verdict::kAdmitted);
}

}  // namespace
}  // namespace polyest::internal
