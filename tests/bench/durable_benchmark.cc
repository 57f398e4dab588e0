// Measures durable sessions under load: a hundred rigs at once, each with four channels of a
// thousand samples per second. Every batch is on disk before it is acknowledged.
//
// The first part sends as fast as possible and compares the daemon with a bare service that does
// the minimum: gRPC's own stream, and each message's bytes committed to SQLite by the same group
// commit. The second part sends at the rigs' own pace and measures the time to acknowledgements and
// whether the estimators keep up.
//
//   build/bench/bin/durable_benchmark [SESSIONS [SECONDS]]

#include <google/protobuf/util/json_util.h>
#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/common/check.h"
#include "polyest/v1/session_service.grpc.pb.h"
#include "server/daemon/daemon.h"
#include "server/journal/commit_queue.h"
#include "server/journal/sqlite_database.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using Clock = std::chrono::steady_clock;
using Stub = v1::SessionService::Stub;

constexpr int kRows = 100;
constexpr int kBatchesASecond = 10;
constexpr std::chrono::seconds kMaxToConnect{10};
constexpr double kStiffness = 40, kDamping = 0.4;

constexpr char kFourChannels[] = R"json({
  "model": {"equations": {"states": {"x": "v", "v": "-(k*x + c*v)"},
                          "outputs": {"x": "x", "v": "v", "a": "-(k*x + c*v)", "f": "k*x"},
                          "parameters": {"x_0": 1}}},
  "uncertain": [{"name": "k", "uniform": {"lower": 35, "upper": 45}},
                {"name": "c", "uniform": {"lower": 0.2, "upper": 0.6}}],
  "measured": [{"output": "x", "noise": {"absolute": 0.01}},
               {"output": "v", "noise": {"absolute": 0.05}},
               {"output": "a", "noise": {"absolute": 0.3}},
               {"output": "f", "noise": {"absolute": 0.3}}]
})json";

v1::Problem FourChannels() {
  v1::Problem problem;
  POLYEST_CHECK(google::protobuf::util::JsonStringToMessage(kFourChannels, &problem).ok());
  return problem;
}

// Returns a batch of a hundred rows of the closed-form solution, with a ripple in place of noise.
v1::StreamMeasurementsRequest Batch(int session, int index) {
  v1::StreamMeasurementsRequest request;
  request.set_session("sessions/rig-" + std::to_string(session));
  request.set_sequence(index + 1);
  request.mutable_estimates()->set_only_last(true);
  auto& rows = *request.mutable_measurements();
  for (const char* name : {"x", "v", "a", "f"}) rows.add_channels()->set_name(name);
  const double decay = kDamping / 2, omega = std::sqrt(kStiffness - decay * decay);
  for (int row = 0; row < kRows; ++row) {
    const int number = index * kRows + row + 1;
    const double t = 1e-3 * number, fade = std::exp(-decay * t);
    const double x = fade * (std::cos(omega * t) + decay / omega * std::sin(omega * t));
    const double v = -fade * kStiffness / omega * std::sin(omega * t);
    const double values[] = {x, v, -kStiffness * x - kDamping * v, kStiffness * x};
    const double noise[] = {0.01, 0.05, 0.3, 0.3};
    rows.add_time_s(t);
    for (int c = 0; c < 4; ++c) {
      const double ripple = std::sin(12.9898 * number + 78.233 * c + session);
      rows.mutable_channels(c)->add_values(values[c] + noise[c] * ripple);
    }
  }
  return request;
}

