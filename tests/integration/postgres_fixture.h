#pragma once

// Daemons whose sessions are in a PostgreSQL database.

#include <memory>
#include <string>
#include <vector>

#include "tests/integration/daemon_fixture.h"
#include "tests/testing/postgres_server.h"

namespace polyest::internal {

inline v1::Measurements BatchOf(int number) {
  return OscillatorRows(10 * (number - 1), 10 * number);
}

// A daemon and a client of it.
class Node {
 public:
  explicit Node(std::vector<std::string> arguments, const std::string& listen = "127.0.0.1:0",
                const std::shared_ptr<grpc::ChannelCredentials>& credentials =
                    grpc::InsecureChannelCredentials())
      : daemon_([&] {
          arguments.insert(arguments.end(), {"--listen", listen});
          return arguments;
        }()),
        address_(daemon_.ReadAddress()),
        channel_(grpc::CreateChannel(address_, credentials)),
        sessions_(v1::SessionService::NewStub(channel_)) {
    EXPECT_FALSE(address_.empty()) << daemon_.Errors();
  }

  const std::string& address() const { return address_; }
  DaemonProcess& process() { return daemon_; }
  v1::SessionService::Stub& sessions() { return *sessions_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }

  grpc::Status Create(const std::string& id) {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    request.set_session_id(id);
    *request.mutable_session()->mutable_problem() = Oscillator();
    v1::Session session;
    return sessions_->CreateSession(&context, request, &session);
  }
  grpc::Status Delete(const std::string& name) {
    grpc::ClientContext context;
    v1::DeleteSessionRequest request;
    request.set_name(name);
    google::protobuf::Empty empty;
    return sessions_->DeleteSession(&context, request, &empty);
  }
  grpc::Status Add(int number, const std::string& session = "sessions/rig") {
    grpc::ClientContext context;
    v1::AddMeasurementsRequest request;
    request.set_session(session);
    request.set_sequence(number);
    *request.mutable_measurements() = BatchOf(number);
    v1::AddMeasurementsResponse response;
    return sessions_->AddMeasurements(&context, request, &response);
  }
  grpc::Status Get(v1::Session& session, const std::string& name = "sessions/rig") {
    grpc::ClientContext context;
    v1::GetSessionRequest request;
    request.set_name(name);
    return sessions_->GetSession(&context, request, &session);
  }
  grpc::Status Estimate(v1::Estimate& estimate, const std::string& name = "sessions/rig") {
    grpc::ClientContext context;
    v1::GetEstimateRequest request;
    request.set_session(name);
    return sessions_->GetEstimate(&context, request, &estimate);
  }
  std::vector<std::string> Names() {
    grpc::ClientContext context;
    v1::ListSessionsRequest request;
    v1::ListSessionsResponse response;
    const grpc::Status listed = sessions_->ListSessions(&context, request, &response);
    EXPECT_TRUE(listed.ok()) << listed.error_message();
    std::vector<std::string> names;
    for (const v1::Session& session : response.sessions()) names.push_back(session.name());
    return names;
  }
  std::vector<v1::SessionRecord> Export(const std::string& name) {
    grpc::ClientContext context;
    v1::ExportSessionRequest request;
    request.set_name(name);
    const auto reader = sessions_->ExportSession(&context, request);
    std::vector<v1::SessionRecord> records;
    v1::SessionRecord record;
    while (reader->Read(&record)) records.push_back(record);
    const grpc::Status status = reader->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    return records;
  }
  grpc::Status Import(const std::string& id, const std::vector<v1::SessionRecord>& records) {
    grpc::ClientContext context;
    v1::Session imported;
    const auto writer = sessions_->ImportSession(&context, &imported);
    v1::ImportSessionRequest request;
    request.set_session_id(id);
    for (const v1::SessionRecord& record : records) {
      *request.mutable_record() = record;
      if (!writer->Write(request)) break;
    }
    writer->WritesDone();
    return writer->Finish();
  }

 private:
  DaemonProcess daemon_;
  const std::string address_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::SessionService::Stub> sessions_;
};

class PostgresTest : public testing::Test {
 protected:
  std::vector<std::string> Arguments() const { return {"--journal", uri_}; }
  int64_t Batches() const {
    return server_.Number(uri_, "SELECT count(*) FROM polyest.batch WHERE session > 0");
  }
  // Returns the estimate of a daemon that nothing has disturbed, and whose sessions are in memory.
  static std::string Undisturbed(int batches) {
    Node node({"--durability", "memory"});
    EXPECT_TRUE(node.Create("rig").ok());
    for (int number = 1; number <= batches; ++number) EXPECT_TRUE(node.Add(number).ok());
    return EstimateAt(node);
  }
  static std::string EstimateAt(Node& node, const std::string& name = "sessions/rig") {
    v1::Estimate estimate;
    const grpc::Status status = node.Estimate(estimate, name);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return WithoutSequence(estimate);
  }
  // Repeats a call as long as it is UNAVAILABLE, as clients do.
  template <typename Call>
  static grpc::Status Insist(Call call) {
    grpc::Status status = call();
    while (status.error_code() == grpc::StatusCode::UNAVAILABLE) status = call();
    return status;
  }

  PostgresServer& server_ = PostgresServer::Shared();
  const std::string uri_ = server_.MakeDatabase();
};

}  // namespace polyest::internal
