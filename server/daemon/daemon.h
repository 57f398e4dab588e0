#pragma once

// Runs the daemon: everything that serves, from the sockets to the sessions, and its orderly end.

#include <absl/status/statusor.h>
#include <grpcpp/impl/service_type.h>
#include <grpcpp/server.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/external/model_library.h"
#include "server/daemon/daemon_gauges.h"
#include "server/daemon/listen_address.h"
#include "server/daemon/listener.h"
#include "server/daemon/readiness.h"
#include "server/daemon/self_check.h"
#include "server/execution/executor.h"
#include "server/forwarding/node_forwarder.h"
#include "server/forwarding/placement.h"
#include "server/journal/postgres_journal.h"
#include "server/security/access_control.h"
#include "server/security/file_watch.h"
#include "server/security/server_tls.h"
#include "server/service/open_calls.h"
#include "server/sessions/handover.h"
#include "server/sessions/housekeeper.h"
#include "server/sessions/session_registry.h"
#include "server/telemetry/audit_log.h"
#include "server/telemetry/call_interceptor.h"
#include "server/telemetry/metrics.h"
#include "server/telemetry/metrics_endpoint.h"
#include "server/telemetry/structured_log.h"
#include "server/web/web_port.h"

namespace polyest::internal {

struct DaemonOptions {
  std::vector<ListenAddress> listen{{"127.0.0.1", 50051}};  // one or more
  int threads = 0;  // threads of the numerics; 0: one a core
  // Folder in which sessions are kept; empty: sessions are in memory and end with the daemon.
  std::string data_dir{};
  // URI of the PostgreSQL database in which sessions are kept instead, postgresql://…; empty: none.
  std::string database{};
  std::string
      advertise{};  // HOST:PORT at which clients reach this daemon; empty: its first address
  int64_t max_disk_mb = 0;  // size of the journal's file, MiB; 0: as large as the disk
  SessionLimits limits{};
  int64_t max_memory_mb = 0;  // resident memory of the process, MiB; 0: no limit
  std::chrono::milliseconds unload_after{HousekeepingOptions().idle};
  int max_message_mb = 64;
  int64_t max_computing_s = 3'600;  // computing time of one call, or of one batch of a stream
  std::string fmu_dir{};            // folder of the FMUs that problems may name; empty: none
  std::string umbridge_dir{};       // likewise, of descriptions of models of UM-Bridge servers
  std::chrono::seconds drain_timeout{10};
  std::string token_file{};  // empty: no tokens are asked for
  TlsFiles tls{};            // without a certificate: no TLS
  bool behind_edge = false;  // callers on loopback are an edge (AccessOptions)
  // File of the secret that the daemons of the database share; empty: calls about sessions of
  // others are not passed on.
  std::string node_secret{};
  std::string node_ca{};  // PEM file of the CAs of their certificates; empty: they have no TLS
  // Connections that are open at a time, in all and of one peer; 0: as LimitConnections says.
  int64_t max_connections = 0;
  int64_t max_connections_per_peer = 0;
  std::string audit_log{};                  // file of the audit log; empty: none
  std::optional<ListenAddress> metrics{};   // address of the metrics' endpoint; none: no endpoint
  std::optional<ListenAddress> web{};       // address of the HTTP port; none: no such port
  std::optional<ListenAddress> umbridge{};  // address of the UM-Bridge port; none: no such port
  std::vector<std::string> web_hosts{};     // other names by which HTTP clients may call the daemon
};

class Daemon {
 public:
  // Starts the daemon. UNAVAILABLE when an address cannot be listened on, NOT_FOUND when there is
  // no folder of FMUs. Other errors are those of SqliteJournal::Open for the data folder,
  // of PostgresJournal::Open for the database, and of
  // TokenTable and ReadTlsMaterial for tokens, certificates and keys.
  static absl::StatusOr<std::unique_ptr<Daemon>> Start(const DaemonOptions& options);
  // Stops the daemon first, as Stop does.
  ~Daemon();

