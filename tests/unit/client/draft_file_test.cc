#include "client/cli/draft_file.h"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/testing/test_folder.h"

namespace polyest::internal::draft_file_test {
namespace {

using ::testing::ElementsAre;

// What was brought to the disk, and what FILE held then: "path: content". Its test sets `file`.
std::string file;
std::vector<std::string> synced;

std::string Content(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void Note(int descriptor) {
  const auto path = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor));
  synced.push_back(path.filename().string() + ": " + Content(file));
}

}  // namespace
}  // namespace polyest::internal::draft_file_test

// Replaces the system's function in the whole program.
extern "C" int fsync(int descriptor) {
  using namespace polyest::internal::draft_file_test;
  if (!file.empty()) Note(descriptor);
  static const auto real = reinterpret_cast<int (*)(int)>(dlsym(RTLD_NEXT, "fsync"));
  return real(descriptor);
}

namespace polyest::internal::draft_file_test {
namespace {

TEST(DraftFile, IsOnTheDiskBeforeItReplacesTheFileAndItsFolderAfter) {
  const TestFolder folder;
  file = folder.Write("x", "old");
  auto draft = DraftFile::Open(file, 0600);
  ASSERT_TRUE(draft.ok()) << draft.status();
  ASSERT_TRUE((*draft)->Write("ne").ok());
  ASSERT_TRUE((*draft)->Write("w").ok());
  EXPECT_EQ(Content(folder / "x.part"), "new");
  ASSERT_TRUE((*draft)->Replace().ok());
  const std::string name = std::filesystem::path(folder.path()).filename();
  EXPECT_THAT(synced, ElementsAre("x.part: old", name + ": new"));
  EXPECT_FALSE(std::filesystem::exists(folder / "x.part"));
  file.clear();
}

TEST(DraftFile, LeavesTheFileAsItIsIfItIsNotFinished) {
  const TestFolder folder;
  const std::string path = folder.Write("x", "old");
  ASSERT_TRUE((*DraftFile::Open(path, 0600))->Write("new").ok());
  EXPECT_EQ(Content(path), "old");
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

}  // namespace
}  // namespace polyest::internal::draft_file_test
