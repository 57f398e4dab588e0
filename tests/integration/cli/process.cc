#include "tests/integration/cli/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// Runs in the child, between fork and exec.
[[noreturn]] void Become(char* const* arguments, int input, int output, int errors) {
  dup2(input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(errors, STDERR_FILENO);
  signal(SIGPIPE, SIG_DFL);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

Process::Process(const std::vector<std::string>& arguments) {
  // SIGPIPE is ignored: a program that ends before it has read its input must not end the test.
  signal(SIGPIPE, SIG_IGN);
  std::array<int, 2> input{};
  std::array<int, 2> output{};
  POLYEST_CHECK(pipe2(input.data(), O_CLOEXEC) == 0);
  POLYEST_CHECK(pipe2(output.data(), O_CLOEXEC) == 0);
  errors_ = memfd_create("errors", MFD_CLOEXEC);
  POLYEST_CHECK(errors_ >= 0);
  std::vector<char*> pointers;
  for (const std::string& argument : arguments) {
    pointers.push_back(const_cast<char*>(argument.c_str()));
  }
  pointers.push_back(nullptr);
  pid_ = fork();
  POLYEST_CHECK(pid_ >= 0);
  if (pid_ == 0) Become(pointers.data(), input[0], output[1], errors_);
  close(input[0]);
  close(output[1]);
  input_ = input[1];
  output_ = output[0];
}

Process::~Process() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    Wait();
  }
  CloseInput();
  close(output_);
  close(errors_);
}

void Process::Write(const std::string& text) {
  size_t written = 0;
  while (written < text.size()) {
    const ssize_t count = write(input_, text.data() + written, text.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return;
    written += static_cast<size_t>(count);
  }
}

void Process::CloseInput() {
  if (input_ >= 0) close(input_);
  input_ = -1;
}

bool Process::Fill() {
  std::array<char, 65536> bytes;
  ssize_t count = -1;
  do {
    count = read(output_, bytes.data(), bytes.size());
  } while (count < 0 && errno == EINTR);
  if (count <= 0) return false;
  buffer_.append(bytes.data(), static_cast<size_t>(count));
  return true;
}

std::string Process::ReadLine() {
  size_t end = buffer_.find('\n');
  while (end == std::string::npos && Fill()) end = buffer_.find('\n');
  std::string line = buffer_.substr(0, end);
  buffer_.erase(0, end == std::string::npos ? end : end + 1);
  return line;
}

std::string Process::ReadAll() {
  while (Fill()) {
  }
  return std::exchange(buffer_, "");
}

void Process::Signal(int signal_number) { kill(pid_, signal_number); }

bool Process::HasEnded() const {
  siginfo_t info = {};
  return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == pid_;
}

int Process::Wait() {
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string Process::Errors() const {
  std::string text(1 << 20, '\0');
  const ssize_t count = pread(errors_, text.data(), text.size(), 0);
  text.resize(count < 0 ? 0 : static_cast<size_t>(count));
  return text;
}

Finished RunProgram(const std::vector<std::string>& arguments, const std::string& input) {
  Process process(arguments);
  process.Write(input);
  process.CloseInput();
  Finished finished;
  finished.out = process.ReadAll();
  finished.exit_status = process.Wait();
  finished.err = process.Errors();
  return finished;
}

}  // namespace polyest::internal
