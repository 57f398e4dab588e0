// Tests that a daemon outlives another one that says anything at all: as the owner that it passes
// calls on to, and as the one that passes calls on to it. POLYEST_TEST_ROUNDS: the number of calls
// of each test, by default 150.

#include <absl/strings/numbers.h>
#include <grpcpp/generic/async_generic_service.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <map>
#include <mutex>
#include <random>

#include "tests/integration/forwarding_fixture.h"
#include "tests/integration/operations_fixture.h"

namespace polyest::internal {
namespace {

using Random = std::mt19937;

int Rounds() {
  int rounds = 150;
  if (const char* const given = std::getenv("POLYEST_TEST_ROUNDS")) {
    EXPECT_TRUE(absl::SimpleAtoi(given, &rounds)) << given;
  }
  return rounds;
}

size_t Choose(Random& random, size_t count) { return random() % count; }

std::string RandomBytes(Random& random, size_t most, char first = '\0', char last = '\xff') {
  const int range = static_cast<unsigned char>(last) - static_cast<unsigned char>(first) + 1;
  std::string bytes(Choose(random, most + 1), '\0');
  for (char& byte : bytes) {
    byte = static_cast<char>(first + static_cast<int>(Choose(random, static_cast<size_t>(range))));
  }
  return bytes;
}

// Returns the text with a few bytes changed, or cut off, or twice.
std::string Changed(Random& random, std::string text) {
  switch (Choose(random, 4)) {
    case 0:
      return text.substr(0, Choose(random, text.size() + 1));
    case 1:
      return text + text;
    default:
      for (size_t i = Choose(random, 4); i > 0 && !text.empty(); --i) {
        text[Choose(random, text.size())] = RandomBytes(random, 1)[0];
      }
      return text;
  }
}

grpc::ByteBuffer Message(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

// What a false owner answers.
struct Lie {
  std::vector<std::string> messages;
  grpc::Status status;
  std::multimap<std::string, std::string> initial, trailing;
  bool endless = false;  // whether it says nothing more after its messages
};

grpc::Status FalseStatus(Random& random, const std::string& address) {
  if (Choose(random, 3) == 0) return grpc::Status::OK;
  rpc::ErrorInfo info;
  info.set_reason(Choose(random, 2) == 0 ? "OWNED_ELSEWHERE" : RandomBytes(random, 20, ' ', '~'));
  info.set_domain("polyest");
  const std::string owners[] = {address, "", "nowhere:1", "127.0.0.1:0",
                                RandomBytes(random, 50, ' ', '~')};
  (*info.mutable_metadata())["owner"] = owners[Choose(random, std::size(owners))];
  rpc::Status details;
  details.set_code(static_cast<int>(Choose(random, 20)));
  details.add_details()->PackFrom(info, "type.googleapis.com/google.rpc");
  details.mutable_details(0)->set_type_url("type.googleapis.com/google.rpc.ErrorInfo");
  const std::string true_details = details.SerializeAsString();
  const std::string given[] = {true_details, Changed(random, true_details),
                               RandomBytes(random, 200), ""};
  return {static_cast<grpc::StatusCode>(Choose(random, 18)),
          RandomBytes(random, Choose(random, 8) == 0 ? 5'000 : 100),
          given[Choose(random, std::size(given))]};
}

Lie MakeLie(Random& random, const std::string& truth, const std::string& address) {
  Lie lie;
  const size_t counts[] = {0, 1, 1, 1, 2, 200};
  for (size_t i = counts[Choose(random, std::size(counts))]; i > 0; --i) {
    const std::string sent[] = {truth, Changed(random, truth), RandomBytes(random, 1'000)};
    lie.messages.push_back(sent[Choose(random, std::size(sent))]);
  }
  lie.status = FalseStatus(random, address);
  for (auto* const metadata : {&lie.initial, &lie.trailing}) {
    for (size_t i = Choose(random, 4); i > 0; --i) {
      const std::string names[] = {"x-request-id", "retry-after", "x-polyest-node-secret",
                                   "traceparent", "x-" + RandomBytes(random, 30, 'a', 'z')};
      metadata->emplace(names[Choose(random, std::size(names))],
                        RandomBytes(random, 300, ' ', '~'));
    }
    metadata->emplace("x-more-bin", RandomBytes(random, 300));
  }
  lie.endless = Choose(random, 16) == 0;
  return lie;
}

// Answers every call with the lie that is set.
class FalseOwner final : public grpc::CallbackGenericService {
 public:
  FalseOwner() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterCallbackGenericService(this);
    server_ = builder.BuildAndStart();
    address_ = "127.0.0.1:" + std::to_string(port);
  }
  ~FalseOwner() override { server_->Shutdown(std::chrono::system_clock::now()); }

  const std::string& address() const { return address_; }
  int calls() const { return calls_; }
  void Set(Lie lie) {
    const std::lock_guard lock(mutex_);
    lie_ = std::move(lie);
  }

  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* call) override {
    ++calls_;
    const std::lock_guard lock(mutex_);
    return new Answer(*call, lie_);
  }

 private:
  class Answer final : public grpc::ServerGenericBidiReactor {
   public:
    Answer(grpc::GenericCallbackServerContext& call, const Lie& lie) : lie_(lie) {
      for (const auto& [name, value] : lie_.initial) call.AddInitialMetadata(name, value);
      for (const auto& [name, value] : lie_.trailing) call.AddTrailingMetadata(name, value);
      StartRead(&request_);
    }
    void OnReadDone(bool) override { Next(); }
    void OnWriteDone(bool ok) override { ok ? Next() : End(); }
    void OnCancel() override {
      if (said_ == lie_.messages.size() && lie_.endless) End();
    }
    void OnDone() override { delete this; }

   private:
    void Next() {
      if (said_ < lie_.messages.size()) {
        message_ = Message(lie_.messages[said_++]);
        StartWrite(&message_);
      } else if (!lie_.endless) {
        End();
      }
    }
    void End() {
      if (!ended_.exchange(true)) Finish(lie_.status);
    }

    const Lie lie_;
    grpc::ByteBuffer request_, message_;
    std::atomic<size_t> said_ = 0;
    std::atomic<bool> ended_ = false;
  };

  std::mutex mutex_;
  Lie lie_;
  std::atomic<int> calls_ = 0;
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
};

bool Parses(const google::protobuf::Descriptor& type, const std::string& bytes) {
  const std::unique_ptr<google::protobuf::Message> message(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
  return message->ParseFromString(bytes);
}

class FalseNodeTest : public ForwardingTest {
 protected:
  // Returns the methods that are about a session, and only read it.
  static std::vector<std::string> Reads() {
    std::vector<std::string> methods = AllMethods();
    std::erase_if(methods, [](const std::string& method) {
      return !AboutTheRig(method) || method == "DeleteSession" || method == "WatchSession";
    });
    return methods;
  }
};

TEST_F(FalseNodeTest, AnswersWhateverTheOwnerSays) {
  FalseOwner owner;
  Node real(Sharing({"--advertise", owner.address()})), asked(Sharing());
  ASSERT_TRUE(real.Create("rig").ok());
  ASSERT_TRUE(real.Add(1).ok());
  std::map<std::string, std::string> truths;
  for (const std::string& method : Reads()) {
    CallRaw(real.channel(), MethodPath(method), "", *AboutTheRig(method), &truths[method]);
  }
  std::vector<std::string> methods = Reads();
  methods.push_back("WatchSession");
  int patient = 0;
  for (int round = 0; round < Rounds(); ++round) {
    SCOPED_TRACE(round);
    Random random(static_cast<uint32_t>(round));
    const std::string& method = methods[Choose(random, methods.size())];
    const Lie lie = MakeLie(random, truths[method], owner.address());
    owner.Set(lie);
    // gRPC sees the end of a call only when all answers have been read. Nobody reads the second one
    // of a unary call, or those after one that cannot be parsed; the caller's deadline ends it
    // then.
    const bool may_hang = lie.endless || lie.messages.size() > 1;
    const bool unary = !FindMethod(method).server_streaming();
    if (!may_hang) ++patient;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() +
                         (may_hang ? std::chrono::milliseconds(50) : kPatience));
    std::string answer;
    const grpc::Status status =
        CallRaw(context, asked.channel(), MethodPath(method), *AboutTheRig(method), &answer);
    EXPECT_FALSE(status.ok() && (lie.endless || (unary && may_hang)));
    if (!unary || !status.ok()) continue;
    // A unary call that succeeds has an answer of its type.
    EXPECT_FALSE(lie.messages.empty());
    EXPECT_TRUE(Parses(*FindMethod(method).output_type(), answer));
  }
  EXPECT_GE(owner.calls(), patient);
  EXPECT_GT(patient, 0);
  EXPECT_EQ(real.Names(), asked.Names());
  asked.process().Signal(SIGTERM);
  EXPECT_EQ(asked.process().Wait(), 0);
}

TEST_F(FalseNodeTest, ServesWhateverIsSaidOfACaller) {
  Node node(Sharing({"--log-format", "json", "--log-level", "debug"}));
  ASSERT_TRUE(node.Create("rig").ok());
  const std::vector<std::string> methods = Reads();
  for (int round = 0; round < Rounds(); ++round) {
    SCOPED_TRACE(round);
    Random random(static_cast<uint32_t>(round));
    const std::string& method = methods[Choose(random, methods.size())];
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    context.AddMetadata("x-polyest-node-secret", std::string(32, 's'));
    for (const char* name : {"x-polyest-node-peer", "x-polyest-node-certificate", "x-request-id",
                             "authorization", "traceparent"}) {
      for (size_t i = Choose(random, 3); i > 0; --i) {
        context.AddMetadata(name, RandomBytes(random, 1'000, ' ', '~'));
      }
    }
    const std::string request = *AboutTheRig(method);
    const grpc::Status status =
        CallRaw(context, node.channel(), MethodPath(method),
                Choose(random, 2) == 0 ? request : Changed(random, request), nullptr);
    EXPECT_NE(status.error_code(), grpc::StatusCode::UNKNOWN) << status.error_message();
    EXPECT_NE(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED) << method;
  }
  node.process().Signal(SIGTERM);
  EXPECT_EQ(node.process().Wait(), 0);
  // Each line is one of the daemon's own: nothing that was said has begun another one. Refusals
  // beyond the first fifty may have none.
  EXPECT_GE(std::ssize(JsonLines(node.process().Errors())), std::min(Rounds(), 50));
}

}  // namespace
}  // namespace polyest::internal
