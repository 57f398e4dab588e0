#include "server/security/server_tls.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr unsigned kPollInterval_s = 1;  // the shortest interval that gRPC takes

absl::Status Failed(const char* what) {
  return absl::InternalError(absl::StrCat(what, ": ", std::strerror(errno)));
}

bool WriteAll(int descriptor, const std::string& text) {
  size_t written = 0;
  while (written < text.size()) {
    const ssize_t count = write(descriptor, text.data() + written, text.size() - written);
    if (count < 0) return false;
    written += static_cast<size_t>(count);
  }
  return true;
}

}  // namespace

ServerTls::MemoryFile::~MemoryFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

absl::Status ServerTls::MemoryFile::Replace(const std::string& text) {
  const int next = memfd_create("polyest-tls", MFD_CLOEXEC);
  if (next < 0) return Failed("memfd_create");
  absl::Status status;
  if (!WriteAll(next, text)) status = Failed("a file in memory");
  if (descriptor_ < 0) {
    descriptor_ = next;
    return status;
  }
  // Whoever opens the path finds the old file or the new one, never a part.
  if (status.ok() && dup3(next, descriptor_, O_CLOEXEC) < 0) status = Failed("dup3");
  close(next);
  return status;
}

std::string ServerTls::MemoryFile::path() const {
  return absl::StrCat("/proc/self/fd/", descriptor_);
}

absl::StatusOr<std::unique_ptr<ServerTls>> ServerTls::Open(TlsFiles files) {
  std::unique_ptr<ServerTls> tls(new ServerTls(std::move(files)));
  POLYEST_RETURN_IF_ERROR(tls->Reload());
  return tls;
}

absl::Status ServerTls::Reload() {
  POLYEST_ASSIGN_OR_RETURN(const TlsMaterial material, ReadTlsMaterial(files_));
  POLYEST_RETURN_IF_ERROR(certificate_.Replace(material.certificate));
  POLYEST_RETURN_IF_ERROR(key_.Replace(material.key));
  if (files_.client_ca.empty()) return absl::OkStatus();
  return client_ca_.Replace(material.client_ca);
}

std::shared_ptr<grpc::ServerCredentials> ServerTls::Credentials() const {
  using grpc::experimental::FileWatcherCertificateProvider;
  const bool mutual = !files_.client_ca.empty();
  grpc::experimental::TlsServerCredentialsOptions options(
      std::make_shared<FileWatcherCertificateProvider>(
          key_.path(), certificate_.path(), mutual ? client_ca_.path() : "", kPollInterval_s));
  options.watch_identity_key_cert_pairs();
  if (mutual) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(options);
}

}  // namespace polyest::internal
