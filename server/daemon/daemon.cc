#include "server/daemon/daemon.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <grpc/support/time.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <future>
#include <thread>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/umbridge/open_models.h"
#include "server/daemon/grpc_settings.h"
#include "server/journal/memory_journal.h"
#include "server/journal/sqlite_journal.h"
#include "server/service/services.h"
#include "server/telemetry/call_interceptor.h"
#include "server/telemetry/process_info.h"

namespace polyest::internal {
namespace {

// Memory of gRPC for what clients send where the daemon's memory is not limited, MiB.
constexpr int64_t kBufferMb = 1'024;
// Largest number of tasks of an executor that wait or run, and of those in one lane. A tenant has
// two lanes for its calls, and so takes half of that executor at most, and one lane of the intake.
constexpr int kWaitingTasks = 20'000;
constexpr int kWaitingTasksOfLane = kWaitingTasks / 4;
// Number of the executor's lanes that may be busy with long tasks before another lane has to wait.
// A tenant has two lanes: one for the streams of its sessions and one for all other calls.
constexpr int kBusyLanes = 8;
// Numerics give way to acknowledgements where both want a core: to a third of their share, not
// more, because other processes gain by it, too.
constexpr int kNiceness = 5;
// Number of threads that take batches. They wait for nothing but, now and then, the journal.
constexpr int kIntakeThreads = 4;
// Longest time that the last bytes of ended calls may take.
constexpr int kFlushTimeS = 1;
constexpr std::chrono::seconds kFlushTime{kFlushTimeS};
// Longest time after the drain for which calls that were cancelled may still compute.
constexpr std::chrono::seconds kGiveUp{3};

int Threads(int requested) {
  if (requested > 0) return requested;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

// Returns the time of day. This is the only use of the wall clock, which may be set at any moment:
// its time is shown, and decides nothing.
google::protobuf::Timestamp Now() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(since);
  google::protobuf::Timestamp now;
  now.set_seconds(seconds.count());
  now.set_nanos(static_cast<int32_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(since - seconds).count()));
  return now;
}

// Returns what streams may hold: a quarter of the memory that a tenant and the daemon may have.
StreamMemory::Limits StreamLimits(int64_t tenant_mb, int64_t all_mb) {
  StreamMemory::Limits limits;
  if (tenant_mb > 0) limits.tenant = (tenant_mb << 20) / 4;
  if (all_mb > 0) limits.all = (all_mb << 20) / 4;
  return limits;
}

}  // namespace

Daemon::Daemon(const DaemonOptions& options, ModelLibrary models)
    : options_(options),
      addresses_(options.listen),
      models_(std::move(models)),
      calls_(StreamLimits(options.limits.memory_mb_per_tenant, options.max_memory_mb)),
      metrics_(Version()),
      readiness_([this] { return journal_->CheckWritable(); }),
      executor_({.threads_per_lane = Threads(options.threads),
                 .threads = kBusyLanes * Threads(options.threads),
                 .capacity = kWaitingTasks,
                 .capacity_per_lane = kWaitingTasksOfLane,
                 .niceness = kNiceness}),
      intake_({.threads_per_lane = kIntakeThreads / 2,
               .threads = kIntakeThreads,
               .capacity = kWaitingTasks,
               .capacity_per_lane = kWaitingTasksOfLane}) {}

absl::Status Daemon::OpenJournal() {
  const auto on_commit = [this](const CommitReport& commit) {
    metrics_.Count(Metrics::Commit{static_cast<int64_t>(commit.writes), !commit.outcome.ok(),
                                   commit.duration.count()});
    readiness_.OnCommit(commit.outcome.ok() && commit.room);
  };
  if (!options_.database.empty()) return OpenDatabase(on_commit);
  if (options_.data_dir.empty()) {
    journal_ = std::make_unique<MemoryJournal>();
    return absl::OkStatus();
  }
  const SqliteJournalOptions journal{
      .folder = options_.data_dir, .max_mb = options_.max_disk_mb, .on_commit = on_commit};
  POLYEST_ASSIGN_OR_RETURN(auto opened, SqliteJournal::Open(journal));
  for (const std::string& damage : opened->damage()) {
    spdlog::error("the journal is damaged: {}", damage);
  }
  journal_ = std::move(opened);
  return absl::OkStatus();
}

