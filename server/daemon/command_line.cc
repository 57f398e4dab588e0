#include "server/daemon/command_line.h"

#include <unistd.h>

#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>

#include "core/common/status.h"
#include "proto/wire/transport/loopback.h"
#include "server/daemon/configuration.h"
#include "server/daemon/web_options.h"
#include "server/journal/journal_check.h"
#include "server/journal/postgres_target.h"
#include "server/security/exposure.h"
#include "server/security/token_table.h"

namespace polyest::internal {
namespace {

constexpr int kBadUsage = 2;

CommandLine Done(int exit_status) {
  CommandLine command_line;
  command_line.done = true;
  command_line.exit_status = exit_status;
  return command_line;
}

CommandLine Refuse(const std::string& message) {
  std::cerr << "polyestd: " << message << std::endl;
  return Done(kBadUsage);
}

constexpr int64_t kMaxOfAnything = int64_t{1} << 60;

// Adds an option for a limit from 1 to `highest`, which is what the method itself can bear.
void AddLimit(CLI::App& app, const std::string& name, int64_t& limit, const std::string& meaning,
              int64_t highest = kMaxOfAnything) {
  app.add_option(name, limit, meaning)
      ->check(CLI::Range(int64_t{1}, highest))
      ->capture_default_str();
}

void AddSessionLimits(CLI::App& app, SessionLimits& limits) {
  AddLimit(app, "--max-sessions", limits.sessions, "Sessions of all tenants");
  AddLimit(app, "--max-sessions-per-tenant", limits.sessions_per_tenant, "Sessions of a tenant");
  AddLimit(app, "--max-batch-rows", limits.batch_rows, "Rows of a batch");
  AddLimit(app, "--max-session-rows", limits.rows, "Rows of a session");
  AddLimit(app, "--max-tenant-rows", limits.rows_per_tenant, "Rows of all sessions of a tenant");
  AddLimit(app, "--max-total-rows", limits.total_rows, "Rows of all sessions of all tenants");
  app.add_option(
         "--max-tenant-disk-mb", limits.disk_mb_per_tenant,
         "Size of all sessions of a tenant, MiB of problems, measurements and snapshots; 0: "
         "no limit")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 40))
      ->capture_default_str();
  app.add_option("--max-tenant-memory-mb", limits.memory_mb_per_tenant,
                 "Memory in MiB that the loaded sessions of a tenant hold, beyond which its idle "
                 "sessions leave the memory or its new work is refused; 0: no limit")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 40))
      ->capture_default_str();
  ProblemLimits& problem = limits.problem;
  AddLimit(app, "--max-parameters", problem.parameters,
           "Uncertain parameters of a problem, those of all its runs together", kMaxTerms);
  AddLimit(app, "--max-states", problem.states, "States of a problem's model");
  AddLimit(app, "--max-points", problem.points,
           "Collocation points of a problem, of the highest order that its expansion may get",
           kMaxPoints);
}

void AddLimits(CLI::App& app, DaemonOptions& daemon) {
  AddSessionLimits(app, daemon.limits);
  app.add_option("--max-memory-mb", daemon.max_memory_mb,
                 "Resident memory in MiB beyond which idle sessions leave the memory and new "
                 "sessions, those that come back, and requests without one are refused; 0: none")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 40))
      ->capture_default_str();
  app.add_option("--max-connections", daemon.max_connections,
                 "Connections that are open at a time; 0: 10000, or fewer if the limit of "
                 "descriptors (ulimit -n) is low")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 30))
      ->capture_default_str();
  app.add_option("--max-connections-per-peer", daemon.max_connections_per_peer,
                 "Connections of one address, or of one /64 network of IPv6, that are open at a "
                 "time; 0: half of all")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 30))
      ->capture_default_str();
  app.add_option("--max-compute-s", daemon.max_computing_s,
                 "Seconds that one request, or one batch of a stream, may be computed")
      ->check(CLI::Range(int64_t{1}, int64_t{1'000'000}))
      ->capture_default_str();
}

