// The examples that are shipped can be read.

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/cpp/data_file.h"
#include "client/cpp/problem_file.h"
#include "server/convert/problem.h"

namespace polyest {
namespace {

const std::filesystem::path kExamples =
    std::filesystem::path(POLYEST_SOURCE_DIR) / "client/examples";

TEST(Examples, EveryProblemIsValid) {
  int problems = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kExamples)) {
    if (entry.path().extension() != ".json") continue;
    ++problems;
    const auto problem = ReadProblemFile(entry.path());
    ASSERT_TRUE(problem.ok()) << problem.status();
    EXPECT_TRUE(ToProblem(*problem).ok()) << entry.path() << ToProblem(*problem).status();
  }
  EXPECT_GE(problems, 7);
}

// The text between the first ```json and the next ``` of a page.
std::string FirstJsonOf(const std::filesystem::path& page) {
  std::ifstream in(page);
  std::stringstream all;
  all << in.rdbuf();
  const std::string text = all.str();
  const std::string opening = "```json\n";
  const size_t begin = text.find(opening) + opening.size();
  return text.substr(begin, text.find("```", begin) - begin);
}

TEST(Examples, TheProblemInTheLanguagesPageIsValid) {
  const std::string json =
      FirstJsonOf(std::filesystem::path(POLYEST_SOURCE_DIR) / "core/model/equations/README.md");
  v1::Problem problem;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(json, &problem).ok()) << json;
  EXPECT_TRUE(ToProblem(problem).ok()) << ToProblem(problem).status();
}

TEST(Examples, EveryRecordSuitsItsProblem) {
  int records = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kExamples)) {
    if (entry.path().extension() != ".csv") continue;
    ++records;
    const auto problem =
        ReadProblemFile(std::filesystem::path(entry.path()).replace_extension("json"));
    ASSERT_TRUE(problem.ok()) << problem.status();
    const auto data = ReadDataFile(entry.path(), ColumnsOf(*problem));
    EXPECT_TRUE(data.ok()) << data.status();
  }
  EXPECT_GE(records, 5);
}

}  // namespace
}  // namespace polyest