absl::Status Daemon::OpenDatabase(OnCommit on_commit) {
  // No two daemons that live have the same machine and port.
  std::array<char, HOST_NAME_MAX + 1> host{};
  gethostname(host.data(), HOST_NAME_MAX);
  const ListenAddress& address = options_.listen.front();
  const std::string node =
      address.port == 0 ? "" : absl::StrCat(host.data(), " ", address.ToString());
  auto opened = PostgresJournal::Open(
      {.uri = options_.database, .node = node, .on_commit = std::move(on_commit)});
  if (!opened.ok()) {
    return absl::Status(opened.status().code(),
                        absl::StrFormat("--journal: %s", opened.status().message()));
  }
  database_ = opened->get();
  journal_ = *std::move(opened);
  return absl::OkStatus();
}

void Daemon::Advertise() {
  if (database_ == nullptr) return;
  database_->Announce(
      options_.advertise.empty() ? addresses_.front().ToString() : options_.advertise, [this] {
        return calls_.Count(OpenCalls::Kind::kWriter) + calls_.Count(OpenCalls::Kind::kWatcher);
      });
  handover_ = std::make_unique<Handover>(*sessions_, [this] { readiness_.Drain(); });
}

absl::Status Daemon::OpenSessions() {
  const SessionServices services{executor_,       *journal_, models_,
                                 options_.limits, &metrics_, MemoryLimit(options_.max_memory_mb)};
  POLYEST_ASSIGN_OR_RETURN(sessions_, SessionRegistry::Open(services, Now));
  housekeeper_ =
      std::make_unique<Housekeeper>(*sessions_, HousekeepingOptions{.idle = options_.unload_after});
  if (SharedJournal* const shared = journal_->shared(); shared != nullptr && nodes_ != nullptr) {
    placement_ = std::make_unique<Placement>(shared->node(), [shared] { return shared->Nodes(); });
  }
  services_ = MakeServices({.executor = executor_,
                            .intake = intake_,
                            .sessions = *sessions_,
                            .calls = calls_,
                            .access = *access_,
                            .stop = stop_.get_token(),
                            .models = models_,
                            .max_computing = std::chrono::seconds(options_.max_computing_s),
                            .wall_clock = Now,
                            .nodes = nodes_.get(),
                            .placement = placement_.get()});
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<Daemon>> Daemon::Start(const DaemonOptions& options) {
  POLYEST_ASSIGN_OR_RETURN(ModelLibrary models,
                           OpenModels(ModelFolders{options.fmu_dir, options.umbridge_dir}));
  std::unique_ptr<Daemon> daemon(new Daemon(options, std::move(models)));
  if (!options.audit_log.empty()) {
    POLYEST_ASSIGN_OR_RETURN(daemon->audit_, AuditLog::Open(options.audit_log, Now));
  }
  POLYEST_RETURN_IF_ERROR(daemon->OpenJournal());
  POLYEST_RETURN_IF_ERROR(daemon->Secure());
  POLYEST_RETURN_IF_ERROR(daemon->OpenSessions());
  const int64_t descriptors = RaiseDescriptorLimit();
  daemon->listener_ = std::make_unique<Listener>(Listener::Options{
      .limits =
          LimitConnections(descriptors, options.max_connections, options.max_connections_per_peer),
      .descriptors = descriptors});
  POLYEST_RETURN_IF_ERROR(daemon->StartMetrics());
  POLYEST_RETURN_IF_ERROR(daemon->OpenWeb());
  POLYEST_RETURN_IF_ERROR(daemon->Listen());
  POLYEST_RETURN_IF_ERROR(daemon->StartServer());
  daemon->LetClientsIn();
  daemon->WatchFiles();
  return daemon;
}

// Returns how much memory gRPC may have for what clients send, before anybody knows whose it is.
int64_t Daemon::BufferBytes() const {
  const int64_t least = 4 * int64_t{options_.max_message_mb};
  const int64_t mb = options_.max_memory_mb > 0 ? options_.max_memory_mb / 2 : kBufferMb;
  return std::max(least, mb) << 20;
}

// Takes the HTTP ports, but answers nobody yet.
absl::Status Daemon::OpenWeb() {
  web_address_ = options_.web;
  umbridge_address_ = options_.umbridge;
  POLYEST_ASSIGN_OR_RETURN(web_, OpenHttp(WebPort::Protocol::kCallsAndPage, web_address_));
  POLYEST_ASSIGN_OR_RETURN(umbridge_, OpenHttp(WebPort::Protocol::kUmBridge, umbridge_address_));
  return absl::OkStatus();
}

// Takes the port of `address` and sets the number chosen; null without an address.
absl::StatusOr<std::unique_ptr<WebPort>> Daemon::OpenHttp(WebPort::Protocol protocol,
                                                          std::optional<ListenAddress>& address) {
  if (!address) return nullptr;
  const auto who = [this](auto authorization, auto certificate) -> std::optional<Caller> {
    const absl::StatusOr<Caller> caller =
        access_->Authorize({std::move(authorization), std::move(certificate)}, "GetStatus");
    return caller.ok() ? std::optional(*caller) : std::nullopt;
  };
  POLYEST_ASSIGN_OR_RETURN(
      auto port,
      WebPort::Open({.protocol = protocol,
                     .host = address->host,
                     .port = address->port,
                     .names = options_.web_hosts,
                     .tls = options_.tls,
                     .max_message_mb = options_.max_message_mb,
                     .body_memory_bytes = BufferBytes(),
                     .who = who,
                     .count = [this](int status) { metrics_.CountWebRequest(status); }}));
  address->port = port->port();
  return port;
}

LoggedCaller Daemon::Logged(const grpc::ServerContextBase& call) const {
  const auto caller = access_->Authorize(call, "GetStatus");
  LoggedCaller logged{.peer = access_->PeerOf(call)};
  if (caller.ok()) {
    logged.tenant = caller->tenant;
    logged.name = caller->name;
    logged.role = RoleName(caller->role);
  }
  return logged;
}

absl::Status Daemon::Listen() {
  for (ListenAddress& address : addresses_) {
    POLYEST_RETURN_IF_ERROR(listener_->Listen(address));
  }
  return absl::OkStatus();
}

absl::Status Daemon::StartServer() {
  PrepareGrpc();
  grpc::ServerBuilder builder;
  listener_->Serve(builder,
                   tls_ == nullptr ? grpc::InsecureServerCredentials() : tls_->Credentials());
  LimitClients(builder, options_.max_message_mb, BufferBytes());
  for (const auto& service : services_) builder.RegisterService(service.get());
  ObserveCalls(builder, metrics_, audit_.get(),
               [this](const grpc::ServerContextBase& call) { return Logged(call); });
  server_ = builder.BuildAndStart();
  if (server_ == nullptr) return absl::InternalError("gRPC's server cannot be started");
  self_check_ = std::make_unique<SelfCheck>(*server_);
  return absl::OkStatus();
}

void Daemon::LetClientsIn() {
  ServeWeb();
  for (const google::protobuf::ServiceDescriptor* const service : Services()) {
    server_->GetHealthCheckService()->SetServingStatus(service->full_name(), true);
  }
  listener_->Start();
  Advertise();
  readiness_.Start(server_->GetHealthCheckService(), Described());
  if (audit_ != nullptr) audit_->Add("started", Described());
}

// Answers those who call over HTTP.
void Daemon::ServeWeb() {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);  // an answer is as large as it is
  for (WebPort* const port : {web_.get(), umbridge_.get()}) {
    if (port != nullptr) port->Serve(server_->InProcessChannel(arguments));
  }
}