// Commits every message and does nothing else with it.
class BareService final : public v1::SessionService::Service {
 public:
  explicit BareService(const std::string& file) {
    auto database = SqliteDatabase::Open(file);
    POLYEST_CHECK(database.ok() && (*database)
                                       ->Execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = "
                                                 "FULL; CREATE TABLE batch (bytes BLOB)")
                                       .ok());
    queue_ = std::make_unique<CommitQueue<SqliteDatabase>>(*std::move(database));
  }

  grpc::Status StreamMeasurements(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::StreamMeasurementsResponse, v1::StreamMeasurementsRequest>*
          stream) override {
    v1::StreamMeasurementsRequest request;
    v1::StreamMeasurementsResponse response;
    while (stream->Read(&request)) {
      const std::string bytes = request.measurements().SerializeAsString();
      POLYEST_CHECK(queue_
                        ->Run([&](SqliteDatabase& database) {
                          SqliteQuery query(database, "INSERT INTO batch VALUES (?)");
                          return query.BindBlob(bytes).Run();
                        })
                        .ok());
      response.mutable_acknowledgement()->set_sequence(request.sequence());
      stream->Write(response);
    }
    return grpc::Status::OK;
  }

 private:
  std::unique_ptr<CommitQueue<SqliteDatabase>> queue_;
};

// Returns a client with a connection of its own, which exists already.
std::unique_ptr<Stub> Connect(int port) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto channel = grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(port),
                                                 grpc::InsecureChannelCredentials(), arguments);
  POLYEST_CHECK(channel->WaitForConnected(std::chrono::system_clock::now() + kMaxToConnect));
  return v1::SessionService::NewStub(channel);
}

struct Streamed {
  std::vector<double> delays;  // s from the sending of each batch to its acknowledgement
  Clock::time_point all_acknowledged;
};

// Streams one session: if `paced`, one batch whenever it is due; otherwise as fast as the daemon
// takes them.
Streamed Stream(Stub& stub, const std::vector<v1::StreamMeasurementsRequest>& batches,
                std::optional<Clock::time_point> first_due) {
  std::vector<Clock::time_point> sent(batches.size());
  Streamed streamed;
  grpc::ClientContext context;
  const auto stream = stub.StreamMeasurements(&context);
  std::jthread writer([&] {
    for (size_t i = 0; i < batches.size(); ++i) {
      if (first_due) {
        std::this_thread::sleep_until(*first_due +
                                      i * std::chrono::milliseconds(1000 / kBatchesASecond));
      }
      sent[i] = Clock::now();
      if (!stream->Write(batches[i])) return;
    }
    stream->WritesDone();
  });
  v1::StreamMeasurementsResponse response;
  while (stream->Read(&response)) {
    if (!response.has_acknowledgement()) continue;
    streamed.all_acknowledged = Clock::now();
    const std::chrono::duration<double> delay =
        streamed.all_acknowledged -
        sent[static_cast<size_t>(response.acknowledgement().sequence() - 1)];
    streamed.delays.push_back(delay.count());
  }
  writer.join();
  const grpc::Status status = stream->Finish();
  if (!status.ok()) std::fprintf(stderr, "%s\n", status.error_message().c_str());
  POLYEST_CHECK(status.ok() && streamed.delays.size() == batches.size());
  return streamed;
}

struct Outcome {
  double acknowledged_s = 0;  // time until all batches were acknowledged
  double computed_s = 0;      // time until all estimates were computed, too
  std::vector<double> delays;
};

Outcome StreamAll(int port, int sessions, int batches, bool paced) {
  std::vector<std::vector<v1::StreamMeasurementsRequest>> requests(static_cast<size_t>(sessions));
  for (int session = 0; session < sessions; ++session) {
    for (int index = 0; index < batches; ++index) {
      requests[static_cast<size_t>(session)].push_back(Batch(session, index));
    }
  }
  std::vector<std::unique_ptr<Stub>> rigs;
  for (int session = 0; session < sessions; ++session) rigs.push_back(Connect(port));
  Outcome outcome;
  std::vector<std::future<Streamed>> streams;
  const auto begin = Clock::now();
  for (int session = 0; session < sessions; ++session) {
    std::optional<Clock::time_point> due;
    // The rigs do not all send at the same moment.
    if (paced) due = begin + std::chrono::milliseconds(1000 / kBatchesASecond) * session / sessions;
    streams.push_back(std::async(std::launch::async, [&, session, due] {
      const auto i = static_cast<size_t>(session);
      return Stream(*rigs[i], requests[i], due);
    }));
  }
  for (auto& stream : streams) {
    const Streamed streamed = stream.get();
    const std::chrono::duration<double> acknowledged = streamed.all_acknowledged - begin;
    outcome.acknowledged_s = std::max(outcome.acknowledged_s, acknowledged.count());
    outcome.delays.insert(outcome.delays.end(), streamed.delays.begin(), streamed.delays.end());
  }
  outcome.computed_s = std::chrono::duration<double>(Clock::now() - begin).count();
  std::sort(outcome.delays.begin(), outcome.delays.end());
  return outcome;
}

