#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace polyest::internal {

// A polyest program as a process, with pipes to its standard input and output. Its standard error
// goes to a file without a name, so that it never blocks the program.
class Process {
 public:
  // Starts arguments[0], the program.
  explicit Process(const std::vector<std::string>& arguments);
  // Kills the process if it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void Write(const std::string& text);
  void CloseInput();
  // Returns the next line of output without its end; empty at the end of the output.
  std::string ReadLine();
  std::string ReadAll();
  void Signal(int signal_number);
  // Returns whether the process has ended; Wait is then still to be called.
  bool HasEnded() const;
  // Waits for the end; returns the exit status, or 128 + the signal that ended the process.
  int Wait();
  // Returns all that the process has written to its standard error so far.
  std::string Errors() const;

 private:
  bool Fill();

  pid_t pid_ = -1;
  int input_ = -1;
  int output_ = -1;
  int errors_ = -1;
  std::string buffer_;
};

struct Finished {
  int exit_status = 0;
  std::string out;
  std::string err;
};

// Runs a program and waits for its end.
Finished RunProgram(const std::vector<std::string>& arguments, const std::string& input = "");

}  // namespace polyest::internal
