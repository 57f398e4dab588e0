#pragma once

// A daemon within the test, for a stream of measurements.

#include <absl/strings/str_cat.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "polyest/v1/session_service.grpc.pb.h"

namespace polyest::internal::measurement_stream_test {

// Plays a daemon with one session, which takes batches by the contract's rules and breaks on
// demand.
class FakeDaemon : public v1::SessionService::Service {
 public:
  using Stream =
      grpc::ServerReaderWriter<v1::StreamMeasurementsResponse, v1::StreamMeasurementsRequest>;

  FakeDaemon() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~FakeDaemon() override { Stop(); }

  std::string address() const { return absl::StrCat("127.0.0.1:", port_); }
  void Stop() { server_->Shutdown(std::chrono::system_clock::now()); }

  grpc::Status GetSession(grpc::ServerContext* context, const v1::GetSessionRequest* request,
                          v1::Session* session) override {
    if (!Knows(*context)) return {grpc::StatusCode::UNAUTHENTICATED, "the token is not known"};
    if (lost) return {grpc::StatusCode::NOT_FOUND, "no such session"};
    if (absences-- > 0) return {grpc::StatusCode::UNAVAILABLE, "it is just starting"};
    session->set_name(request->name());
    session->set_last_sequence(last_sequence);
    return grpc::Status::OK;
  }

  grpc::Status StreamMeasurements(grpc::ServerContext* context, Stream* stream) override {
    ++connections;
    if (!Knows(*context)) return {grpc::StatusCode::UNAUTHENTICATED, "the token is not known"};
    if (refusal && connections <= refusals) return *refusal;
    v1::StreamMeasurementsRequest request;
    int taken = 0;
    while (stream->Read(&request)) {
      if (request.sequence() == 0) continue;  // It only says how often estimates are wanted.
      const double time = request.measurements().time_s(0);
      if (request.sequence() > last_sequence + 1) {
        return {grpc::StatusCode::FAILED_PRECONDITION, "a gap"};
      }
      if (request.sequence() <= last_sequence) {
        if (TimeOf(request.sequence()) != time) {
          return {grpc::StatusCode::ALREADY_EXISTS, "taken with other measurements"};
        }
        continue;
      }
      if (time == refused_time) return {grpc::StatusCode::INVALID_ARGUMENT, "not this one"};
      last_sequence = request.sequence();
      times.push_back(time);
      ++taken;
      // The batch is taken, but its acknowledgement gets lost with the connection.
      if (connections <= breaks && taken == 3) {
        if (on_break) on_break();
        return {grpc::StatusCode::UNAVAILABLE, "the cable was pulled"};
      }
      if (taken % acknowledge_every == 0) Acknowledge(*stream);
    }
    Acknowledge(*stream);
    v1::StreamMeasurementsResponse last;
    last.mutable_estimate()->set_sequence(last_sequence);
    if (last_sequence > 0) stream->Write(last);
    return grpc::Status::OK;
  }

  int breaks = 0;  // the number of connections that break after three batches
  std::function<void()> on_break;
  double refused_time = -1;  // of a batch that is refused
  int acknowledge_every = 1;
  std::atomic<bool> lost = false;
  std::atomic<int> absences = 0;        // how often GetSession does not reach the daemon
  std::optional<grpc::Status> refusal;  // the answer to the first streams
  int refusals = 1;                     // how many streams are refused
  std::string authorization;            // what the daemon asks for; empty: nothing
  std::atomic<int64_t> last_sequence = 0;
  std::atomic<int64_t> acknowledged = 0;
  std::atomic<int> connections = 0;
  std::vector<double> times;  // of the batches taken

 private:
  bool Knows(const grpc::ServerContext& context) const {
    const auto found = context.client_metadata().find("authorization");
    const std::string given = found == context.client_metadata().end()
                                  ? ""
                                  : std::string(found->second.data(), found->second.size());
    return authorization.empty() || given == authorization;
  }

  // Returns the time of a batch that the session has, of which only the last are in `times`.
  double TimeOf(int64_t sequence) const {
    return times[times.size() - 1 - static_cast<size_t>(last_sequence - sequence)];
  }

  void Acknowledge(Stream& stream) {
    acknowledged = last_sequence.load();
    v1::StreamMeasurementsResponse response;
    response.mutable_acknowledgement()->set_sequence(acknowledged);
    stream.Write(response);
  }

  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace polyest::internal::measurement_stream_test
