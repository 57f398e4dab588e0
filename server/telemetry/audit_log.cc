#include "server/telemetry/audit_log.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <google/protobuf/util/time_util.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

namespace polyest::internal {
namespace {

// Lines that are written at once.
constexpr size_t kMaxLinesAtOnce = 256;
// Time after which a disk that took nothing is tried again.
constexpr std::chrono::seconds kRetry{1};

int OpenToAppend(const std::string& file) {
  return open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
}

// Returns whether the open file is still the one of this name.
bool IsStill(int descriptor, const std::string& file) {
  struct stat open {};
  struct stat named {};
  return fstat(descriptor, &open) == 0 && stat(file.c_str(), &named) == 0 &&
         open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

}  // namespace

absl::StatusOr<std::unique_ptr<AuditLog>> AuditLog::Open(const std::string& file,
                                                         WallClock wall_clock) {
  const int descriptor = OpenToAppend(file);
  if (descriptor >= 0) {
    return std::unique_ptr<AuditLog>(new AuditLog(file, descriptor, std::move(wall_clock)));
  }
  return absl::FailedPreconditionError(
      absl::StrFormat("--audit-log: cannot write to %s: %s", file, std::strerror(errno)));
}

AuditLog::AuditLog(std::string file, int descriptor, WallClock wall_clock)
    : file_(std::move(file)),
      wall_clock_(std::move(wall_clock)),
      descriptor_(descriptor),
      thread_([this](std::stop_token stop) { Run(std::move(stop)); }) {}

AuditLog::~AuditLog() {
  thread_.request_stop();
  thread_.join();
  if (descriptor_ >= 0) close(descriptor_);
}

std::string AuditLog::LineOf(const std::string& event, const LogFields& fields) const {
  return absl::StrCat("{\"time\":\"", google::protobuf::util::TimeUtil::ToString(wall_clock_()),
                      "\",\"event\":", JsonString(event), FieldsAsJson(fields), "}\n");
}

void AuditLog::Add(const std::string& event, const LogFields& fields) {
  std::string line = LineOf(event, fields);
  const std::lock_guard lock(mutex_);
  if (lines_.size() >= kMaxLines) {
    ++lost_;
    return;
  }
  lines_.push_back(std::move(line));
  added_.notify_one();
}

void AuditLog::Run(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  while (true) {
    added_.wait(lock, stop, [this] { return !lines_.empty(); });
    if (lines_.empty()) return;
    std::string text;
    const size_t count = std::min(lines_.size(), kMaxLinesAtOnce);
    for (size_t i = 0; i < count; ++i) text += lines_[i];
    lock.unlock();
    const bool written = Write(text);
    lock.lock();
    if (written) {
      lines_.erase(lines_.begin(), lines_.begin() + static_cast<std::ptrdiff_t>(count));
      if (lost_ == 0) continue;
      lines_.push_back(LineOf("lines lost", {{"count", absl::StrCat(std::exchange(lost_, 0))}}));
    } else {
      if (stop.stop_requested()) return;
      added_.wait_for(lock, stop, kRetry, [] { return false; });
    }
  }
}

// Writes whole lines, or nothing.
bool AuditLog::Write(const std::string& text) {
  if (!OpenCurrent()) {
    Tell(false, std::strerror(errno));
    return false;
  }
  struct stat before {};
  const bool known = fstat(descriptor_, &before) == 0;
  const ssize_t written = write(descriptor_, text.data(), text.size());
  const std::string why = written < 0 ? std::strerror(errno) : "the disk is full";
  const bool whole = written == static_cast<ssize_t>(text.size());
  // Pipes and devices have nothing to sync; a disk that fails here says so at the next write.
  if (whole) fdatasync(descriptor_);
  // Half a line would spoil the next one.
  if (!whole && known && written > 0 && ftruncate(descriptor_, before.st_size) != 0) {
    Tell(false, "a line of the audit log is incomplete");
  }
  Tell(whole, why);
  return whole;
}

// Opens the file under its name if the open one is another.
bool AuditLog::OpenCurrent() {
  const bool asked = reopen_.exchange(false);
  if (descriptor_ >= 0 && !asked && IsStill(descriptor_, file_)) return true;
  const int opened = OpenToAppend(file_);
  if (opened < 0) return false;
  if (descriptor_ >= 0) close(descriptor_);
  descriptor_ = opened;
  return true;
}

// Says in the log when writing begins to fail, and when it works again.
void AuditLog::Tell(bool written, const std::string& why) {
  if (written == !failing_) return;
  failing_ = !written;
  if (failing_) {
    spdlog::error("the audit log {} cannot be written, its lines wait: {}", file_, why);
  } else {
    spdlog::info("the audit log {} is written again", file_);
  }
}

}  // namespace polyest::internal
