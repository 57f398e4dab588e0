#pragma once

// The fixture of the command's tests: its programs, files and a daemon.

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "polyest/v1/estimate.pb.h"
#include "proto/wire/json/json_format.h"
#include "tests/integration/cli/process.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {

// A daemon on a port of its own choice, with a data folder of its own unless it is given one.
class DaemonProcess {
 public:
  explicit DaemonProcess(const std::vector<std::string>& options = {},
                         const std::string& listen = "127.0.0.1:0")
      : process_(Arguments(options, listen, data_.path())) {
    const std::string line = process_.ReadLine();
    const std::string start = "listening on ";
    EXPECT_EQ(line.substr(0, start.size()), start) << process_.Errors();
    if (line.size() > start.size()) address_ = line.substr(start.size());
  }
  const std::string& address() const { return address_; }
  void Kill() {
    process_.Signal(SIGKILL);
    process_.Wait();
  }

 private:
  static std::vector<std::string> Arguments(std::vector<std::string> options,
                                            const std::string& listen, const std::string& data) {
    if (std::find(options.begin(), options.end(), "--data-dir") == options.end()) {
      options.insert(options.end(), {"--data-dir", data});
    }
    options.insert(options.begin(), {POLYESTD_PROGRAM, "--log-level", "off", "--listen", listen});
    return options;
  }

  TestFolder data_;
  Process process_;
  std::string address_;
};

class CommandTest : public ::testing::Test {
 protected:
  CommandTest() {
    std::string name = (std::filesystem::temp_directory_path() / "polyest-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) folder_ = name;
  }
  ~CommandTest() override { std::filesystem::remove_all(folder_); }

  // Writes a file into the test's own folder and returns its path.
  std::string File(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }

  static std::string Example(const std::string& name) {
    return std::string(POLYEST_SOURCE_DIR) + "/client/examples/" + name;
  }

  // Returns the first rows of the demonstration record, with its header.
  static std::string DemoRows(int rows) {
    std::ifstream in(Example("oscillator.csv"));
    std::string text;
    std::string line;
    for (int i = 0; i <= rows && std::getline(in, line); ++i) text += line + "\n";
    return text;
  }

  static Finished Run(std::vector<std::string> arguments, const std::string& input = "") {
    arguments.insert(arguments.begin(), POLYEST_PROGRAM);
    return RunProgram(arguments, input);
  }

  static v1::Estimate ParseEstimate(const std::string& json) {
    v1::Estimate estimate;
    const absl::Status status = FromJson(json, estimate);
    EXPECT_TRUE(status.ok()) << status << "\n" << json;
    return estimate;
  }

  static std::vector<std::string> Lines(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }

  std::filesystem::path folder_;
};

}  // namespace polyest::internal