void AddOperations(CLI::App& app, CommandLine& command_line, std::string& metrics) {
  app.add_option("--metrics", metrics,
                 "HOST:PORT at which Prometheus may scrape /metrics, HOST an address or localhost; "
                 "port 0 picks a free one. Plain HTTP without authentication: beyond loopback only "
                 "with --insecure. By default nowhere");
  app.add_option("--log-level", command_line.log_level, "How much is logged, on stderr")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error", "off"}))
      ->capture_default_str();
  app.add_option("--log-format", command_line.log_format,
                 "text, or json: one object a line, with the fields beside the message")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app.add_option("--audit-log", command_line.daemon.audit_log,
                 "File to which is appended, one JSON object a line, who has created, deleted, "
                 "imported, exported or backed up sessions and who was not let in; opened again on "
                 "SIGHUP and when it was renamed. By default there is none");
  app.add_option_function<int>(
         "--drain-timeout-s",
         [&](int seconds) { command_line.daemon.drain_timeout = std::chrono::seconds(seconds); },
         "How long open calls may take to end after SIGTERM or SIGINT, s")
      ->check(CLI::Range(0, 3600))
      ->default_str(std::to_string(command_line.daemon.drain_timeout.count()));
  app.footer(
      app.get_footer() +
      "\n\nEvery option may be set by its flag, by an environment variable (POLYESTD_DATA_DIR for "
      "--data-dir), or in the file of --config; the first of these that says something holds.");
}

// Parses the address of the metrics' endpoint. The endpoint takes numeric hosts only, so
// "localhost" is replaced.
absl::StatusOr<ListenAddress> MetricsAddress(const std::string& text, bool insecure) {
  auto address = ListenAddress::Parse(text, "--metrics");
  if (!address.ok()) return address;
  if (!insecure && !IsLoopback(address->host)) {
    return absl::FailedPreconditionError("--metrics: " + address->host +
                                         " is beyond loopback, where plain HTTP needs --insecure");
  }
  if (address->host == "localhost") address->host = "127.0.0.1";
  return address;
}

// Returns the folder in which a service of the user's keeps its state, or the one that systemd
// gives to a service of the system; empty when the environment names none.
std::string DefaultDataDir() {
  const auto variable = [](const char* name) -> std::string {
    const char* value = std::getenv(name);
    return value == nullptr ? "" : value;
  };
  if (const std::string state = variable("STATE_DIRECTORY"); !state.empty()) return state;
  if (const std::string home = variable("XDG_STATE_HOME"); !home.empty()) return home + "/polyest";
  const std::string home = variable("HOME");
  return home.empty() ? "" : home + "/.local/state/polyest";
}

// Prints the secret to stdout and its line for the file of tokens to stderr, each alone.
CommandLine PrintNewToken(const std::string& words) {
  const auto token = MakeTokenFor(words);
  if (!token.ok()) return Refuse("--new-token: " + std::string(token.status().message()));
  std::cout << token->secret << std::endl;
  std::cerr << token->line << std::endl;
  return Done(std::cout ? 0 : 1);
}

// Prints what a file made by `polyest backup` has, or what is wrong with it.
CommandLine PrintBackupCheck(const std::string& file) {
  const auto contents = CheckJournalFile(file);
  if (!contents.ok()) {
    std::cerr << "polyestd: --check-backup: " << contents.status().message() << std::endl;
    return Done(1);
  }
  std::cout << file << ": " << contents->sessions << " sessions, " << contents->batches
            << " batches" << std::endl;
  for (const std::string& damage : contents->damage) {
    std::cerr << "polyestd: --check-backup: " << damage << std::endl;
  }
  return Done(contents->damage.empty() ? 0 : 1);
}

void AddSecurity(CLI::App& app, DaemonOptions& daemon, bool& insecure, std::string& new_token) {
  CLI::Option* const certificate = app.add_option(
      "--tls-certificate", daemon.tls.certificate,
      "PEM file of the daemon's certificate, then those between it and its CA: serve TLS only");
  CLI::Option* const key =
      app.add_option("--tls-key", daemon.tls.key, "PEM file of its key, without a passphrase");
  certificate->needs(key);
  key->needs(certificate);
  app.add_option("--tls-client-ca", daemon.tls.client_ca,
                 "PEM file of CAs: clients must have a certificate that one of them signed")
      ->needs(certificate);
  app.add_option("--tokens", daemon.token_file,
                 "File of the accepted tokens, one a line: NAME TENANT ROLE SHA256; ROLE is "
                 "reader, writer, admin or operator");
  app.add_flag(
      "--behind-edge", daemon.behind_edge,
      "Believe what callers on loopback say of their clients, in the headers "
      "x-forwarded-for and x-client-certificate-name: they are the edge. Needs --tokens, or "
      "--insecure where the edge knows its clients by their certificates");
  app.add_flag("--insecure", insecure, "Listen beyond loopback without TLS and authentication");
  app.add_option("--new-token", new_token,
                 "Make a token for NAME:TENANT:ROLE and end: the secret on stdout, its line for "
                 "the file of tokens on stderr");
  app.footer(
      "Tokens and certificates are read again when their files change, and on SIGHUP. To make a "
      "token: polyestd --new-token rig1:chassis:writer > rig1.token 2>> tokens");
}

