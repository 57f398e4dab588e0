#include "server/security/file_watch.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <future>
#include <optional>
#include <utility>

#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

constexpr std::chrono::minutes kPatience{1};

TEST(FileChanges, TellsAChangeOnceWhenItHasSettled) {
  const TestFolder folder;
  const std::string file = folder.Write("tokens", "a");
  FileChanges changes({file});
  EXPECT_FALSE(changes.Poll());
  folder.Write("tokens", "ab");
  EXPECT_FALSE(changes.Poll());
  folder.Write("tokens", "abc");
  EXPECT_FALSE(changes.Poll());
  EXPECT_TRUE(changes.Poll());
  EXPECT_FALSE(changes.Poll());
}

TEST(FileChanges, SeesAFileReplacedByOneOfTheSameTimeAndSize) {
  const TestFolder folder;
  const std::string file = folder.Write("tokens", "a");
  const std::string next = folder.Write("next", "b");
  std::filesystem::last_write_time(next, std::filesystem::last_write_time(file));
  FileChanges changes({file});
  std::filesystem::rename(next, file);
  EXPECT_FALSE(changes.Poll());
  EXPECT_TRUE(changes.Poll());
}

TEST(FileChanges, SeesAFileGoAndComeBack) {
  const TestFolder folder;
  const std::string file = folder.Write("tokens", "a");
  FileChanges changes({file});
  std::filesystem::remove(file);
  EXPECT_FALSE(changes.Poll());
  EXPECT_TRUE(changes.Poll());
  folder.Write("tokens", "a");
  EXPECT_FALSE(changes.Poll());
  EXPECT_TRUE(changes.Poll());
}

TEST(FileWatch, CallsBackAndEnds) {
  const TestFolder folder;
  const std::string file = folder.Write("tokens", "a");
  FileChanges changes({file});
  folder.Write("tokens", "ab");
  std::promise<void> changed;
  const FileWatch watch(std::move(changes), std::chrono::milliseconds(1),
                        [&changed] { changed.set_value(); });
  EXPECT_EQ(changed.get_future().wait_for(kPatience), std::future_status::ready);
}

TEST(FileWatch, EndsWithoutWaitingForItsNextLook) {
  const TestFolder folder;
  std::optional<FileWatch> watch(std::in_place, FileChanges({folder.Write("tokens", "a")}),
                                 std::chrono::hours(1), [] {});
  const auto ended = std::async(std::launch::async, [&watch] { watch.reset(); });
  EXPECT_EQ(ended.wait_for(kPatience), std::future_status::ready);
}

}  // namespace
}  // namespace polyest::internal
