#include "core/common/nearest_name.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

const std::vector<std::string> kCommands = {"estimate", "explain", "export", "list", "stream"};

TEST(NearestName, FindsASlip) {
  EXPECT_EQ(NearestName("estmate", kCommands), "estimate");
  EXPECT_EQ(NearestName("estimaet", kCommands), "estimate");
  EXPECT_EQ(NearestName("LIST", kCommands), "list");
  EXPECT_EQ(NearestName("exprot", kCommands), "export");
}

TEST(NearestName, FindsAnEndingLeftOut) {
  EXPECT_EQ(NearestName("est", kCommands), "estimate");
  EXPECT_EQ(NearestName("es", kCommands), "");
}

TEST(NearestName, FindsNothingForAnotherWord) {
  EXPECT_EQ(NearestName("banana", kCommands), "");
  EXPECT_EQ(NearestName("", kCommands), "");
  EXPECT_EQ(NearestName("estimate", {}), "");
}

TEST(SuggestName, ListsWhatThereIsWhenNothingIsNear) {
  EXPECT_EQ(SuggestName("uper", {"lower", "upper"}), "did you mean \"upper\"?");
  EXPECT_EQ(SuggestName("from", {"lower", "upper"}), "known names: lower, upper");
  EXPECT_EQ(SuggestName("from", {}), "");
}

}  // namespace
}  // namespace polyest::internal
