#pragma once

// A disk of a few megabytes that exists as long as the object: a file system in memory, which only
// this process and those that it starts can see. Needs root.

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "tests/testing/test_folder.h"

namespace polyest::internal {

class SmallDisk {
 public:
  explicit SmallDisk(int megabytes) {
    // The first disk gives this process mounts of its own, which end with it.
    static const bool own = unshare(CLONE_NEWNS) == 0 &&
                            mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
    const std::string size = "mode=0700,size=" + std::to_string(megabytes) + "m";
    mounted_ = own && mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, size.c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount2(folder_.path().c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  // Returns whether there is such a disk; only root may make one.
  bool mounted() const { return mounted_; }
  std::string operator/(const std::string& name) const { return folder_ / name; }

  // Fills what is free with a file, up to the last byte.
  void Fill() const {
    const int file = open((*this / "filler").c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    for (size_t bytes = size_t{1} << 20; bytes > 0; bytes /= 2) {
      const std::vector<char> piece(bytes, 'x');
      while (write(file, piece.data(), bytes) == static_cast<ssize_t>(bytes)) continue;
    }
    close(file);
  }
  // Removes that file.
  void Free() const { unlink((*this / "filler").c_str()); }

 private:
  const TestFolder folder_;
  bool mounted_ = false;
};

}  // namespace polyest::internal
