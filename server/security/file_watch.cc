#include "server/security/file_watch.h"

#include <utility>

namespace polyest::internal {

FileChanges::FileChanges(std::vector<std::string> files)
    : files_(std::move(files)), told_(Look()), seen_(told_) {}

std::vector<FileChanges::Stamp> FileChanges::Look() const {
  std::vector<Stamp> stamps;
  for (const std::string& file : files_) {
    Stamp stamp;
    struct stat status;
    if (stat(file.c_str(), &status) == 0) {
      // This is the time of change, which nobody can set back, unlike that of modification.
      stamp = {status.st_dev, status.st_ino, status.st_size, status.st_ctim.tv_sec,
               status.st_ctim.tv_nsec};
    }
    stamps.push_back(stamp);
  }
  return stamps;
}

bool FileChanges::Poll() {
  std::vector<Stamp> now = Look();
  const bool settled = now == seen_;
  seen_ = std::move(now);
  if (!settled || seen_ == told_) return false;
  told_ = seen_;
  return true;
}

FileWatch::FileWatch(FileChanges changes, std::chrono::milliseconds interval,
                     std::function<void()> changed)
    : changes_(std::move(changes)),
      changed_(std::move(changed)),
      thread_([this, interval](const std::stop_token& stop) { Run(stop, interval); }) {}

void FileWatch::Run(const std::stop_token& stop, std::chrono::milliseconds interval) {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, stop, interval, [&stop] { return stop.stop_requested(); })) {
    if (changes_.Poll()) changed_();
  }
}

}  // namespace polyest::internal
