#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace polyest::internal {

// A program of ours as a process, with pipes to its standard input and output. Its standard error
// goes into a file without a name, which never makes it wait.
class Process {
 public:
  // arguments[0] is the program.
  explicit Process(const std::vector<std::string>& arguments);
  // Kills what still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void Write(const std::string& text);
  void CloseInput();
  // The next line of output without its end; empty at the end of the output.
  std::string ReadLine();
  std::string ReadAll();
  void Signal(int signal_number);
  // Waits for the end; the exit status, or 128 + the signal that ended it.
  int Wait();
  // What it wrote to its standard error so far.
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

// Runs a program to its end.
Finished RunProgram(const std::vector<std::string>& arguments, const std::string& input = "");

}  // namespace polyest::internal
