#pragma once

// The fixture of the security tests: a daemon with TLS, client certificates and tokens, and clients
// of every kind.

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/common/check.h"
#include "polyest/v1/study_service.pb.h"
#include "server/security/method_roles.h"
#include "server/security/token_table.h"
#include "tests/integration/daemon_process.h"
#include "tests/testing/certificates.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {

// The time limit of every wait, longer than anything here takes; it passes only in a failed test.
inline constexpr std::chrono::seconds kPatience{60};

// Returns the method of a name; no two services share one.
inline const google::protobuf::MethodDescriptor& FindMethod(const std::string& name) {
  for (const google::protobuf::ServiceDescriptor* const service : Services()) {
    const auto* const method = service->FindMethodByName(name);
    if (method != nullptr) return *method;
  }
  POLYEST_CHECK(false);
}

inline std::string MethodPath(const std::string& method) {
  return "/" + FindMethod(method).service()->full_name() + "/" + method;
}

// Makes a call in this context and returns its status. Every kind of method looks the same on the
// wire. `request` and `answer` are messages as bytes.
inline grpc::Status CallRaw(grpc::ClientContext& context,
                            const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                            const std::string& request, std::string* answer) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  const auto next = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  auto call = stub.PrepareCall(&context, path, &queue);
  call->StartCall(nullptr);
  if (next()) {
    const grpc::Slice slice(request);
    call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
    next();
    grpc::ByteBuffer message;
    for (call->Read(&message, nullptr); next(); call->Read(&message, nullptr)) {
      std::vector<grpc::Slice> slices;
      message.Dump(&slices);
      for (const grpc::Slice& part : slices) {
        if (answer == nullptr) continue;
        answer->append(reinterpret_cast<const char*>(part.begin()), part.size());
      }
    }
  }
  grpc::Status status;
  call->Finish(&status, nullptr);
  next();
  return status;
}

// Makes a call with a token.
inline grpc::Status CallRaw(const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                            const std::string& token, const std::string& request = "",
                            std::string* answer = nullptr) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kPatience);
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  return CallRaw(context, channel, path, request, answer);
}

// Returns the names of all methods of all services, from the contract.
inline std::vector<std::string> AllMethods() {
  std::vector<std::string> names;
  for (const google::protobuf::ServiceDescriptor* const service : Services()) {
    for (int k = 0; k < service->method_count(); ++k) names.push_back(service->method(k)->name());
  }
  return names;
}

// Returns a request about sessions/rig, as bytes; nothing if the method is not about a session.
inline std::optional<std::string> AboutTheRig(const std::string& method) {
  const auto& descriptor = *FindMethod(method).input_type();
  const bool by_name =
      method == "GetSession" || method == "DeleteSession" || method == "ExportSession";
  const std::unique_ptr<google::protobuf::Message> request(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&descriptor)->New());
  if (const auto* const subject = descriptor.FindFieldByName("subject"); subject != nullptr) {
    v1::Subject rig;
    rig.set_session("sessions/rig");
    request->GetReflection()->MutableMessage(request.get(), subject)->CopyFrom(rig);
    return request->SerializeAsString();
  }
  const auto* const field = descriptor.FindFieldByName(by_name ? "name" : "session");
  if (field == nullptr || field->type() != google::protobuf::FieldDescriptor::TYPE_STRING) {
    return std::nullopt;
  }
  request->GetReflection()->SetString(request.get(), field, "sessions/rig");
  return request->SerializeAsString();
}

class SecureDaemonTest : public testing::Test {
 protected:
  explicit SecureDaemonTest(bool client_certificates = true)
      : client_certificates_(client_certificates) {}

  void SetUp() override {
    Install(authority_.Issue("daemon"));
    folder_.Write("ca.pem", authority_.certificate());
    folder_.Write("tokens", Lines({reader_, writer_, admin_, operator_, other_}));
    std::vector<std::string> arguments = {
        "--listen",     "127.0.0.1:0",       "--log-level",      "trace",     "--tokens",
        File("tokens"), "--tls-certificate", File("daemon.pem"), "--tls-key", File("daemon.key")};
    if (client_certificates_) {
      arguments.insert(arguments.end(), {"--tls-client-ca", File("ca.pem")});
    }
    daemon_.emplace(std::move(arguments));
    address_ = daemon_->ReadAddress();
    ASSERT_FALSE(address_.empty()) << daemon_->Errors();
  }

  std::string File(const std::string& name) const { return folder_ / name; }
  static std::string Lines(const std::vector<NewToken>& tokens) {
    std::string text;
    for (const NewToken& token : tokens) text += token.line + "\n";
    return text;
  }
  void Install(const IssuedCertificate& issued) const {
    folder_.Write("daemon.pem", issued.certificate);
    folder_.Write("daemon.key", issued.key);
  }

  // Returns a channel with its own connections. Empty texts mean no certificate.
  std::shared_ptr<grpc::Channel> Connect(const CertificateAuthority& trusted,
                                         const IssuedCertificate& own) const {
    grpc::SslCredentialsOptions options;
    options.pem_root_certs = trusted.certificate();
    options.pem_cert_chain = own.certificate;
    options.pem_private_key = own.key;
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(address_, grpc::SslCredentials(options), arguments);
  }
  std::shared_ptr<grpc::Channel> Connect() const {
    return Connect(authority_, authority_.Issue("rig"));
  }

  const bool client_certificates_;
  const CertificateAuthority authority_{"test CA"};
  const NewToken reader_ = *MakeTokenFor("anna:chassis:reader");
  const NewToken writer_ = *MakeTokenFor("rig1:chassis:writer");
  const NewToken admin_ = *MakeTokenFor("bert:chassis:admin");
  const NewToken operator_ = *MakeTokenFor("olga:chassis:operator");
  const NewToken other_ = *MakeTokenFor("carl:engines:admin");
  const TestFolder folder_;
  std::optional<DaemonProcess> daemon_;
  std::string address_;
};

}  // namespace polyest::internal
