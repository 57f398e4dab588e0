#include "server/forwarding/node_forwarder.h"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/byte_buffer.h>

#include <utility>

#include "proto/wire/refusal/refusal.h"
#include "server/security/metadata.h"
#include "server/telemetry/request_id.h"

namespace polyest::internal {
namespace {

using Message = google::protobuf::MessageLite;

// Holds what a unary call needs until it ends. The answer comes as bytes: for gRPC, a call may
// succeed without any.
struct UnderWay {
  std::unique_ptr<grpc::ClientContext> context;
  grpc::TemplatedGenericStub<Message, grpc::ByteBuffer> stub;
  grpc::ByteBuffer bytes;
  Message* answer;
  NodeForwarder::Done done;
};

// Reads the answer of a call that has succeeded.
grpc::Status ReadAnswer(UnderWay& call) {
  if (call.bytes.Valid()) {
    const grpc::Status read =
        grpc::GenericDeserialize<grpc::ProtoBufferReader, Message>(&call.bytes, call.answer);
    if (read.ok()) return read;
    return {grpc::StatusCode::INTERNAL,
            "the answer of the daemon to which the call was passed on cannot be read"};
  }
  return {grpc::StatusCode::INTERNAL,
          "the daemon to which the call was passed on has ended it without an answer"};
}

}  // namespace

std::optional<NodeForwarder::Passage> NodeForwarder::PassageFor(
    const grpc::CallbackServerContext& call, const absl::Status& refusal) const {
  const std::optional<Refusal> reason = RefusalOf(refusal);
  if (!reason || reason->reason != kOwnedElsewhere || reason->owner.empty()) return std::nullopt;
  if (access_.IsPassedOn(call)) return std::nullopt;
  Passage passage;
  // The deadline and the cancellation of the call hold for this one, too.
  passage.context = grpc::ClientContext::FromCallbackServerContext(call);
  for (const auto& [key, value] : access_.PassOn(call)) passage.context->AddMetadata(key, value);
  const std::string id = OnlyValue(call, kRequestIdKey).value_or("");
  if (IsRequestId(id)) passage.context->AddMetadata(kRequestIdKey, id);
  passage.channel = channels_->To(reason->owner);
  passage.owner = reason->owner;
  return passage;
}

void NodeForwarder::Call(Passage passage, const std::string& path, const Message* request,
                         Message* answer, Done done) {
  auto* const call =
      new UnderWay{.context = std::move(passage.context),
                   .stub = grpc::TemplatedGenericStub<Message, grpc::ByteBuffer>(passage.channel),
                   .bytes = {},
                   .answer = answer,
                   .done = std::move(done)};
  call->stub.UnaryCall(call->context.get(), path, grpc::StubOptions(), request, &call->bytes,
                       [owned = call](const grpc::Status& outcome) {
                         const std::unique_ptr<UnderWay> ended(owned);
                         ended->done(*ended->context, outcome.ok() ? ReadAnswer(*ended) : outcome);
                       });
}

}  // namespace polyest::internal
