#pragma once

// The end of a command: the answer in the format asked for, or the error, and the exit status.

#include <absl/status/statusor.h>

#include <ostream>
#include <type_traits>

#include "client/cli/arguments.h"
#include "client/cli/exit_status.h"
#include "client/cli/json_format.h"

namespace polyest::internal {

// Prints the answer as JSON, by `print_csv` or by `print_table`, as `arguments` say, or reports why
// there is none. Returns the exit status. A command without one of the formats passes nullptr; its
// options must not offer it.
template <typename Answer, typename Arguments, typename PrintTable, typename PrintCsv>
int PrintAnswer(const absl::StatusOr<Answer>& answer, const Arguments& arguments,
                const PrintTable& print_table, const PrintCsv& print_csv, std::ostream& out,
                std::ostream& err) {
  if (!answer.ok()) return Report(answer.status(), arguments.place.server, err);
  if constexpr (!std::is_null_pointer_v<PrintTable>) {
    if (arguments.format == Format::kTable) {
      print_table(*answer, out);
      return kExitOk;
    }
  }
  if constexpr (!std::is_null_pointer_v<PrintCsv>) {
    if (arguments.format == Format::kCsv) {
      print_csv(*answer, out);
      return kExitOk;
    }
  }
  out << ToJson(*answer, /*several_lines=*/true) << '\n';
  return kExitOk;
}

}  // namespace polyest::internal
