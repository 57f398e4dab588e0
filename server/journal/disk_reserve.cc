#include "server/journal/disk_reserve.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <vector>

namespace polyest::internal {
namespace {

// Bytes that are written at once where the file system cannot set room aside.
constexpr size_t kPiece = size_t{1} << 20;

// Returns the size that a file of this process may have (ulimit -f).
int64_t LargestFile() {
  struct rlimit limit {};
  if (getrlimit(RLIMIT_FSIZE, &limit) != 0) return std::numeric_limits<int64_t>::max();
  return static_cast<int64_t>(
      std::min<rlim_t>(limit.rlim_cur, std::numeric_limits<int64_t>::max()));
}

int64_t Bytes(fsblkcnt_t blocks, const struct statvfs& disk) {
  return static_cast<int64_t>(blocks) * static_cast<int64_t>(disk.f_frsize);
}

}  // namespace

DiskReserve::DiskReserve(const std::string& file)
    : descriptor_(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR)) {
  struct statvfs disk {};
  if (descriptor_ < 0 || ftruncate(descriptor_, 0) != 0 || fstatvfs(descriptor_, &disk) != 0) {
    spdlog::warn("the file {} cannot be made: on a full disk no session can be deleted", file);
    bytes_ = 0;
    held_ = Held::kAll;
    return;
  }
  bytes_ = std::min({kMaxBytes, Bytes(disk.f_blocks, disk) / kShareOfDisk, LargestFile()});
}

DiskReserve::~DiskReserve() {
  if (descriptor_ >= 0) close(descriptor_);
}

int64_t DiskReserve::FreeBytes() const {
  struct statvfs disk {};
  return fstatvfs(descriptor_, &disk) == 0 ? Bytes(disk.f_bavail, disk) : 0;
}

bool DiskReserve::GiveUp() {
  const std::lock_guard lock(mutex_);
  if (held_ == Held::kNothing || FreeBytes() >= bytes_ || ftruncate(descriptor_, 0) != 0) {
    return false;
  }
  held_ = Held::kNothing;
  return true;
}

DiskReserve::Held DiskReserve::TakeBack(int64_t reusable) {
  const std::lock_guard lock(mutex_);
  if (held_ == Held::kAll) return held_;
  const int64_t half = bytes_ / 2;
  const int64_t room = FreeBytes() + (held_ == Held::kHalf ? half : 0);
  if (room >= bytes_ + half) {
    held_ = Allocate(bytes_) ? Held::kAll : Held::kNothing;
  } else if (held_ == Held::kNothing && reusable >= bytes_ && room >= half + half / 2) {
    if (Allocate(half)) held_ = Held::kHalf;
  }
  return held_;
}

// Takes so much room, or none.
bool DiskReserve::Allocate(int64_t bytes) {
  if (fallocate(descriptor_, 0, 0, static_cast<off_t>(bytes)) == 0) return true;
  if (errno == EOPNOTSUPP) {
    // Bytes that no file system stores in less room than they have.
    std::vector<char> piece(kPiece);
    uint32_t state = 1;
    for (char& byte : piece) byte = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
    int64_t written = 0;
    while (written < bytes) {
      const ssize_t some = pwrite(descriptor_, piece.data(), piece.size(), written);
      if (some <= 0) break;
      written += some;
    }
    if (written >= bytes && fdatasync(descriptor_) == 0) return true;
  }
  if (ftruncate(descriptor_, 0) != 0) spdlog::warn("the reserve on the disk cannot be given up");
  return false;
}

}  // namespace polyest::internal
