#include "client/plot/draft_file.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

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

// Writes a file as commands do.
absl::Status WriteNew(const std::string& path) {
  const auto draft = DraftFile::Open(path, 0600);
  if (!draft.ok()) return draft.status();
  const absl::Status written = (*draft)->Write("new");
  return written.ok() ? (*draft)->Replace() : written;
}

TEST(DraftFile, FollowsLinksAlsoToNothing) {
  const TestFolder folder, other;
  const std::string target = other.Write("x", "old"), link = folder / "link";
  std::filesystem::create_symlink(target, link);
  std::filesystem::create_symlink("later", folder / "ahead");
  ASSERT_TRUE(WriteNew(link).ok());
  ASSERT_TRUE(WriteNew(folder / "ahead").ok());
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(Content(target), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "ahead"));
  EXPECT_EQ(Content(folder / "later"), "new");
}

TEST(DraftFile, LeavesAFileOfItsOwnNameAlone) {
  const TestFolder folder;
  const std::string path = folder / "x", part = folder.Write("x.part", "another's");
  ASSERT_TRUE(WriteNew(path).ok());
  EXPECT_EQ(Content(path), "new");
  EXPECT_EQ(Content(part), "another's");
}

TEST(DraftFile, WritesToDevicesAndPipesAndReplacesNone) {
  const TestFolder folder;
  std::filesystem::create_symlink("/dev/null", folder / "null");
  EXPECT_TRUE(WriteNew(folder / "null").ok());
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_EQ(WriteNew("/dev/full").message(), "cannot write /dev/full: No space left on device");
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  EXPECT_TRUE(WriteNew(pipe).ok());
  char bytes[4] = {};
  EXPECT_EQ(read(reader, bytes, sizeof(bytes)), 3);
  close(reader);
  EXPECT_STREQ(bytes, "new");
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

TEST(DraftFile, RefusesFoldersAtOnce) {
  const TestFolder folder;
  const std::string message = "cannot write " + folder.path() + ": Is a directory";
  EXPECT_EQ(DraftFile::Open(folder.path(), 0600).status().message(), message);
  EXPECT_EQ(DraftFile::Check(folder.path()).message(), message);
  EXPECT_FALSE(std::filesystem::exists(folder.path() + ".part"));
}

TEST(DraftFile, PermitsNoMoreThanTheFileBefore) {
  const TestFolder folder;
  const std::string path = folder.Write("x", "old");
  std::filesystem::permissions(path, std::filesystem::perms(0640));
  const auto draft = DraftFile::Open(path, 0666);
  ASSERT_TRUE(draft.ok() && (*draft)->Replace().ok());
  EXPECT_EQ(std::filesystem::status(path).permissions(), std::filesystem::perms(0640));
}

// The command is ended by the signal, as without a draft.
TEST(DraftFile, IsRemovedByASignalThatEndsTheProcess) {
  const TestFolder folder;
  const std::string path = folder.Write("x", "old");
  for (const int number : {SIGHUP, SIGINT, SIGTERM}) {
    const pid_t process = fork();
    if (process == 0) {
      const auto draft = DraftFile::Open(path, 0600);
      if (!draft.ok() || !std::filesystem::exists(path + ".part")) _exit(1);
      raise(number);
      _exit(2);
    }
    int state = 0;
    ASSERT_EQ(waitpid(process, &state, 0), process);
    EXPECT_TRUE(WIFSIGNALED(state) && WTERMSIG(state) == number) << state;
    EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  }
  EXPECT_EQ(Content(path), "old");
}

TEST(DraftFile, LeavesAnIgnoredSignalIgnored) {
  const TestFolder folder;
  struct sigaction action = {};
  signal(SIGINT, SIG_IGN);
  ASSERT_TRUE(DraftFile::Open(folder / "x", 0600).ok());
  sigaction(SIGINT, nullptr, &action);
  EXPECT_EQ(action.sa_handler, SIG_IGN);
  signal(SIGINT, SIG_DFL);
  ASSERT_TRUE(DraftFile::Open(folder / "x", 0600).ok());
  sigaction(SIGINT, nullptr, &action);
  EXPECT_EQ(action.sa_handler, SIG_DFL);
}

}  // namespace
}  // namespace polyest::internal::draft_file_test
