#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace polyest::internal {

// A polyest program on a terminal of its own. Its standard input, output and errors are a
// pseudo-terminal, and it is in the terminal's foreground, so that Ctrl-C reaches it. A process
// between, in the place of a shell, keeps the terminal and its mode when the program has ended.
class TerminalProcess {
 public:
  struct Size {
    int columns = 80;
    int rows = 24;
  };

  // Starts arguments[0], the program. `environment` has "NAME=VALUE" to set besides TERM=xterm;
  // COLUMNS and NO_COLOR are not set otherwise.
  TerminalProcess(const std::vector<std::string>& arguments, Size size,
                  const std::vector<std::string>& environment = {});
  // Kills the program if it still runs.
  ~TerminalProcess();
  TerminalProcess(const TerminalProcess&) = delete;
  TerminalProcess& operator=(const TerminalProcess&) = delete;

  // Types the keys.
  void Type(const std::string& keys);
  void Signal(int signal_number);
  // Reads until the terminal has been sent `text`; returns everything sent so far, also if the
  // program ends first.
  std::string ReadUntil(const std::string& text);
  std::string ReadAll();
  // Waits for the end; returns the exit status, or 128 + the signal that ended the program.
  int Wait();
  // Returns whether keys are echoed and come line by line, as a shell needs it.
  bool InLineMode() const;

 private:
  bool Fill();

  pid_t shell_ = -1;
  pid_t program_ = -1;
  int terminal_ = -1;
  int reports_ = -1;           // from the process between
  std::optional<int> status_;  // as waitpid gives it
  std::string sent_;
};

// Returns the text that the terminal shows in the end: without escape sequences, carriage returns
// and cleared lines.
std::string PlainText(const std::string& sent);

}  // namespace polyest::internal
