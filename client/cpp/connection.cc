#include "polyest/connection.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "core/common/status.h"
#include "proto/wire/transport/file_text.h"
#include "proto/wire/transport/loopback.h"
#include "proto/wire/transport/pem_file.h"

namespace polyest {

using namespace internal;

namespace {

grpc::ChannelArguments Arguments(const ClientOptions& options) {
  grpc::ChannelArguments arguments;
  const int keepalive_ms = static_cast<int>(options.keepalive.count());
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, keepalive_ms);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, keepalive_ms);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetMaxReceiveMessageSize(options.max_response_bytes);
  // The channel has a connection of its own, which other channels cannot block.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // A stream that reconnects has its own delays; those of the channel must not be longer.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1'000);
  // Despite its name, this is no delay but the time that an attempt to connect is given, with its
  // TLS handshake; so it may be longer than the longest delay.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 5'000);
  return arguments;
}

absl::StatusOr<PemFile> ReadClientPem(const char* option, const std::string& file) {
  auto pem = ReadPemFile(option, file);
  if (!pem.ok()) return absl::InvalidArgumentError(pem.status().message());
  return pem;
}

absl::StatusOr<std::string> ReadToken(const ClientOptions& options) {
  std::string token = options.token;
  if (!options.token_file.empty()) {
    auto text = ReadFileText(options.token_file);
    if (!text.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("token file: ", text.status().message()));
    }
    token = *std::move(text);
    absl::StripAsciiWhitespace(&token);
    if (token.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat("token file: ", options.token_file, " is empty"));
    }
  }
  // Other characters would make an invalid header, which gRPC treats as a programming error.
  if (!std::all_of(token.begin(), token.end(),
                   [](unsigned char c) { return absl::ascii_isgraph(c); })) {
    return absl::InvalidArgumentError("token: must be one word of printable ASCII characters");
  }
  return token;
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> Credentials(const ClientTls& tls) {
  if (tls.certificate_file.empty() != tls.key_file.empty()) {
    return absl::InvalidArgumentError("a client's certificate and its key must be given together");
  }
  grpc::SslCredentialsOptions options;
  if (!tls.ca_file.empty()) {
    POLYEST_ASSIGN_OR_RETURN(PemFile authorities, ReadClientPem("--tls-ca", tls.ca_file));
    POLYEST_RETURN_IF_ERROR(CheckCertificates(authorities));
    options.pem_root_certs = std::move(authorities.text);
  }
  if (!tls.certificate_file.empty()) {
    POLYEST_ASSIGN_OR_RETURN(PemFile certificate,
                             ReadClientPem("--tls-certificate", tls.certificate_file));
    POLYEST_ASSIGN_OR_RETURN(PemFile key, ReadClientPem("--tls-key", tls.key_file));
    POLYEST_RETURN_IF_ERROR(CheckCertificateAndKey(certificate, key));
    options.pem_cert_chain = std::move(certificate.text);
    options.pem_private_key = std::move(key.text);
  }
  return grpc::SslCredentials(options);
}

// Returns a hint at why no connection could be made; an empty string if there is none. gRPC and the
// TLS library report the reason only in the words of the message.
std::string ConnectionHint(absl::string_view message, const std::optional<ClientTls>& tls) {
  const auto says = [&](absl::string_view words) {
    return absl::StrContains(absl::AsciiStrToLower(message), absl::AsciiStrToLower(words));
  };
  const bool closed =
      says("Socket closed") || says("Connection reset by peer") || says("Broken pipe");
  if (!tls) {
    return closed ? "the server closed the connection without a response; if it serves TLS only, "
                    "give its CA with --tls-ca; see the daemon's log"
                  : "";
  }
  if (says("wrong version number") || says("WRONG_VERSION_NUMBER")) {
    return "the server does not use TLS: omit --tls-ca, or start the daemon with "
           "--tls-certificate and --tls-key";
  }
  if (says("certificate verify failed") || says("CERTIFICATE_VERIFY_FAILED")) {
    return "the daemon's certificate has expired or is not of the CA in --tls-ca: compare that "
           "file with the daemon's --tls-certificate";
  }
  if (says("is not in peer certificate")) {
    return "the daemon's certificate is for another name: connect by that name, or give it with "
           "--tls-server-name";
  }
  if (!closed) return "";
  return tls->certificate_file.empty()
             ? "the daemon closed the connection after the TLS handshake; it probably requires a "
               "client certificate: give yours with --tls-certificate and --tls-key; see the "
               "daemon's log"
             : "the daemon closed the connection after the TLS handshake; it probably does not "
               "trust the CA of your certificate (the daemon's --tls-client-ca); see its log";
}

}  // namespace

absl::Status WithConnectionHint(const absl::Status& status, const std::optional<ClientTls>& tls) {
  constexpr absl::string_view kNoConnection = "failed to connect to all addresses";
  if (!absl::IsUnavailable(status) || !absl::StartsWith(status.message(), kNoConnection)) {
    return status;
  }
  const std::string hint = ConnectionHint(status.message(), tls);
  return hint.empty() ? status : absl::UnavailableError(absl::StrCat(status.message(), "; ", hint));
}

// Any thread may call Current.
class DaemonConnection::TokenSource {
 public:
  TokenSource(const ClientOptions& options, std::string token)
      : options_(options), token_(std::move(token)) {}

  std::string Current() {
    const std::lock_guard lock(mutex_);
    if (options_.token_file.empty()) return token_;
    auto token = ReadToken(options_);
    if (token.ok()) token_ = *std::move(token);
    return token_;
  }

 private:
  const ClientOptions options_;
  std::mutex mutex_;
  std::string token_;
};

DaemonConnection::DaemonConnection(std::shared_ptr<grpc::Channel> channel,
                                   std::shared_ptr<TokenSource> token)
    : channel_(std::move(channel)), token_(std::move(token)) {}

absl::StatusOr<DaemonConnection> DaemonConnection::Open(const std::string& server,
                                                        const ClientOptions& options) {
  POLYEST_ASSIGN_OR_RETURN(const std::string token, ReadToken(options));
  grpc::ChannelArguments arguments = Arguments(options);
  std::shared_ptr<grpc::ChannelCredentials> credentials = grpc::InsecureChannelCredentials();
  if (options.tls) {
    POLYEST_ASSIGN_OR_RETURN(credentials, Credentials(*options.tls));
    if (!options.tls->server_name.empty()) {
      arguments.SetSslTargetNameOverride(options.tls->server_name);
    }
  } else if (!token.empty()) {
    if (!IsLoopback(server.substr(0, server.rfind(':')))) {
      return absl::InvalidArgumentError(
          absl::StrCat("token: ", server,
                       " is not a loopback address; tokens are sent only over TLS (--tls-ca)"));
    }
    // An HTTP proxy would see the token.
    arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  }
  return DaemonConnection(grpc::CreateCustomChannel(server, credentials, arguments),
                          std::make_shared<TokenSource>(options, token));
}

std::string DaemonConnection::Authorization() const {
  const std::string token = token_->Current();
  return token.empty() ? "" : absl::StrCat("Bearer ", token);
}

void DaemonConnection::Identify(grpc::ClientContext& call) const {
  const std::string authorization = Authorization();
  if (!authorization.empty()) call.AddMetadata("authorization", authorization);
}

}  // namespace polyest
