#include "server/journal/session_seals.h"

#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <string_view>
#include <utility>

#include "core/common/status.h"
#include "server/digest/digest.h"

namespace polyest::internal {
namespace {

// A place in the file: session, from and sequence as 64-bit numbers of this machine, the chain, the
// head, the label with zeros behind it, and the digest of all that. No sector of a disk divides it.
constexpr size_t kPlace = 256;
constexpr size_t kDigest = 32;
constexpr size_t kNumbers = 3 * sizeof(int64_t);
constexpr size_t kLabel = kPlace - kNumbers - 3 * kDigest;
// Longest time for which a seal may be in the operating system's memory only.
constexpr std::chrono::seconds kSyncInterval{1};

std::string Encode(const Seal& seal) {
  std::string record(kNumbers, '\0');
  const int64_t numbers[] = {seal.session, seal.from, seal.sequence};
  std::memcpy(record.data(), numbers, kNumbers);
  record += seal.chain;
  record += seal.head;
  record.resize(kNumbers + 2 * kDigest);
  record += seal.label.substr(0, kLabel);
  record.resize(kPlace - kDigest);
  return record + Digest(record);
}

// Returns nothing for a place whose digest is wrong.
std::optional<Seal> Decode(std::string_view record) {
  const std::string_view sealed = record.substr(0, kPlace - kDigest);
  if (Digest(sealed) != record.substr(kPlace - kDigest)) return std::nullopt;
  int64_t numbers[3];
  std::memcpy(numbers, record.data(), kNumbers);
  const std::string_view label = sealed.substr(kNumbers + 2 * kDigest);
  return Seal{.session = numbers[0],
              .label = std::string(label.substr(0, label.find('\0'))),
              .head = std::string(sealed.substr(kNumbers + kDigest, kDigest)),
              .from = numbers[1],
              .sequence = numbers[2],
              .chain = std::string(sealed.substr(kNumbers, kDigest))};
}

}  // namespace

Seal Seal::At(int64_t session, std::string label, std::string head, int64_t sequence) {
  return {.session = session,
          .label = std::move(label),
          .head = std::move(head),
          .from = sequence,
          .sequence = sequence,
          .chain = std::string(kDigest, '\0')};
}

void Seal::Add(int64_t next, const std::string& digest) {
  if (next != sequence + 1) *this = At(session, std::move(label), std::move(head), next - 1);
  chain = Digest(chain + digest);
  sequence = next;
}

absl::StatusOr<std::unique_ptr<SessionSeals>> SessionSeals::Open(const std::string& file) {
  const bool made = access(file.c_str(), F_OK) != 0;
  const int descriptor = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (descriptor < 0) {
    return absl::FailedPreconditionError(
        absl::StrFormat("cannot open the file %s: %s", file, std::strerror(errno)));
  }
  std::unique_ptr<SessionSeals> seals(new SessionSeals(descriptor, made));
  const absl::Status read = seals->ReadAll();
  if (!read.ok()) {
    return absl::FailedPreconditionError(
        absl::StrFormat("cannot read the file %s: %s", file, read.message()));
  }
  return seals;
}

SessionSeals::SessionSeals(int descriptor, bool made)
    : descriptor_(descriptor),
      made_(made),
      syncing_([this](std::stop_token stop) { SyncLater(std::move(stop)); }) {}

SessionSeals::~SessionSeals() {
  syncing_.request_stop();
  syncing_.join();
  Sync();
  close(descriptor_);
}

absl::Status SessionSeals::ReadAll() {
  const std::lock_guard lock(mutex_);
  std::string record(kPlace, '\0');
  for (;; ++end_) {
    const ssize_t size =
        pread(descriptor_, record.data(), kPlace, end_ * static_cast<off_t>(kPlace));
    if (size < 0) return absl::UnavailableError(std::strerror(errno));
    if (size < static_cast<ssize_t>(kPlace)) return absl::OkStatus();
    std::optional<Seal> seal = Decode(record);
    if (seal && seal->session > 0) {
      slots_[seal->session] = end_;
      seals_[seal->session] = *std::move(seal);
    } else {
      free_.insert(end_);
      if (record != std::string(kPlace, '\0')) ++damaged_;
    }
  }
}

std::vector<Seal> SessionSeals::All() const {
  const std::lock_guard lock(mutex_);
  std::vector<Seal> all;
  for (const auto& [session, seal] : seals_) all.push_back(seal);
  return all;
}

std::optional<Seal> SessionSeals::Of(int64_t session) const {
  const std::lock_guard lock(mutex_);
  const auto found = seals_.find(session);
  if (found == seals_.end()) return std::nullopt;
  return found->second;
}

void SessionSeals::Put(const Seal& seal) {
  const std::lock_guard lock(mutex_);
  auto slot = slots_.find(seal.session);
  if (slot == slots_.end()) {
    const int64_t place = free_.empty() ? end_++ : free_.extract(free_.begin()).value();
    slot = slots_.emplace(seal.session, place).first;
  }
  seals_[seal.session] = seal;
  Write(slot->second, Encode(seal));
}

void SessionSeals::Remove(int64_t session) {
  const std::lock_guard lock(mutex_);
  const auto slot = slots_.find(session);
  if (slot == slots_.end()) return;
  Write(slot->second, std::string(kPlace, '\0'));
  free_.insert(slot->second);
  slots_.erase(slot);
  seals_.erase(session);
}

// Called with the mutex held.
void SessionSeals::Write(int64_t slot, const std::string& record) {
  // What cannot be written, on a full disk for instance, leaves the seal behind the database.
  const ssize_t written =
      pwrite(descriptor_, record.data(), record.size(), slot * static_cast<off_t>(kPlace));
  static_cast<void>(written);
  dirty_ = true;
  changed_.notify_one();
}

void SessionSeals::Sync() {
  {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(dirty_, false)) return;
  }
  fdatasync(descriptor_);
}

void SessionSeals::SyncLater(std::stop_token stop) {
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [this] { return dirty_; });
      changed_.wait_for(lock, stop, kSyncInterval, [] { return false; });
    }
    Sync();
  }
}

}  // namespace polyest::internal
