// Checks that time is measured with clocks that nobody can set. The wall clock is only for showing.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace polyest::internal {
namespace {

// Returns the file of every line that asks the wall clock.
std::vector<std::string> Uses() {
  const std::regex clock(
      R"(system_clock|CLOCK_REALTIME|gettimeofday|absl::Now\(|GetCurrentTime\(\)|[^_\w.>]time\((nullptr|NULL|0|&)|high_resolution_clock)");
  std::vector<std::string> uses;
  for (const char* room : {"core", "server", "client"}) {
    const std::filesystem::path folder = std::filesystem::path(POLYEST_SOURCE_DIR) / room;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      const std::string extension = entry.path().extension();
      if (extension != ".cc" && extension != ".h") continue;
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);) {
        if (!std::regex_search(line, clock)) continue;
        uses.push_back(std::filesystem::relative(entry.path(), POLYEST_SOURCE_DIR).string());
      }
    }
  }
  return uses;
}

TEST(WallClock, IsAskedOnlyForTheTimesThatASessionAndAReportShow) {
  EXPECT_THAT(Uses(), testing::UnorderedElementsAre("server/daemon/daemon.cc",
                                                    "client/cli/report_command.cc"));
}

}  // namespace
}  // namespace polyest::internal
