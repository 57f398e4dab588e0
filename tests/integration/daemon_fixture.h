#pragma once

#include <gmock/gmock.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/json_util.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "polyest/v1/model_service.grpc.pb.h"
#include "polyest/v1/operation_service.grpc.pb.h"
#include "polyest/v1/problem_service.grpc.pb.h"
#include "polyest/v1/session_service.grpc.pb.h"
#include "polyest/v1/status_service.grpc.pb.h"
#include "polyest/v1/study_service.grpc.pb.h"
#include "tests/integration/daemon_process.h"

namespace polyest::internal {

inline v1::Problem ProblemFromJson(const std::string& json) {
  v1::Problem problem;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(json, &problem).ok());
  return problem;
}

// A damped 1 Hz oscillator of which stiffness and damping are unknown.
inline v1::Problem Oscillator() {
  return ProblemFromJson(R"({
    "model": {"builtin": "mass_spring_damper"},
    "fixed": {"m": 1, "x0": 1},
    "uncertain": [{"name": "k", "uniform": {"lower": 31.58, "upper": 47.37}},
                  {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })");
}

// Returns rows [first, last) of the oscillator's record, 20 a second: the closed solution for k =
// 40.66, c = 0.17 and a ripple in the place of noise.
inline v1::Measurements OscillatorRows(int first, int last) {
  constexpr double kDecay = 0.17 / 2;
  const double omega = std::sqrt(40.66 - kDecay * kDecay);
  v1::Measurements rows;
  auto& x = *rows.add_channels();
  x.set_name("x");
  for (int row = first; row < last; ++row) {
    const double t = 0.05 * (row + 1);
    rows.add_time_s(t);
    x.add_values(std::exp(-kDecay * t) *
                     (std::cos(omega * t) + kDecay / omega * std::sin(omega * t)) +
                 0.01 * std::sin(12.9898 * row));
  }
  return rows;
}

class DaemonTest : public testing::Test {
 protected:
  explicit DaemonTest(std::vector<std::string> arguments = {})
      : daemon_([&] {
          arguments.insert(arguments.begin(), {"--listen", "127.0.0.1:0"});
          return arguments;
        }()) {}

  void SetUp() override {
    address_ = daemon_.ReadAddress();
    ASSERT_FALSE(address_.empty()) << daemon_.Errors();
    channel_ = grpc::CreateChannel(address_, grpc::InsecureChannelCredentials());
    models_ = v1::ModelService::NewStub(channel_);
    problems_ = v1::ProblemService::NewStub(channel_);
    sessions_ = v1::SessionService::NewStub(channel_);
    studies_ = v1::StudyService::NewStub(channel_);
    operations_ = v1::OperationService::NewStub(channel_);
    status_ = v1::StatusService::NewStub(channel_);
  }

  // Returns the estimate from the whole record at once.
  v1::Estimate EstimateAtOnce(int rows) {
    grpc::ClientContext context;
    v1::ComputeEstimateRequest request;
    *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
    *request.mutable_subject()->mutable_experiment()->mutable_measurements() =
        OscillatorRows(0, rows);
    v1::ComputeEstimateResponse response;
    const grpc::Status status = studies_->ComputeEstimate(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.estimate();
  }

  grpc::Status Create(const std::string& id, const v1::Problem& problem = Oscillator()) {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    request.set_session_id(id);
    *request.mutable_session()->mutable_problem() = problem;
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

  grpc::Status Add(const std::string& session, int64_t sequence, const v1::Measurements& rows,
                   v1::Acknowledgement* acknowledgement = nullptr) {
    grpc::ClientContext context;
    v1::AddMeasurementsRequest request;
    request.set_session(session);
    request.set_sequence(sequence);
    *request.mutable_measurements() = rows;
    v1::AddMeasurementsResponse response;
    const grpc::Status status = sessions_->AddMeasurements(&context, request, &response);
    if (acknowledgement != nullptr) *acknowledgement = response.acknowledgement();
    return status;
  }

  // Returns the present estimate of a session.
  v1::Estimate EstimateOf(const std::string& session) {
    grpc::ClientContext context;
    v1::GetEstimateRequest request;
    request.set_session(session);
    v1::Estimate estimate;
    const grpc::Status status = sessions_->GetEstimate(&context, request, &estimate);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return estimate;
  }

  DaemonProcess daemon_;
  std::string address_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::ModelService::Stub> models_;
  std::unique_ptr<v1::ProblemService::Stub> problems_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
  std::unique_ptr<v1::StudyService::Stub> studies_;
  std::unique_ptr<v1::OperationService::Stub> operations_;
  std::unique_ptr<v1::StatusService::Stub> status_;
};

// One stream of measurements, from the client's side.
class ClientStream {
 public:
  explicit ClientStream(v1::SessionService::Stub& stub, const std::string& token = "")
      : stream_([&] {
          if (!token.empty()) context_.AddMetadata("authorization", "Bearer " + token);
          return stub.StreamMeasurements(&context_);
        }()) {}

  bool Send(const std::string& session, int64_t sequence, const v1::Measurements& rows,
            const std::function<void(v1::StreamMeasurementsRequest&)>& change = {}) {
    v1::StreamMeasurementsRequest request;
    request.set_session(session);
    request.set_sequence(sequence);
    *request.mutable_measurements() = rows;
    if (change) change(request);
    return stream_->Write(request);
  }
  bool SendRequest(const v1::StreamMeasurementsRequest& request) { return stream_->Write(request); }
  bool Read(v1::StreamMeasurementsResponse& response) { return stream_->Read(&response); }
  // Reads the next response, which must be an acknowledgement of this batch.
  void ExpectAcknowledgement(int64_t sequence) {
    v1::StreamMeasurementsResponse response;
    ASSERT_TRUE(Read(response)) << Finish().error_message();
    ASSERT_TRUE(response.has_acknowledgement()) << response.ShortDebugString();
    EXPECT_EQ(response.acknowledgement().sequence(), sequence);
  }
  void ExpectEstimate(v1::Estimate& estimate) {
    v1::StreamMeasurementsResponse response;
    ASSERT_TRUE(Read(response)) << Finish().error_message();
    ASSERT_TRUE(response.has_estimate()) << response.ShortDebugString();
    estimate = response.estimate();
  }
  void HalfClose() { stream_->WritesDone(); }
  void Cancel() { context_.TryCancel(); }
  grpc::Status Finish() { return stream_->Finish(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<
      grpc::ClientReaderWriter<v1::StreamMeasurementsRequest, v1::StreamMeasurementsResponse>>
      stream_;
};

// Returns the estimate as bytes, without the number of the batch. The serialization is
// deterministic, because the one map of an estimate has no order of its own.
inline std::string WithoutSequence(v1::Estimate estimate) {
  estimate.clear_sequence();
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  estimate.SerializeToCodedStream(&coded);
  coded.Trim();
  return bytes;
}

}  // namespace polyest::internal