// Sets where the daemon listens; refuses addresses that are more exposed than is allowed.
absl::Status Listen(const std::vector<std::string>& addresses, bool insecure,
                    DaemonOptions& daemon) {
  daemon.listen.clear();
  for (const std::string& text : addresses) {
    POLYEST_ASSIGN_OR_RETURN(ListenAddress address, ListenAddress::Parse(text));
    POLYEST_RETURN_IF_ERROR(CheckExposure(
        {.host = address.host,
         .tls = !daemon.tls.certificate.empty(),
         .authentication = !daemon.token_file.empty() || !daemon.tls.client_ca.empty(),
         .insecure = insecure}));
    daemon.listen.push_back(std::move(address));
  }
  return absl::OkStatus();
}

// Options whose text is understood when all of them are known.
struct Texts {
  std::vector<std::string> listen{DaemonOptions().listen.front().ToString()};
  std::string journal = "sqlite:";
  std::string durability = "disk";
  std::string metrics;
  std::string new_token;
  WebTexts web;
  std::string backup;
  bool insecure = false;
};

// Adds where and how safely sessions are kept.
void AddJournal(CLI::App& app, DaemonOptions& daemon, Texts& texts) {
  app.add_option("--data-dir", daemon.data_dir,
                 "Folder in which sessions are kept; by default $STATE_DIRECTORY, or "
                 "$XDG_STATE_HOME/polyest, or ~/.local/state/polyest");
  app.add_option(
         "--journal", texts.journal,
         "Where sessions are kept: sqlite: is the data folder; postgresql://… is a database "
         "that several daemons may share, without a password (passfile=FILE names one)")
      ->capture_default_str();
  app.add_option("--advertise", daemon.advertise,
                 "HOST:PORT at which clients reach this daemon, for other daemons of the same "
                 "database; by default the first of --listen");
  app.add_option("--node-secret", daemon.node_secret,
                 "File with a line of 32 to 256 characters, the same at all daemons of the "
                 "database: pass calls about sessions of another daemon on to it, and believe "
                 "what the others say of the callers whose calls they pass on");
  app.add_option("--node-ca", daemon.node_ca,
                 "PEM file of the CAs of the other daemons' certificates: calls are passed on by "
                 "TLS. Needs --node-secret");
  app.add_option("--durability", texts.durability,
                 "disk: a batch is acknowledged when it is on disk; memory: sessions end with the "
                 "daemon")
      ->check(CLI::IsMember({"disk", "memory"}))
      ->capture_default_str();
  app.add_option("--max-disk-mb", daemon.max_disk_mb,
                 "Largest size of the sessions on disk, MiB; 0: the disk's")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 40))
      ->capture_default_str();
}

void AddService(CLI::App& app, DaemonOptions& daemon, Texts& texts) {
  app.add_option("--listen", texts.listen,
                 "HOST:PORT to listen on; port 0 picks a free one; repeat the option, or separate "
                 "by commas, to listen on several")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->default_str(texts.listen.front());
  AddJournal(app, daemon, texts);
  app.add_option("--fmu-dir", daemon.fmu_dir,
                 "Folder of the FMUs that problems may name; put in it only what you would run");
  app.add_option(
      "--umbridge-dir", daemon.umbridge_dir,
      "Folder of descriptions of the models of UM-Bridge servers that problems may name");
  app.add_option("--threads", daemon.threads, "Threads of the numerics; 0: one a core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
}

// Sets the database, if sessions are kept in one.
absl::Status ApplyJournal(const Texts& texts, DaemonOptions& daemon) {
  if (texts.journal == "sqlite:") {
    if (daemon.advertise.empty()) return absl::OkStatus();
    return absl::FailedPreconditionError(
        "--advertise: only daemons that share a database (--journal postgresql://…) ask for it");
  }
  const auto target = PostgresTarget::Parse(texts.journal);
  if (!target.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("--journal: ", target.status().message(), "; the other choice is sqlite:"));
  }
  if (texts.durability == "memory" || daemon.max_disk_mb > 0) {
    return absl::FailedPreconditionError(
        absl::StrCat(texts.durability == "memory" ? "--durability memory" : "--max-disk-mb",
                     ": does not apply to sessions that --journal keeps in a PostgreSQL database"));
  }
  if (!daemon.advertise.empty()) {
    POLYEST_RETURN_IF_ERROR(ListenAddress::Parse(daemon.advertise, "--advertise").status());
  }
  daemon.database = texts.journal;
  return absl::OkStatus();
}

