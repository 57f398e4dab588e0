#include "tests/integration/cli/terminal.h"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <cstdlib>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

void SetEnvironment(const std::vector<std::string>& environment) {
  setenv("TERM", "xterm", 1);
  for (const char* const name : {"COLUMNS", "NO_COLOR"}) unsetenv(name);
  for (const std::string& entry : environment) {
    const size_t equals = entry.find('=');
    setenv(entry.substr(0, equals).c_str(), entry.substr(equals + 1).c_str(), 1);
  }
}

// Runs in the program's process: takes the terminal's foreground and becomes the program.
[[noreturn]] void Become(char* const* arguments, int terminal,
                         const std::vector<std::string>& environment) {
  setpgid(0, 0);
  tcsetpgrp(terminal, getpid());
  signal(SIGTTOU, SIG_DFL);
  signal(SIGPIPE, SIG_DFL);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    dup2(terminal, descriptor);
  }
  SetEnvironment(environment);
  execv(arguments[0], arguments);
  _exit(127);
}

// Runs in the process between: leads the terminal's session, reports the program's id and its end,
// and stays until nobody reads the reports.
[[noreturn]] void RunShell(char* const* arguments, int terminal, int reports,
                           const std::vector<std::string>& environment) {
  setsid();
  ioctl(terminal, TIOCSCTTY, 0);
  signal(SIGTTOU, SIG_IGN);  // sent if a process outside of the foreground changes it
  const pid_t program = fork();
  if (program == 0) Become(arguments, terminal, environment);
  int status = 0;
  if (write(reports, &program, sizeof(program)) != sizeof(program)) _exit(1);
  while (waitpid(program, &status, 0) < 0 && errno == EINTR) {
  }
  if (write(reports, &status, sizeof(status)) != sizeof(status)) _exit(1);
  while (read(reports, &status, sizeof(status)) < 0 && errno == EINTR) {
  }
  _exit(0);
}

template <typename Report>
Report ReadReport(int reports) {
  Report report{};
  POLYEST_CHECK(recv(reports, &report, sizeof(report), MSG_WAITALL) == sizeof(report));
  return report;
}

}  // namespace

TerminalProcess::TerminalProcess(const std::vector<std::string>& arguments, Size size,
                                 const std::vector<std::string>& environment) {
  winsize window = {};
  window.ws_col = static_cast<unsigned short>(size.columns);
  window.ws_row = static_cast<unsigned short>(size.rows);
  int inside = -1;
  POLYEST_CHECK(openpty(&terminal_, &inside, nullptr, nullptr, &window) == 0);
  fcntl(terminal_, F_SETFD, FD_CLOEXEC);
  fcntl(inside, F_SETFD, FD_CLOEXEC);
  std::array<int, 2> ends{};
  POLYEST_CHECK(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) == 0);
  std::vector<char*> pointers;
  for (const std::string& argument : arguments) {
    pointers.push_back(const_cast<char*>(argument.c_str()));
  }
  pointers.push_back(nullptr);
  shell_ = fork();
  POLYEST_CHECK(shell_ >= 0);
  if (shell_ == 0) {
    close(terminal_);
    close(ends[0]);
    RunShell(pointers.data(), inside, ends[1], environment);
  }
  close(inside);
  close(ends[1]);
  reports_ = ends[0];
  program_ = ReadReport<pid_t>(reports_);
}

TerminalProcess::~TerminalProcess() {
  if (!status_) {
    kill(program_, SIGKILL);
    Wait();
  }
  close(reports_);
  int status = 0;
  while (waitpid(shell_, &status, 0) < 0 && errno == EINTR) {
  }
  close(terminal_);
}

void TerminalProcess::Type(const std::string& keys) {
  POLYEST_CHECK(write(terminal_, keys.data(), keys.size()) == static_cast<ssize_t>(keys.size()));
}

void TerminalProcess::Signal(int signal_number) { kill(program_, signal_number); }

// Reads the bytes that are there; returns false once the program has ended and all is read.
bool TerminalProcess::Fill() {
  std::array<char, 65536> bytes;
  while (true) {
    const int ended = status_ ? -1 : reports_;  // poll() passes over a negative descriptor
    pollfd wanted[2] = {{terminal_, POLLIN, 0}, {ended, POLLIN, 0}};
    if (poll(wanted, 2, status_ ? 0 : -1) < 0 && errno == EINTR) continue;
    if ((wanted[0].revents & POLLIN) != 0) {
      const ssize_t count = read(terminal_, bytes.data(), bytes.size());
      if (count <= 0) return false;
      sent_.append(bytes.data(), static_cast<size_t>(count));
      return true;
    }
    if (status_) return false;
    if (wanted[1].revents != 0) status_ = ReadReport<int>(reports_);
  }
}

std::string TerminalProcess::ReadUntil(const std::string& text) {
  while (sent_.find(text) == std::string::npos && Fill()) {
  }
  return sent_;
}

std::string TerminalProcess::ReadAll() {
  while (Fill()) {
  }
  return sent_;
}

int TerminalProcess::Wait() {
  // The output is read, because a full terminal would make the program wait.
  ReadAll();
  if (!status_) status_ = ReadReport<int>(reports_);
  return WIFEXITED(*status_) ? WEXITSTATUS(*status_) : 128 + WTERMSIG(*status_);
}

bool TerminalProcess::InLineMode() const {
  termios mode = {};
  POLYEST_CHECK(tcgetattr(terminal_, &mode) == 0);
  return (mode.c_lflag & ICANON) != 0 && (mode.c_lflag & ECHO) != 0;
}

std::string PlainText(const std::string& sent) {
  const std::string clear_line = "\r\x1b[K";
  std::string text;
  for (size_t i = 0; i < sent.size(); ++i) {
    if (sent.compare(i, clear_line.size(), clear_line) == 0) {
      text.erase(text.find_last_of('\n') + 1);
      i += clear_line.size() - 1;
    } else if (sent[i] == '\x1b') {
      i += 2;  // ESC [
      while (i < sent.size() && std::isalpha(static_cast<unsigned char>(sent[i])) == 0) ++i;
    } else if (sent[i] != '\r') {
      text += sent[i];
    }
  }
  return text;
}

}  // namespace polyest::internal
