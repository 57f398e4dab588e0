#include "server/forwarding/placement.h"

#include <gtest/gtest.h>

#include <map>

namespace polyest::internal {
namespace {

using Nodes = std::vector<JournalNode>;

class PlacementTest : public testing::Test {
 protected:
  // Makes the placement of daemon 1.
  Placement Make() {
    return Placement(
        1, [this]() -> absl::StatusOr<Nodes> { return ++looks_, nodes_; }, [this] { return now_; });
  }

  Nodes nodes_{
      {.number = 1, .address = "a"}, {.number = 2, .address = "b"}, {.number = 3, .address = "c"}};
  int looks_ = 0;
  Placement::Clock::time_point now_{};
};

TEST_F(PlacementTest, StaysWhereTheOthersHaveAsMuchToDo) {
  Placement placement = Make();
  for (int i = 0; i < 8; ++i) EXPECT_EQ(placement.Elsewhere(), std::nullopt);
}

TEST_F(PlacementTest, SpreadsManySessions) {
  Placement placement = Make();
  std::map<std::string, int> placed;
  for (int i = 0; i < 300; ++i) ++placed[placement.Elsewhere().value_or("a")];
  for (const auto& [address, count] : placed) EXPECT_NEAR(count, 100, 10) << address;
  EXPECT_EQ(looks_, 1);
}

TEST_F(PlacementTest, TakesTheDaemonThatUsesTheLeastProcessorTime) {
  nodes_[0].busy_cores = 1.2;
  nodes_[1].busy_cores = 0.9;
  Placement placement = Make();
  EXPECT_EQ(placement.Elsewhere(), "c");
  nodes_[0].busy_cores = 0.3;
  EXPECT_EQ(placement.Elsewhere(), "c");
  now_ += std::chrono::seconds(1);
  EXPECT_EQ(placement.Elsewhere(), std::nullopt);
}

TEST_F(PlacementTest, PassesOverThoseThatDoNotTakeSessions) {
  nodes_[0].sessions = 100;
  nodes_[1].draining = true;
  nodes_[2].lease_age_s = 2.5;
  nodes_.push_back({.number = 4, .address = ""});
  EXPECT_EQ(Make().Elsewhere(), std::nullopt);
  nodes_[2].lease_age_s = 1;
  EXPECT_EQ(Make().Elsewhere(), "c");
}

TEST_F(PlacementTest, StaysWhereTheJournalDoesNotTell) {
  Placement lost(1, []() -> absl::StatusOr<Nodes> { return absl::UnavailableError("away"); });
  EXPECT_EQ(lost.Elsewhere(), std::nullopt);
  nodes_.erase(nodes_.begin());
  EXPECT_EQ(Make().Elsewhere(), std::nullopt);
}

}  // namespace
}  // namespace polyest::internal
