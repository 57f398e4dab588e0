// Runs `polyest backup`, which brings a copy of all sessions of a daemon into a file.

#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr size_t kSyncedAtOnce = 4 << 20;

// Writes a file that only its owner reads, first under another name, so that a backup that fails
// leaves an older one as it is.
class BackupFile {
 public:
  explicit BackupFile(std::string file)
      : file_(std::move(file)),
        draft_(file_ + ".part"),
        digest_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    POLYEST_CHECK(digest_ != nullptr && EVP_DigestInit_ex(digest_.get(), EVP_sha256(), nullptr));
  }
  ~BackupFile() {
    if (descriptor_ < 0) return;
    close(descriptor_);
    std::remove(draft_.c_str());
  }
  BackupFile(const BackupFile&) = delete;
  BackupFile& operator=(const BackupFile&) = delete;

  absl::Status Open() {
    std::remove(draft_.c_str());
    descriptor_ = open(draft_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
    return descriptor_ < 0 ? Failed() : absl::OkStatus();
  }

  absl::Status Write(const std::string& bytes) {
    POLYEST_CHECK(EVP_DigestUpdate(digest_.get(), bytes.data(), bytes.size()));
    size_t written = 0;
    while (written < bytes.size()) {
      const ssize_t more = write(descriptor_, bytes.data() + written, bytes.size() - written);
      if (more < 0 && errno == EINTR) continue;
      if (more <= 0) return Failed();
      written += static_cast<size_t>(more);
    }
    // The daemon may have its sessions on the same disk: its commits wait for little at a time.
    unsynced_ += bytes.size();
    if (unsynced_ >= kSyncedAtOnce) {
      unsynced_ = 0;
      if (fdatasync(descriptor_) != 0) return Failed();
    }
    return absl::OkStatus();
  }

  // Replaces the file by what was written, if that is what the daemon has sent.
  absl::Status Finish(const std::string& sha256) {
    std::string own(EVP_MD_size(EVP_sha256()), '\0');
    POLYEST_CHECK(
        EVP_DigestFinal_ex(digest_.get(), reinterpret_cast<unsigned char*>(own.data()), nullptr));
    if (own != sha256) return absl::DataLossError("what arrived is not what the daemon has sent");
    if (fsync(descriptor_) != 0 || std::rename(draft_.c_str(), file_.c_str()) != 0) return Failed();
    close(std::exchange(descriptor_, -1));
    return absl::OkStatus();
  }

 private:
  absl::Status Failed() const {
    return absl::InvalidArgumentError(
        absl::StrFormat("%s: cannot be written: %s", draft_, std::strerror(errno)));
  }

  const std::string file_;
  const std::string draft_;
  int descriptor_ = -1;
  size_t unsynced_ = 0;
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> digest_;
};

absl::StatusOr<v1::BackupSummary> BackUp(const BackupArguments& arguments) {
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  v1::BackupSummary summary;
  std::optional<std::string> sha256;
  BackupFile file(arguments.output_file);
  const auto take = [&](const v1::DownloadBackupResponse& part) -> absl::Status {
    if (part.has_summary()) {
      summary = part.summary();
      return file.Open();
    }
    if (part.has_end()) sha256 = part.end().sha256();
    return file.Write(part.chunk());
  };
  POLYEST_RETURN_IF_ERROR(client.DownloadBackup({}, take));
  if (!sha256) return absl::DataLossError("the daemon has not sent the whole backup");
  POLYEST_RETURN_IF_ERROR(file.Finish(*sha256));
  return summary;
}

}  // namespace

int RunCommand(const BackupArguments& arguments, std::ostream& out, std::ostream& err) {
  const auto summary = BackUp(arguments);
  if (!summary.ok()) return Report(summary.status(), arguments.place.server, err);
  out << absl::StrFormat("backed up %d sessions with %d batches, %.1f MB, to %s\n",
                         summary->session_count(), summary->batch_count(),
                         1e-6 * static_cast<double>(summary->size_bytes()), arguments.output_file)
      << std::flush;
  for (const std::string& damage : summary->damage()) {
    err << "polyest: the daemon's journal is damaged, and so is its backup: " << damage << '\n';
  }
  return summary->damage().empty() ? kExitOk : kExitFailure;
}

}  // namespace polyest::internal
