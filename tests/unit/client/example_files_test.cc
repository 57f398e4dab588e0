// Checks that the shipped examples can be read.

#include <gtest/gtest.h>

#include <filesystem>

#include "polyest/data_file.h"
#include "polyest/problem_file.h"
#include "proto/wire/convert/problem.h"

namespace polyest::internal {
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
}  // namespace polyest::internal
