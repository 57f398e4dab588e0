// A user's client: reads a problem and data, and asks a daemon that is not there. Exit status 0
// when the files are understood and the call says that there is no daemon.

#include <chrono>
#include <cstdio>
#include <sstream>

#include "polyest/client.h"
#include "polyest/data_file.h"
#include "polyest/measurement_stream.h"
#include "polyest/problem_file.h"

int main() {
  const auto problem = polyest::ParseProblem(
      R"({"model": {"builtin": "mass_spring_damper"},
          "uncertain": [{"name": "k", "uniform": {"lower": 30, "upper": 50}}],
          "measured": [{"output": "x", "noise": {"absolute": 0.01}}]})",
      "problem.json");
  if (!problem.ok()) {
    std::fprintf(stderr, "%s\n", problem.status().ToString().c_str());
    return 1;
  }
  std::istringstream text("t,x\n0.1,0.5\n0.2,0.4\n");
  auto reader = polyest::DataReader::Open(text, "data.csv", polyest::ColumnsOf(*problem));
  if (!reader.ok() || reader->Read(10).value().time_s_size() != 2) return 1;

  polyest::ClientOptions options;
  options.deadline = std::chrono::milliseconds(2'000);
  // Port 0 is nobody's.
  polyest::Client client("127.0.0.1:0", options);
  return client.ListModels({}).status().code() == absl::StatusCode::kUnavailable ? 0 : 1;
}
