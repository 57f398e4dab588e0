#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "core/common/status.h"
#include "polyest/v1/operation_service.grpc.pb.h"
#include "proto/wire/operations/names.h"
#include "proto/wire/operations/pages.h"
#include "proto/wire/refusal/refusal.h"
#include "server/service/operation_store.h"
#include "server/service/services.h"
#include "server/service/study_jobs.h"

namespace polyest::internal {
namespace {

// Share of a tenant's memory that the results of its operations may have besides.
constexpr int64_t kShareOfResults = 4;

// Returns how the names of a daemon's operations begin, so that any daemon of the database knows
// whose they are.
std::string PrefixOf(int64_t node) { return absl::StrCat("node", node, "-"); }
std::string PrefixOf(const SharedJournal* journal) {
  return journal == nullptr ? "" : PrefixOf(journal->node());
}

OperationLimits LimitsOf(const ServiceContext& context) {
  const SessionServices& services = context.sessions.services();
  OperationLimits limits{.max_computing = context.max_computing,
                         .prefix = PrefixOf(services.journal.shared())};
  if (const int64_t memory_mb = services.limits.memory_mb_per_tenant; memory_mb > 0) {
    limits.result_bytes_per_tenant = (memory_mb << 20) / kShareOfResults;
  }
  return limits;
}

// Says where a page of operations begins: behind the operation `after` of the daemon `node`. Its
// token is "node-after", or "after" where daemons do not pass calls on. Both are numbers, so that
// the token outlives the operation.
struct PageStart {
  int64_t node = 0;  // 0: that lists only its own
  int64_t after = 0;
};

std::string TokenOf(const PageStart& start) {
  return start.node == 0 ? absl::StrCat(start.after) : absl::StrCat(start.node, "-", start.after);
}

// Returns the daemons that live and whose number is at least `first`, in the order of their
// numbers.
absl::StatusOr<std::vector<JournalNode>> NodesFrom(SharedJournal& journal, int64_t first) {
  POLYEST_ASSIGN_OR_RETURN(std::vector<JournalNode> nodes, journal.Nodes());
  std::erase_if(nodes, [&](const JournalNode& node) {
    const bool here = node.number == journal.node();
    return node.number < first || !(here || (node.alive && !node.address.empty()));
  });
  std::ranges::sort(nodes, {}, &JournalNode::number);
  return nodes;
}

// Returns where a page begins by its token; nothing for the first page.
absl::StatusOr<std::optional<PageStart>> ParsePageToken(const std::string& token, bool shared) {
  if (token.empty()) return std::nullopt;
  PageStart start;
  absl::string_view after = token;
  if (shared) {
    const size_t dash = std::min(token.find('-'), token.size());
    if (!absl::SimpleAtoi(after.substr(0, dash), &start.node) || start.node < 1) {
      return UnknownPageToken(token);
    }
    after.remove_prefix(std::min(dash + 1, token.size()));
  }
  if (!absl::SimpleAtoi(after, &start.after) || start.after < (shared ? 0 : 1)) {
    return UnknownPageToken(token);
  }
  return start;
}

// Returns the refusal of a call about operations of another daemon, which passes it on to that one.
absl::Status OperationsOf(const JournalNode& node) {
  return Refuse(
      absl::StatusCode::kUnavailable,
      absl::StrCat("these operations are those of the daemon at ", node.address),
      {.reason = kOwnedElsewhere, .retry_delay = std::chrono::seconds(1), .owner = node.address});
}

class OperationService final : public v1::OperationService::CallbackService {
 public:
  using Unary = grpc::ServerUnaryReactor;
  using Context = grpc::CallbackServerContext;

  explicit OperationService(const ServiceContext& context)
      : context_(context), operations_(LimitsOf(context), context.wall_clock) {}

  Unary* StartComputation(Context* call, const v1::StartComputationRequest* request,
                          v1::Operation* response) override {
    return Soon(call, "StartComputation", request, response,
                [=, this](const Caller& caller) { return Start(caller, *request); });
  }

  Unary* GetOperation(Context* call, const v1::GetOperationRequest* request,
                      v1::Operation* response) override {
    return Soon(call, "GetOperation", request, response,
                [=, this](const Caller& caller) -> absl::StatusOr<v1::Operation> {
                  POLYEST_RETURN_IF_ERROR(CheckIsHere(request->name()));
                  return operations_.Get(caller.tenant, request->name());
                });
  }

  Unary* ListOperations(Context* call, const v1::ListOperationsRequest* request,
                        v1::ListOperationsResponse* response) override {
    return Soon(call, "ListOperations", request, response,
                [=, this](const Caller& caller) { return ListPage(caller.tenant, *request); });
  }

  Unary* CancelOperation(Context* call, const v1::CancelOperationRequest* request,
                         v1::Operation* response) override {
    return Soon(call, "CancelOperation", request, response,
                [=, this](const Caller& caller) -> absl::StatusOr<v1::Operation> {
                  POLYEST_RETURN_IF_ERROR(CheckIsHere(request->name()));
                  return operations_.Cancel(caller.tenant, request->name());
                });
  }

