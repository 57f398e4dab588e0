#include "tests/integration/daemon_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "core/common/check.h"

namespace polyest::internal {

DaemonProcess::DaemonProcess(std::vector<std::string> arguments) {
  int output[2];
  POLYEST_CHECK(pipe2(output, O_CLOEXEC) == 0);
  output_ = fdopen(output[0], "r");
  errors_ = std::tmpfile();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(errors_), STDERR_FILENO);
  if (std::find(arguments.begin(), arguments.end(), "--data-dir") == arguments.end()) {
    arguments.insert(arguments.begin(), {"--data-dir", data_.path()});
  }
  arguments.insert(arguments.begin(), POLYESTD);
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  POLYEST_CHECK(posix_spawn(&pid_, POLYESTD, &actions, nullptr, pointers.data(), environ) == 0);
  posix_spawn_file_actions_destroy(&actions);
  close(output[1]);
}

DaemonProcess::~DaemonProcess() {
  if (pid_ > 0) {
    Signal(SIGKILL);
    Wait();
  }
  std::fclose(output_);
  std::fclose(errors_);
}

std::string DaemonProcess::ReadLine() {
  std::string line;
  for (int c = std::fgetc(output_); c != EOF && c != '\n'; c = std::fgetc(output_)) {
    line.push_back(static_cast<char>(c));
  }
  return line;
}

std::string DaemonProcess::ReadAddress() {
  const std::string prefix = "listening on ";
  const std::string line = ReadLine();
  return line.starts_with(prefix) ? line.substr(prefix.size()) : "";
}

void DaemonProcess::Signal(int number) { POLYEST_CHECK(kill(pid_, number) == 0); }

int DaemonProcess::Wait() {
  int status = 0;
  rusage used{};
  POLYEST_CHECK(wait4(pid_, &status, 0, &used) == pid_);
  pid_ = -1;
  for (const timeval& time : {used.ru_utime, used.ru_stime}) {
    computed_s_ += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

std::string DaemonProcess::Errors() const {
  // The daemon writes at the position that it shares with this process, which must stay.
  std::string text;
  std::array<char, 65'536> bytes;
  while (true) {
    const ssize_t count =
        pread(fileno(errors_), bytes.data(), bytes.size(), static_cast<off_t>(text.size()));
    if (count <= 0) return text;
    text.append(bytes.data(), static_cast<size_t>(count));
  }
}

}  // namespace polyest::internal
