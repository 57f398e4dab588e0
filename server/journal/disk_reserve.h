#pragma once

// Holds room on the disk for the moment when the disk is full: a file that is given up then, so
// that sessions can still be deleted and the write-ahead log can be copied into the database, and
// that is made again when there is room.

#include <absl/status/status.h>

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

namespace polyest::internal {

// Thread-safe.
class DiskReserve {
 public:
  // Size of the reserve; on a small disk it is the given share of the disk, and at most as large as
  // a file may be. The log has to fit into half of it.
  static constexpr int64_t kMaxBytes = int64_t{64} << 20;
  static constexpr int64_t kShareOfDisk = 8;

  // Makes the file, for its owner only, without any room; an older file gives up what it has. If
  // the file cannot be made, there never is a reserve.
  explicit DiskReserve(const std::string& file);
  ~DiskReserve();
  DiskReserve(const DiskReserve&) = delete;
  DiskReserve& operator=(const DiskReserve&) = delete;

  // Returns the size that the reserve should have.
  int64_t bytes() const { return bytes_; }
  // Says how much of the reserve there is. Half is enough while the database does not grow, because
  // it has room for new data within: the other half is then for the log.
  enum class Held { kNothing, kHalf, kAll };
  Held held() const { return held_; }
  // Frees the room for use. Returns false, and does nothing, if there is no reserve, or if the disk
  // has as much room besides.
  bool GiveUp();
  // Takes what is missing, if half as much as the reserve then has remains free. Takes half of the
  // reserve if there is no room for all of it and the database has as many `reusable` bytes for new
  // data as the reserve should have.
  Held TakeBack(int64_t reusable);

 private:
  int64_t FreeBytes() const;
  bool Allocate(int64_t bytes);

  const int descriptor_;
  int64_t bytes_ = kMaxBytes;
  std::mutex mutex_;
  std::atomic<Held> held_ = Held::kNothing;
};

}  // namespace polyest::internal
