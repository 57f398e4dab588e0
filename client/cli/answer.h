#pragma once

// The end of a command: the answer in the format asked for, or the error, and the exit status.

#include <absl/status/statusor.h>
#include <google/protobuf/message.h>

#include <ostream>
#include <string>
#include <type_traits>

#include "client/cli/arguments.h"
#include "client/cli/exit_status.h"
#include "client/plot/plot_file.h"
#include "core/common/status.h"
#include "proto/wire/json/json_format.h"

namespace polyest::internal {

template <typename Answer>
using Printer = void (*)(const Answer&, std::ostream&);

// Returns the answer after its plot has been drawn into the file, if one is given.
template <typename Answer>
absl::StatusOr<Answer> Plotted(Answer answer,
                               std::type_identity_t<Plot (*)(const Answer&)> make_plot,
                               const std::string& file) {
  if (!file.empty()) POLYEST_RETURN_IF_ERROR(WritePlot(make_plot(answer), file));
  return answer;
}

// Prints an answer as JSON in several lines, or reports that it has a field without a form there.
// Returns the exit status.
inline int PrintJson(const google::protobuf::Message& answer, const std::string& server,
                     std::ostream& out, std::ostream& err) {
  const absl::StatusOr<std::string> json = TryToJson(answer, /*several_lines=*/true);
  if (!json.ok()) return Report(json.status(), server, err);
  out << *json << '\n';
  return kExitOk;
}

// Prints the answer as a table, as CSV or as JSON, as `arguments` say, or reports why there is
// none. Returns the exit status. A printer is null for a command whose options do not offer its
// format.
template <typename Answer, typename Arguments>
int PrintAnswer(const absl::StatusOr<Answer>& answer, const Arguments& arguments,
                std::type_identity_t<Printer<Answer>> print_table,
                std::type_identity_t<Printer<Answer>> print_csv, std::ostream& out,
                std::ostream& err) {
  if (!answer.ok()) return Report(answer.status(), arguments.place.server, err);
  if (arguments.format == Format::kTable && print_table != nullptr) {
    print_table(*answer, out);
  } else if (arguments.format == Format::kCsv && print_csv != nullptr) {
    print_csv(*answer, out);
  } else {
    return PrintJson(*answer, arguments.place.server, out, err);
  }
  return kExitOk;
}

}  // namespace polyest::internal
