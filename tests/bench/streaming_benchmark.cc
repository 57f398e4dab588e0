// Compares the throughput of StreamMeasurements in the daemon with that of a bare service, which
// returns the same acknowledgements for the same messages and does nothing else. The difference is
// the cost of the queues, the strand and the numerics beside gRPC. Both services run in this
// process, over loopback.

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/common/check.h"
#include "polyest/v1/session_service.grpc.pb.h"
#include "server/daemon/daemon.h"

namespace polyest::internal {
namespace {

class BareService final : public v1::SessionService::Service {
  grpc::Status StreamMeasurements(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::StreamMeasurementsResponse, v1::StreamMeasurementsRequest>*
          stream) override {
    v1::StreamMeasurementsRequest request;
    v1::StreamMeasurementsResponse response;
    int64_t samples = 0;
    while (stream->Read(&request)) {
      samples += request.measurements().time_s_size();
      response.mutable_acknowledgement()->set_sequence(request.sequence());
      response.mutable_acknowledgement()->set_sample_count(samples);
      stream->Write(response);
    }
    return grpc::Status::OK;
  }
};

v1::Problem Oscillator() {
  v1::Problem problem;
  problem.mutable_model()->set_builtin("mass_spring_damper");
  (*problem.mutable_fixed())["m"] = 1;
  (*problem.mutable_fixed())["k"] = 39.478;
  (*problem.mutable_fixed())["c"] = 0.2;
  auto& v0 = *problem.add_uncertain();
  v0.set_name("v0");
  v0.mutable_uniform()->set_lower(0.5);
  v0.mutable_uniform()->set_upper(1.5);
  auto& x = *problem.add_measured();
  x.set_output("x");
  x.mutable_noise()->set_absolute(0.01);
  return problem;
}

v1::StreamMeasurementsRequest Batch(int index, int rows) {
  v1::StreamMeasurementsRequest request;
  request.set_session("sessions/benchmark");
  request.set_sequence(index + 1);
  request.mutable_estimates()->set_only_last(true);
  auto& measurements = *request.mutable_measurements();
  auto& x = *measurements.add_channels();
  x.set_name("x");
  for (int row = 0; row < rows; ++row) {
    const double t = 1e-3 * (index * rows + row + 1);
    measurements.add_time_s(t);
    x.add_values(std::exp(-0.1 * t) * std::sin(2 * M_PI * t) / (2 * M_PI));
  }
  return request;
}

// Returns the number of batches acknowledged per second.
double Throughput(v1::SessionService::Stub& stub, int batches, int rows) {
  std::vector<v1::StreamMeasurementsRequest> requests;
  for (int index = 0; index < batches; ++index) requests.push_back(Batch(index, rows));
  const auto begin = std::chrono::steady_clock::now();
  grpc::ClientContext context;
  const auto stream = stub.StreamMeasurements(&context);
  std::jthread writer([&] {
    for (const auto& request : requests) stream->Write(request);
    stream->WritesDone();
  });
  v1::StreamMeasurementsResponse response;
  int acknowledged = 0;
  while (stream->Read(&response)) acknowledged += response.has_acknowledgement() ? 1 : 0;
  writer.join();
  POLYEST_CHECK(stream->Finish().ok() && acknowledged == batches);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  return batches / elapsed.count();
}

std::unique_ptr<v1::SessionService::Stub> Connect(int port) {
  return v1::SessionService::NewStub(
      grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials()));
}

// Returns the number of batches per second that a new session of the daemon takes.
double SessionThroughput(v1::SessionService::Stub& daemon, int batches, int rows) {
  grpc::ClientContext creating, deleting;
  v1::CreateSessionRequest create;
  create.set_session_id("benchmark");
  *create.mutable_session()->mutable_problem() = Oscillator();
  v1::Session session;
  POLYEST_CHECK(daemon.CreateSession(&creating, create, &session).ok());
  const double streamed = Throughput(daemon, batches, rows);
  v1::DeleteSessionRequest remove;
  remove.set_name("sessions/benchmark");
  google::protobuf::Empty empty;
  POLYEST_CHECK(daemon.DeleteSession(&deleting, remove, &empty).ok());
  return streamed;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Measures both by turns, because the machine may have other things to do now and then.
void Compare(v1::SessionService::Stub& daemon, v1::SessionService::Stub& bare, int batches,
             int rows) {
  constexpr int kRounds = 7;
  std::vector<double> echoed, streamed, ratios;
  for (int round = 0; round < kRounds; ++round) {
    echoed.push_back(Throughput(bare, batches, rows));
    streamed.push_back(SessionThroughput(daemon, batches, rows));
    ratios.push_back(streamed.back() / echoed.back());
  }
  const auto [lowest, highest] = std::minmax_element(ratios.begin(), ratios.end());
  std::printf(
      "%5d rows a batch: bare %8.0f batches/s, daemon %8.0f batches/s, ratio %.2f (%.2f-%.2f)\n",
      rows, Median(echoed), Median(streamed), Median(ratios), *lowest, *highest);
}

void Run() {
  BareService service;
  int bare_port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &bare_port);
  builder.RegisterService(&service);
  const auto bare_server = builder.BuildAndStart();
  auto daemon = Daemon::Start({.listen = {{"127.0.0.1", 0}}});
  POLYEST_CHECK(bare_server != nullptr && daemon.ok());
  const auto bare = Connect(bare_port);
  const auto streamed = Connect((*daemon)->addresses().front().port);
  Compare(*streamed, *bare, 20'000, 1);
  Compare(*streamed, *bare, 5'000, 64);
}

}  // namespace
}  // namespace polyest::internal

int main() { polyest::internal::Run(); }
