// The daemon's secrets: tokens, certificates, and what it shares with other daemons.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <utility>
#include <vector>

#include "core/common/status.h"
#include "server/daemon/daemon.h"

namespace polyest::internal {
namespace {

// Time between two looks at the files of tokens and certificates. A change is acted on when a
// second look finds that it has settled.
constexpr std::chrono::seconds kWatchInterval{1};

absl::StatusOr<NodeSecret> ReadNodeSecret(const std::string& file) {
  auto secret = NodeSecret::Read(file);
  if (secret.ok()) return secret;
  return absl::Status(secret.status().code(),
                      absl::StrFormat("--node-secret: %s", secret.status().message()));
}

}  // namespace

void Daemon::WarnOfReadableSecrets() const {
  for (const std::string& file : {options_.token_file, options_.tls.key, options_.node_secret}) {
    struct stat status {};
    if (file.empty() || stat(file.c_str(), &status) != 0 || (status.st_mode & S_IRWXO) == 0) {
      continue;
    }
    spdlog::warn("{} is open to all users of this machine (mode {:04o}); chmod 0640 it", file,
                 static_cast<unsigned>(status.st_mode & 07777));
  }
}

absl::Status Daemon::Secure() {
  std::vector<std::string> files;
  for (const std::string& file : {options_.token_file, options_.tls.certificate, options_.tls.key,
                                  options_.tls.client_ca, options_.node_ca}) {
    if (!file.empty()) files.push_back(file);
  }
  if (!files.empty()) file_changes_.emplace(std::move(files));
  AccessOptions access{options_.token_file, !options_.tls.client_ca.empty(), options_.behind_edge};
  if (!options_.node_secret.empty()) {
    POLYEST_ASSIGN_OR_RETURN(access.nodes, ReadNodeSecret(options_.node_secret));
  }
  POLYEST_ASSIGN_OR_RETURN(access_, AccessControl::Open(std::move(access)));
  if (!options_.tls.certificate.empty()) {
    POLYEST_ASSIGN_OR_RETURN(tls_, ServerTls::Open(options_.tls));
  }
  if (!options_.node_secret.empty()) {
    POLYEST_ASSIGN_OR_RETURN(auto channels,
                             NodeChannels::Open({.ca = options_.node_ca, .tls = options_.tls}));
    nodes_ = std::make_unique<NodeForwarder>(*access_, std::move(channels));
  }
  WarnOfReadableSecrets();
  return absl::OkStatus();
}

void Daemon::WatchFiles() {
  if (!file_changes_) return;
  watch_ =
      std::make_unique<FileWatch>(*std::move(file_changes_), kWatchInterval, [this] { Reload(); });
}

void Daemon::Reload() {
  const std::lock_guard lock(reloading_);
  WarnOfReadableSecrets();
  if (audit_ != nullptr) audit_->Reopen();
  const auto report = [this](const char* what, const absl::Status& status) {
    if (audit_ != nullptr) {
      audit_->Add(absl::StrCat(what, " read again"),
                  {{"code", absl::StatusCodeToString(status.code())}});
    }
    if (status.ok()) {
      spdlog::info("{} read again", what);
    } else {
      spdlog::warn("{} not read again, the old ones stay: {}", what, std::string(status.message()));
    }
  };
  if (!options_.token_file.empty()) report("tokens", access_->Reload());
  if (tls_ != nullptr) report("certificates", tls_->Reload());
  if (!options_.node_ca.empty()) report("certificates of --node-ca", nodes_->Reload());
  if (tls_ != nullptr && web_ != nullptr) report("certificates of --web", web_->ReloadTls());
  if (tls_ != nullptr && umbridge_ != nullptr) {
    report("certificates of --umbridge", umbridge_->ReloadTls());
  }
}

}  // namespace polyest::internal
