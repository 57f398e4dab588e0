// Serves NodeService: shows the daemons of a database, and asks them to hand their sessions over.

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include "core/common/status.h"
#include "polyest/v1/node_service.grpc.pb.h"
#include "proto/wire/operations/names.h"
#include "proto/wire/operations/pages.h"
#include "server/service/calls.h"
#include "server/service/services.h"

namespace polyest::internal {
namespace {

v1::Node ToNode(const JournalNode& known) {
  v1::Node node;
  node.set_name(absl::StrCat("nodes/", known.number));
  node.set_address(known.address);
  node.set_session_count(known.sessions);
  node.set_stream_count(known.streams);
  node.set_busy_core_count(known.busy_cores);
  node.set_lease_age_s(known.lease_age_s);
  node.set_draining(known.draining);
  return node;
}

absl::StatusOr<SharedJournal*> SharedJournalOf(const ServiceContext& context) {
  SharedJournal* const journal = context.sessions.services().journal.shared();
  if (journal != nullptr) return journal;
  return absl::FailedPreconditionError(
      "the daemon's sessions are not in a database that daemons share (--journal)");
}

class NodeService final : public v1::NodeService::CallbackService {
 public:
  using Unary = grpc::ServerUnaryReactor;
  using Context = grpc::CallbackServerContext;

  explicit NodeService(const ServiceContext& context) : context_(context) {}

  Unary* ListNodes(Context* call, const v1::ListNodesRequest* request,
                   v1::ListNodesResponse* response) override {
    return StartCall(
        context_, {call, "ListNodes", request, response}, [=, this](const Caller& one) {
          return ShortJobOfCaller(context_, one, [=, this](const Caller&, const Stop&) {
            return Deliver(List(*request), response);
          });
        });
  }

  Unary* DrainNode(Context* call, const v1::DrainNodeRequest* request,
                   v1::DrainNodeResponse* response) override {
    return StartCall(
        context_, {call, "DrainNode", request, response}, [=, this](const Caller& one) {
          return ShortJobOfCaller(context_, one, [=, this](const Caller&, const Stop&) {
            return Deliver(Drain(request->name()), response);
          });
        });
  }

 private:
  absl::StatusOr<v1::ListNodesResponse> List(const v1::ListNodesRequest& request) const {
    POLYEST_ASSIGN_OR_RETURN(const size_t page_size, PageSize(request.page_size()));
    // The token is a node's number, so that it outlives the node.
    int64_t after = 0;
    if (!request.page_token().empty() &&
        !(absl::SimpleAtoi(request.page_token(), &after) && after > 0)) {
      return UnknownPageToken(request.page_token());
    }
    POLYEST_ASSIGN_OR_RETURN(SharedJournal* const journal, SharedJournalOf(context_));
    POLYEST_ASSIGN_OR_RETURN(const std::vector<JournalNode> nodes, journal->Nodes());
    v1::ListNodesResponse response;
    for (const JournalNode& node : nodes) {
      if (node.number <= after) continue;
      if (response.nodes_size() == static_cast<int>(page_size)) {
        response.set_next_page_token(absl::StrCat(after));
        break;
      }
      *response.add_nodes() = ToNode(node);
      after = node.number;
    }
    return response;
  }

  absl::StatusOr<v1::DrainNodeResponse> Drain(const std::string& name) const {
    POLYEST_ASSIGN_OR_RETURN(SharedJournal* const journal, SharedJournalOf(context_));
    POLYEST_ASSIGN_OR_RETURN(const std::string id, ResourceId("name", "nodes", name));
    const auto no_such_node = [&] {
      return absl::NotFoundError(absl::StrCat("there is no node \"", name, "\""));
    };
    int64_t number = 0;
    if (!absl::SimpleAtoi(id, &number)) return no_such_node();
    POLYEST_RETURN_IF_ERROR(journal->DrainNode(number));
    POLYEST_ASSIGN_OR_RETURN(const std::vector<JournalNode> nodes, journal->Nodes());
    for (const JournalNode& node : nodes) {
      if (node.number != number) continue;
      v1::DrainNodeResponse response;
      *response.mutable_node() = ToNode(node);
      return response;
    }
    return no_such_node();
  }

  const ServiceContext context_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeNodeService(const ServiceContext& context) {
  return std::make_unique<NodeService>(context);
}

}  // namespace polyest::internal
