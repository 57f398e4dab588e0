// Tests that the audit log loses no line to rotation, and stands a full disk.

#include "server/telemetry/audit_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <sstream>
#include <thread>

#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr std::chrono::minutes kPatience{1};

google::protobuf::Timestamp NewYear() {
  google::protobuf::Timestamp time;
  time.set_seconds(1767225600);
  return time;
}

class AuditLogTest : public testing::Test {
 protected:
  static std::string Read(const std::string& file) {
    std::ifstream in(file);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  // Returns whether the file comes to have the text.
  static bool Await(const std::string& file, const std::string& text) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (Read(file).find(text) == std::string::npos) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::yield();
    }
    return true;
  }

  const TestFolder folder_;
  const std::string file_ = folder_ / "audit.log";
};

TEST_F(AuditLogTest, HasALineForEachEventForItsOwnerOnly) {
  {
    const auto audit = AuditLog::Open(file_, NewYear).value();
    audit->Add("call",
               {{"method", "DeleteSession"}, {"session", "sessions/\"a\"\n"}, {"role", ""}});
    audit->Add("stopping", {});
  }
  EXPECT_EQ(Read(file_),
            "{\"time\":\"2026-01-01T00:00:00Z\",\"event\":\"call\",\"method\":\"DeleteSession\","
            "\"session\":\"sessions/\\\"a\\\"\\n\"}\n"
            "{\"time\":\"2026-01-01T00:00:00Z\",\"event\":\"stopping\"}\n");
  EXPECT_EQ(fs::status(file_).permissions(), fs::perms(0600));
  // A later daemon goes on.
  AuditLog::Open(file_, NewYear).value()->Add("started", {});
  EXPECT_THAT(Read(file_), HasSubstr("stopping\"}\n{\"time\":\"2026-01-01T00:00:00Z\",\"event\":"
                                     "\"started\"}\n"));
}

TEST_F(AuditLogTest, GoesOnInANewFileAfterRotation) {
  const auto audit = AuditLog::Open(file_, NewYear).value();
  audit->Add("first", {});
  ASSERT_TRUE(Await(file_, "first"));
  fs::rename(file_, file_ + ".1");
  audit->Add("second", {});
  ASSERT_TRUE(Await(file_, "second"));
  fs::copy(file_, file_ + ".2");
  fs::remove(file_);
  audit->Reopen();
  audit->Add("third", {});
  ASSERT_TRUE(Await(file_, "third"));
  EXPECT_THAT(Read(file_ + ".1"), HasSubstr("first"));
  EXPECT_THAT(Read(file_), testing::Not(HasSubstr("second")));
}

TEST_F(AuditLogTest, WaitsForAFullDiskAndCountsWhatItCouldNotHold) {
  fs::create_symlink("/dev/full", file_);
  {
    const auto audit = AuditLog::Open(file_, NewYear).value();
    for (size_t i = 0; i < AuditLog::kMaxLines + 7; ++i) audit->Add("call", {});
    // Somebody makes room.
    fs::remove(file_);
    ASSERT_TRUE(Await(file_, "lines lost"));
  }
  const std::string text = Read(file_);
  EXPECT_EQ(static_cast<size_t>(std::count(text.begin(), text.end(), '\n')),
            AuditLog::kMaxLines + 1);
  EXPECT_THAT(text, HasSubstr(",\"event\":\"lines lost\",\"count\":\"7\"}\n"));
}

TEST_F(AuditLogTest, EndsThoughTheDiskIsFull) {
  fs::create_symlink("/dev/full", file_);
  auto audit = AuditLog::Open(file_, NewYear).value();
  audit->Add("call", {});
  const auto ended = std::async(std::launch::async, [&audit] { audit = nullptr; });
  EXPECT_EQ(ended.wait_for(kPatience), std::future_status::ready);
}

TEST_F(AuditLogTest, NamesAFileThatItCannotWrite) {
  const auto audit = AuditLog::Open(folder_ / "none/audit.log", NewYear);
  EXPECT_TRUE(absl::IsFailedPrecondition(audit.status()));
  EXPECT_THAT(std::string(audit.status().message()), HasSubstr("none/audit.log"));
}

}  // namespace
}  // namespace polyest::internal
