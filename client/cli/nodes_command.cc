// Runs `polyest nodes`, which prints the daemons of a database, and `polyest nodes drain`, which
// asks one of them to hand its sessions over.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/cli/text_table.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// A node that has not renewed its lease for longer has lost its sessions to whoever asks.
constexpr double kLeaseS = 3;

std::string NumberOf(const v1::Node& node) {
  return std::string(absl::StripPrefix(node.name(), "nodes/"));
}

std::string StateOf(const v1::Node& node) {
  if (node.lease_age_s() > kLeaseS) return "gone";
  if (node.address().empty()) return "starting";
  return node.draining() ? "draining" : "serving";
}

void PrintNodes(const v1::ListNodesResponse& list, std::ostream& out) {
  TextTable table({"node", "address", "sessions", "streams", "busy cores", "lease age", "state"});
  for (const v1::Node& node : list.nodes()) {
    table.AddRow({NumberOf(node), node.address().empty() ? "-" : node.address(),
                  absl::StrCat(node.session_count()), absl::StrCat(node.stream_count()),
                  absl::StrFormat("%.2f", node.busy_core_count()),
                  absl::StrFormat("%.1f s", node.lease_age_s()), StateOf(node)});
  }
  table.Print(out);
}

// Returns the nodes of all pages.
absl::StatusOr<v1::ListNodesResponse> ListAll(Client& client) {
  v1::ListNodesResponse all;
  v1::ListNodesRequest request;
  do {
    POLYEST_ASSIGN_OR_RETURN(const v1::ListNodesResponse page, client.ListNodes(request));
    all.mutable_nodes()->MergeFrom(page.nodes());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return all;
}

absl::StatusOr<v1::DrainNodeResponse> Drain(Client& client, const std::string& wanted) {
  POLYEST_ASSIGN_OR_RETURN(const v1::ListNodesResponse list, ListAll(client));
  for (const v1::Node& node : list.nodes()) {
    if (wanted != NumberOf(node) && wanted != node.name() && wanted != node.address()) continue;
    v1::DrainNodeRequest request;
    request.set_name(node.name());
    return client.DrainNode(request);
  }
  return absl::NotFoundError(
      absl::StrFormat("there is no node \"%s\"; polyest nodes lists them", wanted));
}

}  // namespace

int RunCommand(const NodesArguments& arguments, std::ostream& out, std::ostream& err) {
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  v1::ListNodesResponse list;
  if (arguments.action.empty()) {
    auto nodes = ListAll(client);
    if (!nodes.ok()) return Report(nodes.status(), arguments.place.server, err);
    list = *std::move(nodes);
  } else {
    auto drained = Drain(client, arguments.node);
    if (!drained.ok()) return Report(drained.status(), arguments.place.server, err);
    *list.add_nodes() = *std::move(*drained).mutable_node();
  }
  if (arguments.format == Format::kJson) {
    return PrintJson(list, arguments.place.server, out, err);
  }
  PrintNodes(list, out);
  return kExitOk;
}

}  // namespace polyest::internal