LogFields Daemon::Described() const {
  return {{"version", Version()},
          {"listen", absl::StrJoin(addresses_, ", ",
                                   [](std::string* text, const ListenAddress& address) {
                                     text->append(address.ToString());
                                   })},
          {"metrics", metrics_address_ ? metrics_address_->ToString() : ""},
          {"web", web_address_ ? web_address_->ToString() : ""},
          {"umbridge", umbridge_address_ ? umbridge_address_->ToString() : ""},
          {"tls", tls_ == nullptr ? "no" : "yes"},
          {"connections", absl::StrCat("at most ", listener_->limits().total, ", ",
                                       listener_->limits().per_peer, " of a peer")}};
}

absl::Status Daemon::StartMetrics() {
  if (!options_.metrics) return absl::OkStatus();
  const auto gauges = std::make_shared<DaemonGauges>(
      *sessions_, executor_, calls_, options_.data_dir, readiness_.ready(), *listener_);
  POLYEST_ASSIGN_OR_RETURN(
      metrics_endpoint_,
      MetricsEndpoint::Start(options_.metrics->ToString(), {metrics_.collectable(), gauges}));
  metrics_address_ = options_.metrics;
  metrics_address_->port = metrics_endpoint_->port();
  return absl::OkStatus();
}

bool Daemon::IsAlive(std::chrono::milliseconds timeout) {
  // Over TLS a call from within would need a certificate; there, the connection is what is tried.
  const bool alive =
      self_check_->Answers(timeout / 2) && listener_->Dial(timeout / 2, /*http2=*/tls_ == nullptr);
  server_->GetHealthCheckService()->SetServingStatus("", alive);
  return alive;
}

