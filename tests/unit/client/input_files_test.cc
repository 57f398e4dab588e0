#include "client/cli/input_files.h"

#include <gtest/gtest.h>

#include "core/common/field_error.h"

namespace polyest::internal {
namespace {

InputFiles Files() {
  InputFiles files{.problem = "p.json", .data = {"d.csv"}, .record = {"r.csv"}};
  for (const int64_t line : {2, 3, 5}) files.data.lines.Add(line);
  files.record.lines.Add(12);
  return files;
}

TEST(InFiles, PutsTheFileInFrontOfTheField) {
  EXPECT_EQ(InFiles(InvalidField("fixed.q", "unknown"), Files()).message(),
            "p.json: fixed.q: unknown");
  EXPECT_EQ(InFiles(InvalidField("measurements.channels[0]", "x"), Files()),
            absl::InvalidArgumentError("d.csv: measurements.channels[0]: x"));
  EXPECT_EQ(InFiles(InvalidField("regularizationMode", "x"), Files()).message(),
            "p.json: regularizationMode: x");
  EXPECT_EQ(InFiles(absl::UnavailableError("gone"), Files()).message(), "gone");
}

TEST(InFiles, PutsTheLineInPlaceOfTheRow) {
  const auto refused = [](const char* field, int row, const char* sentence) {
    const absl::Status status = absl::InvalidArgumentError(RowInWords(row) + sentence);
    return std::string(InFiles(NamedInWords(field, status), Files()).message());
  };
  EXPECT_EQ(refused("measurements.timeS[1]", 1, ", column t: 1 after 2"),
            "d.csv:3: column t: 1 after 2");
  EXPECT_EQ(refused("measurements.run[2]", 2, ": run 0 has ended"), "d.csv:5: run 0 has ended");
  EXPECT_EQ(refused("record.channels[0].values[0]", 0, ", column x: 1e+200"),
            "r.csv:12: column x: 1e+200");
  EXPECT_EQ(refused("measurements.timeS[3]", 3, ", column t: 1 after 2"),
            "d.csv: row 3 (counted from 0), column t: 1 after 2");
  EXPECT_EQ(InFiles(InvalidField("measurements.timeS[2]", "inf must be finite"), Files()).message(),
            "d.csv:5: inf must be finite");
}

TEST(InFiles, NamesNoFileForWhatIsInNone) {
  for (const char* const field : {"probabilities[0]", "untilS", "regularizationModes", ""}) {
    const absl::Status refused = InvalidField(field, "x");
    EXPECT_EQ(InFiles(refused, Files()), refused) << field;
  }
  for (const char* const field : {"fixed.q", "measurements.timeS[2]", "record.timeS[0]"}) {
    const absl::Status refused = InvalidField(field, "x");
    EXPECT_EQ(InFiles(refused, {}), refused) << field;
  }
}

}  // namespace
}  // namespace polyest::internal
