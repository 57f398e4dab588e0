// The `polyest` command.

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <signal.h>
#include <unistd.h>

#include <exception>
#include <iostream>
#include <type_traits>
#include <variant>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/cli/screen.h"
#include "client/paper/paper_command.h"

namespace {

// Runs the command, or returns the exit status after help, version or an error have been printed.
int Run(const std::variant<polyest::internal::CommandLine, int>& parsed) {
  if (const int* status = std::get_if<int>(&parsed)) return *status;
  const auto& line = std::get<polyest::internal::CommandLine>(parsed);
  polyest::internal::SetScreen(std::cout, polyest::internal::ScreenOf(STDOUT_FILENO, line.color));
  polyest::internal::SetScreen(std::cerr, polyest::internal::ScreenOf(STDERR_FILENO, line.color));
  return std::visit(
      [](const auto& arguments) {
        if constexpr (std::is_same_v<std::decay_t<decltype(arguments)>,
                                     polyest::internal::PaperOptions>) {
          return polyest::internal::RunPaper(arguments, std::cout, std::cerr);
        } else {
          return polyest::internal::RunCommand(arguments, std::cout, std::cerr);
        }
      },
      line.command);
}

}  // namespace

int main(int argc, char** argv) {
  signal(SIGXFSZ, SIG_IGN);  // a file beyond the limit of sizes is an error of its writing
  // The libraries' own messages are suppressed: errors that matter are returned as a status.
  gpr_set_log_function([](gpr_log_func_args*) {});
  google::protobuf::SetLogHandler(nullptr);
  try {
    const int status = Run(polyest::internal::ParseArguments(argc, argv, std::cout, std::cerr));
    std::cout.flush();
    if (status == polyest::internal::kExitOk && !std::cout) {
      std::cerr << "polyest: the output could not be written" << std::endl;
      return polyest::internal::kExitFailure;
    }
    return status;
  } catch (const std::exception& error) {
    std::cerr << "polyest: " << error.what() << std::endl;
    return polyest::internal::kExitFailure;
  }
}
