// Runs `polyest backup`, which brings a copy of all sessions of a daemon into a file.

#include <absl/strings/str_format.h>
#include <openssl/evp.h>
#include <sys/stat.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/plot/draft_file.h"
#include "core/common/check.h"
#include "core/common/status.h"
#include "proto/wire/check/numbers.h"

namespace polyest::internal {
namespace {

// Writes a backup, which only its owner reads, and checks that it is what the daemon has sent.
class BackupFile {
 public:
  explicit BackupFile(std::string file)
      : file_(std::move(file)), digest_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    POLYEST_CHECK(digest_ != nullptr && EVP_DigestInit_ex(digest_.get(), EVP_sha256(), nullptr));
  }

  absl::Status Open() {
    POLYEST_ASSIGN_OR_RETURN(draft_, DraftFile::Open(file_, S_IRUSR | S_IWUSR));
    return absl::OkStatus();
  }

  absl::Status Write(const std::string& bytes) {
    POLYEST_CHECK(EVP_DigestUpdate(digest_.get(), bytes.data(), bytes.size()));
    return draft_->Write(bytes);
  }

  // Replaces the file by what was written, if that is what the daemon has sent.
  absl::Status Finish(const std::string& sha256) {
    std::string own(EVP_MD_size(EVP_sha256()), '\0');
    POLYEST_CHECK(
        EVP_DigestFinal_ex(digest_.get(), reinterpret_cast<unsigned char*>(own.data()), nullptr));
    if (own != sha256) return absl::DataLossError("what arrived is not what the daemon has sent");
    return draft_->Replace();
  }

 private:
  const std::string file_;
  std::unique_ptr<DraftFile> draft_;
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> digest_;
};

absl::StatusOr<v1::BackupSummary> BackUp(const BackupArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(DraftFile::Check(arguments.output_file));
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
  out << absl::StrFormat("backed up %s with %d batches, %.1f MB, to %s\n",
                         Counted(summary->session_count(), "session"), summary->batch_count(),
                         1e-6 * static_cast<double>(summary->size_bytes()), arguments.output_file)
      << std::flush;
  for (const std::string& damage : summary->damage()) {
    err << "polyest: the daemon's journal is damaged, and so is its backup: " << damage << '\n';
  }
  return summary->damage().empty() ? kExitOk : kExitFailure;
}

}  // namespace polyest::internal