// Checks that what daemons of one database tell each other goes by TLS if clients' calls do.
absl::Status CheckNodes(const DaemonOptions& daemon) {
  if (daemon.node_secret.empty()) {
    if (daemon.node_ca.empty()) return absl::OkStatus();
    return absl::FailedPreconditionError("--node-ca: needs --node-secret");
  }
  if (daemon.database.empty()) {
    return absl::FailedPreconditionError(
        "--node-secret: only daemons that share a database (--journal postgresql://…) pass calls "
        "on");
  }
  if (!daemon.tls.certificate.empty() && daemon.node_ca.empty()) {
    return absl::FailedPreconditionError(
        "--node-secret: a daemon with --tls-certificate passes calls on by TLS, which needs "
        "--node-ca, the CA of the other daemons' certificates");
  }
  return absl::OkStatus();
}

// Sets what follows from the texts. INVALID_ARGUMENT or FAILED_PRECONDITION, naming the option.
absl::Status Apply(const Texts& texts, DaemonOptions& daemon) {
  POLYEST_RETURN_IF_ERROR(ApplyJournal(texts, daemon));
  POLYEST_RETURN_IF_ERROR(CheckNodes(daemon));
  if (texts.durability == "memory" || !daemon.database.empty()) {
    daemon.data_dir.clear();
  } else if (daemon.data_dir.empty()) {
    daemon.data_dir = DefaultDataDir();
    if (daemon.data_dir.empty()) {
      return absl::InvalidArgumentError(
          "--data-dir: say where sessions are kept; there is no home folder to choose");
    }
  }
  POLYEST_RETURN_IF_ERROR(Listen(texts.listen, texts.insecure, daemon));
  POLYEST_RETURN_IF_ERROR(ApplyWebOptions(texts.web, texts.insecure, daemon));
  if (daemon.behind_edge && daemon.token_file.empty() && !texts.insecure) {
    return absl::FailedPreconditionError(
        "--behind-edge: the edge passes strangers on, which needs --tokens; --insecure does "
        "without, where the edge asks for client certificates");
  }
  if (texts.metrics.empty()) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(daemon.metrics, MetricsAddress(texts.metrics, texts.insecure));
  return absl::OkStatus();
}

}  // namespace

CommandLine ParseCommandLine(int argc, char** argv) {
  CLI::App app("Estimates uncertain parameters of mechanical models from streamed measurements.",
               "polyestd");
  CommandLine command_line;
  DaemonOptions& daemon = command_line.daemon;
  Texts texts;
  AddService(app, daemon, texts);
  AddLimits(app, daemon);
  app.add_option("--max-message-mb", daemon.max_message_mb, "Largest message taken, MiB")
      // SQLite and PostgreSQL take a problem of up to 1 GB.
      ->check(CLI::Range(1, 900))
      ->capture_default_str();
  AddSecurity(app, daemon, texts.insecure, texts.new_token);
  AddWebOptions(app, texts.web);
  AddOperations(app, command_line, texts.metrics);
  app.add_option("--check-backup", texts.backup,
                 "Verify a file that `polyest backup` has written, or the journal of a daemon that "
                 "does not run, and end: with status 0 if all of it is whole");
  app.set_version_flag("--version", "polyestd " POLYEST_VERSION);
  AddConfiguration(app, {"--new-token", "--check-backup"});
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return Done(app.exit(success));
  } catch (const CLI::ParseError& error) {
    return Refuse(DescribeError(app, error, argc, argv));
  }
  if (!texts.new_token.empty()) return PrintNewToken(texts.new_token);
  if (!texts.backup.empty()) return PrintBackupCheck(texts.backup);
  const std::string wrong_variable = CheckEnvironment(app, environ);
  if (!wrong_variable.empty()) return Refuse(wrong_variable);
  const absl::Status applied = Apply(texts, daemon);
  if (!applied.ok()) return Refuse(std::string(applied.message()));
  return command_line;
}

}  // namespace polyest::internal