bool Daemon::Stop() {
  if (server_ == nullptr || closing_.joinable()) return true;
  if (handover_ != nullptr) handover_->Stop();
  readiness_.Drain();
  if (audit_ != nullptr) audit_->Add("stopping", {});
  server_->GetHealthCheckService()->SetServingStatus(false);
  if (database_ != nullptr) database_->StartDraining();
  const auto drained = std::chrono::steady_clock::now() + options_.drain_timeout;
  if (!calls_.Drain(drained)) {
    spdlog::warn("calls that have not ended within --drain-timeout-s are cancelled");
  }
  if (handover_ != nullptr) handover_->LetGo(drained);
  stop_.request_stop();
  const auto flushed = std::chrono::steady_clock::now() + kFlushTime;
  bool web_ended = true;
  for (WebPort* const port : {web_.get(), umbridge_.get()}) {
    if (port != nullptr && !port->Stop(flushed, flushed + kGiveUp)) web_ended = false;
  }
  // gRPC waits for every call, also for those that do not look at their stop.
  std::promise<void> closed;
  const std::future<void> is_closed = closed.get_future();
  closing_ = std::jthread([this, closed = std::move(closed)]() mutable {
    listener_->Stop();
    server_->Shutdown(gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC),
                                   gpr_time_from_seconds(kFlushTimeS, GPR_TIMESPAN)));
    server_->Wait();
    closed.set_value();
  });
  const auto deadline = std::chrono::steady_clock::now() + kGiveUp;
  return is_closed.wait_until(deadline) == std::future_status::ready &&
         executor_.AwaitIdle(deadline) && intake_.AwaitIdle(deadline) && web_ended;
}

Daemon::~Daemon() {
  watch_ = nullptr;
  Stop();
  if (closing_.joinable()) closing_.join();
  web_ = nullptr;
  umbridge_ = nullptr;
  self_check_ = nullptr;
  server_ = nullptr;
  metrics_endpoint_ = nullptr;
  handover_ = nullptr;
  housekeeper_ = nullptr;
}

}  // namespace polyest::internal
