#include "server/journal/postgres_target.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <map>
#include <memory>

#include "core/common/status.h"
#include "server/journal/libpq.h"

namespace polyest::internal {
namespace {

using Settings = std::map<std::string, std::string>;

Settings SettingsOf(const PQconninfoOption* option) {
  Settings settings;
  for (; option->keyword != nullptr; ++option) {
    if (option->val != nullptr) settings[option->keyword] = option->val;
  }
  return settings;
}

bool HasGoodPort(const Settings& settings) {
  const auto port = settings.find("port");
  return port == settings.end() ||
         port->second.find_first_not_of("0123456789,") == std::string::npos;
}

}  // namespace

absl::StatusOr<PostgresTarget> PostgresTarget::Parse(const std::string& uri) {
  POLYEST_RETURN_IF_ERROR(LoadLibpq());
  char* error = nullptr;
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> options(
      Libpq().PQconninfoParse(uri.c_str(), &error), Libpq().PQconninfoFree);
  Libpq().PQfreemem(error);  // it may quote a part of the URI that was meant as a password
  // libpq would take a password with a "/" in it for a port, and find that out too late.
  if (!IsPostgresUri(uri) || options == nullptr || !HasGoodPort(SettingsOf(options.get()))) {
    return absl::InvalidArgumentError(
        "is no connection URI of PostgreSQL, as in postgresql://USER@HOST:PORT/DATABASE?KEY=VALUE "
        "with libpq's keys; characters other than letters, digits and -._~ are written as %XX");
  }
  const Settings settings = SettingsOf(options.get());
  for (const char* secret : {"password", "sslpassword"}) {
    if (settings.contains(secret)) {
      return absl::InvalidArgumentError(
          absl::StrCat("must not hold a password (", secret,
                       "); name a file that holds it with passfile=FILE or $PGPASSFILE"));
    }
  }
  return PostgresTarget(uri);
}

bool IsPostgresUri(const std::string& text) {
  return absl::StartsWith(text, "postgresql://") || absl::StartsWith(text, "postgres://");
}

}  // namespace polyest::internal