void CreateSessions(Stub& stub, int sessions) {
  for (int session = 0; session < sessions; ++session) {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    request.set_session_id("rig-" + std::to_string(session));
    *request.mutable_session()->mutable_problem() = FourChannels();
    v1::Session created;
    POLYEST_CHECK(stub.CreateSession(&context, request, &created).ok());
  }
}

double SlowestRealTimeFactor(Stub& stub) {
  grpc::ClientContext context;
  v1::ListSessionsRequest request;
  request.set_page_size(200);
  v1::ListSessionsResponse response;
  POLYEST_CHECK(stub.ListSessions(&context, request, &response).ok());
  double slowest = INFINITY;
  for (const v1::Session& session : response.sessions()) {
    slowest = std::min(slowest, session.activity().real_time_factor());
  }
  return slowest;
}

std::unique_ptr<Daemon> StartDaemon(const std::string& folder) {
  DaemonOptions options;
  options.listen = {{"127.0.0.1", 0}};
  options.data_dir = folder;
  auto daemon = Daemon::Start(options);
  POLYEST_CHECK(daemon.ok());
  return *std::move(daemon);
}

Outcome AsFastAsItGoes(const std::string& folder, int sessions, int batches) {
  const auto daemon = StartDaemon(folder);
  CreateSessions(*Connect(daemon->addresses().front().port), sessions);
  return StreamAll(daemon->addresses().front().port, sessions, batches, /*paced=*/false);
}

double BareThroughput(const std::string& file, int sessions, int batches) {
  BareService service(file);
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  POLYEST_CHECK(server != nullptr);
  const Outcome outcome = StreamAll(port, sessions, batches, /*paced=*/false);
  server->Shutdown();
  return sessions * batches / outcome.acknowledged_s;
}

void Paced(const std::string& folder, int sessions, int seconds) {
  const auto daemon = StartDaemon(folder);
  const auto stub = Connect(daemon->addresses().front().port);
  CreateSessions(*stub, sessions);
  const Outcome outcome = StreamAll(daemon->addresses().front().port, sessions,
                                    seconds * kBatchesASecond, /*paced=*/true);
  const auto quantile = [&](double p) {
    return 1e3 *
           outcome.delays[static_cast<size_t>(p * static_cast<double>(outcome.delays.size() - 1))];
  };
  std::printf(
      "at the rigs' pace, %d s: acknowledged after %.1f ms (median), %.1f ms (99 %%), "
      "%.1f ms (longest); slowest session %.1f times real time\n",
      seconds, quantile(0.5), quantile(0.99), quantile(1), SlowestRealTimeFactor(*stub));
}

void Run(int sessions, int seconds) {
  const TestFolder folder;
  constexpr int kBatches = 30;
  std::printf("%d sessions, batches of %d rows × 4 channels, durable\n", sessions, kRows);
  const double bare = BareThroughput(folder / "bare.db", sessions, kBatches);
  const Outcome outcome = AsFastAsItGoes(folder / "fast", sessions, kBatches);
  const double acknowledged = sessions * kBatches / outcome.acknowledged_s;
  std::printf(
      "as fast as it goes, %d batches each: bare %.0f batches/s; daemon acknowledges %.0f "
      "batches/s, ratio %.2f, and has computed them at %.0f batches/s\n",
      kBatches, bare, acknowledged, acknowledged / bare, sessions * kBatches / outcome.computed_s);
  Paced(folder / "paced", sessions, seconds);
}

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  spdlog::set_level(spdlog::level::off);
  polyest::internal::Run(argc > 1 ? std::atoi(argv[1]) : 100, argc > 2 ? std::atoi(argv[2]) : 10);
}
