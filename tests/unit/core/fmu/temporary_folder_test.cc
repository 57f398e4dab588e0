#include "core/fmu/temporary_folder.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

namespace fs = std::filesystem;

class TemporaryFolderTest : public testing::Test {
 protected:
  TemporaryFolderTest() { setenv("TMPDIR", below_.path().c_str(), 1); }
  ~TemporaryFolderTest() override { unsetenv("TMPDIR"); }

  TestFolder below_;
};

TEST_F(TemporaryFolderTest, IsThereAsLongAsItIsUsed) {
  auto one = TemporaryFolder::Make().value();
  const auto other = TemporaryFolder::Make().value();
  EXPECT_TRUE(fs::is_directory(one->path()));
  EXPECT_TRUE(fs::is_directory(other->path()));
  const fs::path path = one->path();
  one = nullptr;
  EXPECT_FALSE(fs::exists(path));
  EXPECT_TRUE(fs::is_directory(other->path()));
}

TEST_F(TemporaryFolderTest, RemovesWhatADeadProcessLeftWithOrWithoutALock) {
  const std::string prefix = below_ / TemporaryFolder::kPrefix;
  for (const char* name : {"empty", "locked", "halfway"}) fs::create_directory(prefix + name);
  below_.Write(std::string(TemporaryFolder::kPrefix) + "locked/.lock", "");
  below_.Write(std::string(TemporaryFolder::kPrefix) + "halfway/model.so", "");
  fs::create_directory(below_ / "another-program");
  const auto made = TemporaryFolder::Make().value();
  for (const char* name : {"empty", "locked", "halfway"}) {
    EXPECT_FALSE(fs::exists(prefix + name)) << name;
  }
  EXPECT_TRUE(fs::exists(below_ / "another-program"));
}

TEST_F(TemporaryFolderTest, IsNotTakenForAnAbandonedOneWhileItIsMade) {
  std::atomic<int> lost{0};
  {
    std::vector<std::jthread> threads;
    for (int thread = 0; thread < 4; ++thread) {
      threads.emplace_back([&lost] {
        for (int i = 0; i < 50; ++i) {
          const auto folder = TemporaryFolder::Make();
          if (!folder.ok() || !fs::exists((*folder)->path() / ".lock")) ++lost;
        }
      });
    }
  }
  EXPECT_EQ(lost, 0);
}

}  // namespace
}  // namespace polyest::internal