  // Returns the addresses that it listens on, in the order of the options, with the ports chosen.
  const std::vector<ListenAddress>& addresses() const { return addresses_; }
  // Returns the address of its metrics, if there is one, with the port chosen.
  const std::optional<ListenAddress>& metrics_address() const { return metrics_address_; }
  // Returns the address of its HTTP port, if there is one, with the port chosen.
  const std::optional<ListenAddress>& web_address() const { return web_address_; }
  // Returns the address of its UM-Bridge port, if there is one, with the port chosen.
  const std::optional<ListenAddress>& umbridge_address() const { return umbridge_address_; }
  // Returns whether its ports are encrypted.
  bool encrypts() const { return tls_ != nullptr; }

  // Reads the tokens and the certificates again, as happens by itself when their files change. If
  // they cannot be used, logs that and keeps the old ones.
  void Reload();

  // Returns whether it accepts connections at its addresses and answers calls, and sets the state
  // of its health service "" accordingly. Must not be called by two threads at once, nor during
  // Stop.
  bool IsAlive(std::chrono::milliseconds timeout);

  // Refuses new work, lets each stream send its last estimate and end UNAVAILABLE, then closes the
  // sockets. Calls that have not ended within the drain time-out are cancelled. Returns false if
  // some still compute a few seconds later, because they do not look at their stop: the process may
  // then end without them, since everything acknowledged is on disk.
  bool Stop();

 private:
  Daemon(const DaemonOptions& options, ModelLibrary models);
  absl::Status OpenJournal();
  absl::Status OpenDatabase(OnCommit on_commit);
  // Tells the other daemons of the database where this one is reached.
  void Advertise();
  absl::Status OpenSessions();
  // Logs which of the files that hold secrets others may read.
  void WarnOfReadableSecrets() const;
  absl::Status Secure();
  // Begins to look at the files of tokens and certificates.
  void WatchFiles();
  absl::Status OpenWeb();
  absl::StatusOr<std::unique_ptr<WebPort>> OpenHttp(WebPort::Protocol protocol,
                                                    std::optional<ListenAddress>& address);
  // Takes the addresses, but lets nobody in yet.
  absl::Status Listen();
  // Starts gRPC's server, which gets its connections from the listener.
  absl::Status StartServer();
  // Begins to accept connections and to answer calls, and says so to all who want to know.
  void LetClientsIn();
  void ServeWeb();
  // Returns what logs say of a call's caller.
  LoggedCaller Logged(const grpc::ServerContextBase& call) const;
  int64_t BufferBytes() const;
  absl::Status StartMetrics();
  // Returns what the log says about the daemon once it is ready.
  LogFields Described() const;

  const DaemonOptions options_;
  std::vector<ListenAddress> addresses_;
  const ModelLibrary models_;
  std::mutex reloading_;
  std::unique_ptr<AccessControl> access_;
  std::unique_ptr<ServerTls> tls_;  // null without TLS
  std::stop_source stop_;
  OpenCalls calls_;
  Metrics metrics_;
  std::unique_ptr<AuditLog> audit_;  // null without one
  Readiness readiness_;
  // The following members are declared in the order in which they need each other: the executors
  // finish their tasks, which use the journal, before the journal is destroyed.
  std::unique_ptr<SessionJournal> journal_;
  PostgresJournal* database_ = nullptr;  // the journal, if it is one
  Executor executor_;
  Executor intake_;
  std::unique_ptr<NodeForwarder> nodes_;  // null if calls are not passed on
  std::unique_ptr<Placement> placement_;  // null if new sessions are this daemon's
  std::unique_ptr<SessionRegistry> sessions_;
  std::unique_ptr<Housekeeper> housekeeper_;
  std::unique_ptr<Handover> handover_;  // null without a database
  std::vector<std::unique_ptr<grpc::Service>> services_;
  std::unique_ptr<Listener> listener_;
  std::unique_ptr<grpc::Server> server_;
  std::optional<ListenAddress> web_address_;
  std::unique_ptr<WebPort> web_;
  std::optional<ListenAddress> umbridge_address_;
  std::unique_ptr<WebPort> umbridge_;
  std::jthread closing_;  // closes the server during Stop
  std::unique_ptr<SelfCheck> self_check_;
  std::optional<ListenAddress> metrics_address_;
  std::unique_ptr<MetricsEndpoint> metrics_endpoint_;
  std::optional<FileChanges> file_changes_;  // none without files to watch
  std::unique_ptr<FileWatch> watch_;         // uses the other members
};

}  // namespace polyest::internal
