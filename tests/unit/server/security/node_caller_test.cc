#include "server/security/node_caller.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

TEST(NodeSecretTest, IsTheOnlyLineOfItsFile) {
  const TestFolder folder;
  const std::string text(32, 'x');
  const auto secret = NodeSecret::Read(folder.Write("secret", text + "\n"));
  ASSERT_TRUE(secret.ok()) << secret.status();
  EXPECT_TRUE(secret->IsSame(text));
  EXPECT_FALSE(secret->IsSame(text + "x"));
  EXPECT_FALSE(secret->IsSame(""));
}

TEST(NodeSecretTest, IsLongEnoughAndPrintable) {
  const TestFolder folder;
  for (const std::string& bad :
       {std::string(), std::string(31, 'x'), std::string(257, 'x'), std::string(32, 'x') + " x",
        std::string(32, 'x') + "\nx", std::string(31, 'x') + "\x80"}) {
    const absl::Status refused = NodeSecret::Read(folder.Write("secret", bad)).status();
    EXPECT_TRUE(absl::IsInvalidArgument(refused)) << bad;
    EXPECT_THAT(refused.message(), HasSubstr("one line of 32 to 256 printable characters"));
  }
  EXPECT_TRUE(absl::IsNotFound(NodeSecret::Read(folder / "none").status()));
}

TEST(NodeCallerTest, IsToldWithTheSecret) {
  const TestFolder folder;
  const std::string text(32, 'x');
  const auto secret = NodeSecret::Read(folder.Write("secret", text));
  ASSERT_TRUE(secret.ok()) << secret.status();
  EXPECT_THAT(MetadataOf({"ipv4:192.0.2.7:1", "rig"}, *secret),
              UnorderedElementsAre(Pair("x-polyest-node-secret", text),
                                   Pair("x-polyest-node-peer", "ipv4:192.0.2.7:1"),
                                   Pair("x-polyest-node-certificate", "rig")));
}

}  // namespace
}  // namespace polyest::internal