  Unary* DeleteOperation(Context* call, const v1::DeleteOperationRequest* request,
                         google::protobuf::Empty* response) override {
    return Soon(call, "DeleteOperation", request, response,
                [=, this](const Caller& caller) -> absl::StatusOr<google::protobuf::Empty> {
                  POLYEST_RETURN_IF_ERROR(CheckIsHere(request->name()));
                  POLYEST_RETURN_IF_ERROR(operations_.Delete(caller.tenant, request->name()));
                  return google::protobuf::Empty();
                });
  }

 private:
  // Checks the name of an operation. UNAVAILABLE, naming the daemon, for one of another daemon that
  // shares the database.
  absl::Status CheckIsHere(const std::string& name) const {
    POLYEST_RETURN_IF_ERROR(ResourceId("name", "operations", name).status());
    SharedJournal* const journal = context_.sessions.services().journal.shared();
    if (journal == nullptr || absl::StartsWith(name, "operations/" + PrefixOf(journal))) {
      return absl::OkStatus();
    }
    POLYEST_ASSIGN_OR_RETURN(const std::vector<JournalNode> nodes, journal->Nodes());
    for (const JournalNode& node : nodes) {
      if (!absl::StartsWith(name, "operations/" + PrefixOf(node.number))) continue;
      return OperationsOf(node);
    }
    return absl::OkStatus();
  }

  // Returns a page of the operations of the daemon that its token names, by default the first of
  // those that live. Refuses, naming the daemon, if that is another one. A daemon that passes no
  // calls on lists its own.
  absl::StatusOr<v1::ListOperationsResponse> ListPage(const std::string& tenant,
                                                      const v1::ListOperationsRequest& request) {
    SharedJournal* const journal =
        context_.nodes == nullptr ? nullptr : context_.sessions.services().journal.shared();
    POLYEST_ASSIGN_OR_RETURN(const size_t page_size, PageSize(request.page_size()));
    POLYEST_ASSIGN_OR_RETURN(const std::optional<PageStart> given,
                             ParsePageToken(request.page_token(), journal != nullptr));
    PageStart start = given.value_or(PageStart());
    std::vector<JournalNode> nodes;  // that have operations to list, from that of the page on
    if (journal != nullptr) {
      POLYEST_ASSIGN_OR_RETURN(nodes, NodesFrom(*journal, start.node));
      if (nodes.empty()) return v1::ListOperationsResponse();
      // The operations of a daemon that has ended are gone.
      if (nodes.front().number != start.node) start = {.node = nodes.front().number};
      if (start.node != journal->node()) return OperationsOf(nodes.front());
    }
    OperationStore::Page page = operations_.List(tenant, start.after, page_size);
    v1::ListOperationsResponse response;
    for (v1::Operation& operation : page.operations) {
      *response.add_operations() = std::move(operation);
    }
    if (page.more) {
      response.set_next_page_token(TokenOf({.node = start.node, .after = page.last}));
    } else if (nodes.size() > 1) {
      response.set_next_page_token(TokenOf({.node = nodes[1].number}));
    }
    return response;
  }

  absl::StatusOr<v1::Operation> Start(const Caller& caller,
                                      const v1::StartComputationRequest& given) {
    // The session's owner computes; it also keeps the operation.
    const std::string session = SessionOf(given);
    if (context_.sessions.shared() && !session.empty()) {
      POLYEST_RETURN_IF_ERROR(FindSession(context_, caller, "subject.session", session).status());
    }
    // The operation needs a copy, because the call's own request is destroyed with the call.
    const auto request = std::make_shared<v1::StartComputationRequest>(given);
    return operations_.Start(
        caller.tenant, MethodOf(*request),
        [&](v1::ComputationResult* result) -> absl::StatusOr<Job> {
          POLYEST_ASSIGN_OR_RETURN(Job job,
                                   ComputationJob(context_, caller, request.get(), result));
          job.work = [request, work = std::move(job.work)](
                         const Stop& stop, std::stop_source& source,
                         const UnaryCall::Finisher& finish) { return work(stop, source, finish); };
          return job;
        });
  }

  // Starts a call whose answer needs no computation.
  template <typename Request, typename Response, typename Answer>
  Unary* Soon(Context* call, Method method, const Request* request, Response* response,
              const Answer& answer) {
    return StartCall(context_, {call, method, request, response}, [&](const Caller& caller) {
      return ShortJobOfCaller(context_, caller, [=](const Caller& known, const Stop&) {
        return Deliver(absl::StatusOr<Response>(answer(known)), response);
      });
    });
  }

  const ServiceContext context_;
  OperationStore operations_;
  std::stop_callback<std::function<void()>> stopping_{context_.stop,
                                                      [this] { operations_.CancelAll(); }};
};

}  // namespace

std::unique_ptr<grpc::Service> MakeOperationService(const ServiceContext& context) {
  return std::make_unique<OperationService>(context);
}

}  // namespace polyest::internal
