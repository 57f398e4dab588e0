#include "server/daemon/web_options.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "server/security/exposure.h"

namespace polyest::internal {
namespace {

// Returns whether a text may be the host of a request: a name or an address without a port.
bool IsHostName(const std::string& text) {
  const bool bracketed = text.starts_with('[') && text.ends_with(']');
  return !text.empty() && std::all_of(text.begin(), text.end(), [&](unsigned char c) {
    return absl::ascii_isalnum(c) || c == '.' || c == '-' || c == '_' ||
           (bracketed && (c == ':' || c == '[' || c == ']'));
  });
}

// Returns the address of a port; none if the text is empty.
absl::StatusOr<std::optional<ListenAddress>> HttpAddress(const std::string& text,
                                                         const char* option, bool insecure,
                                                         const DaemonOptions& daemon) {
  if (text.empty()) return std::optional<ListenAddress>();
  POLYEST_ASSIGN_OR_RETURN(ListenAddress address, ListenAddress::Parse(text, option));
  POLYEST_RETURN_IF_ERROR(
      CheckExposure({.host = address.host,
                     .tls = !daemon.tls.certificate.empty(),
                     .authentication = !daemon.token_file.empty() || !daemon.tls.client_ca.empty(),
                     .insecure = insecure,
                     .option = option}));
  // A port is on one address, and browsers find this one under both names.
  if (address.host == "localhost") address.host = "127.0.0.1";
  return std::optional(std::move(address));
}

}  // namespace

void AddWebOptions(CLI::App& app, WebTexts& texts) {
  app.add_option("--web", texts.address,
                 "HOST:PORT of the live page and of the calls as JSON over HTTP; port 0 picks a "
                 "free one. Encrypted, and open to the same callers, as --listen. By default "
                 "nowhere");
  app.add_option("--umbridge", texts.umbridge,
                 "HOST:PORT at which each session is a model of the UM-Bridge protocol: the log "
                 "posterior and the log likelihood over its parameters, with derivatives; port 0 "
                 "picks a free one. Encrypted, and open to the same callers, as --listen. By "
                 "default nowhere");
  app.add_option(
         "--web-host", texts.hosts,
         "Another name by which clients may call --web and --umbridge, such as that of a proxy; "
         "repeat the option, or separate by commas, for several. Loopback and the address of "
         "either need none")
      ->delimiter(',')
      ->allow_extra_args(false);
}

absl::Status ApplyWebOptions(const WebTexts& texts, bool insecure, DaemonOptions& daemon) {
  for (const std::string& host : texts.hosts) {
    if (!IsHostName(host)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "--web-host: \"", host, "\" must be a host without a port, as in rig.example.org"));
    }
  }
  if (texts.address.empty() && texts.umbridge.empty() && !texts.hosts.empty()) {
    return absl::InvalidArgumentError("--web-host: needs --web or --umbridge");
  }
  daemon.web_hosts = texts.hosts;
  POLYEST_ASSIGN_OR_RETURN(daemon.web, HttpAddress(texts.address, "--web", insecure, daemon));
  POLYEST_ASSIGN_OR_RETURN(daemon.umbridge,
                           HttpAddress(texts.umbridge, "--umbridge", insecure, daemon));
  return absl::OkStatus();
}

}  // namespace polyest::internal
