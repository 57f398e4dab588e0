#include "client/cli/refused_row.h"

#include <gtest/gtest.h>

#include "core/common/field_error.h"

namespace polyest::internal {
namespace {

TEST(RefusedRow, IsTheOneThatTheFieldNames) {
  const auto row = [](const char* field) { return RefusedRow(InvalidField(field, "is bad")); };
  EXPECT_EQ(row("measurements.timeS[3]"), 3);
  EXPECT_EQ(row("measurements.run[4]"), 4);
  EXPECT_EQ(row("measurements.channels[1].values[5]"), 5);
  EXPECT_EQ(row("record.timeS[3]"), 3);
  for (const char* const other : {"measurements", "measurements.channels[1]",
                                  "measurements.channels[1].missing[2]", "measured[0].noise"}) {
    EXPECT_EQ(row(other), std::nullopt) << other;
  }
  EXPECT_EQ(RefusedRow(absl::InvalidArgumentError("row 3: is bad")), std::nullopt);
  EXPECT_EQ(RefusedRow(FieldError(absl::StatusCode::kNotFound, "measurements.timeS[3]", "")),
            std::nullopt);
}

TEST(AtRowOfData, CountsTheRowsBeforeTheBatch) {
  const absl::Status in_words = NamedInWords(
      "measurements.channels[0].values[19]",
      absl::InvalidArgumentError("row 19 (counted from 0), column x: 1e+200 must be smaller"));
  EXPECT_EQ(AtRowOfData(in_words, 480),
            NamedInWords("measurements.channels[0].values[499]",
                         absl::InvalidArgumentError(
                             "row 499 (counted from 0), column x: 1e+200 must be smaller")));
  EXPECT_EQ(AtRowOfData(InvalidField("measurements.timeS[2]", "inf must be finite"), 60),
            InvalidField("measurements.timeS[62]", "inf must be finite"));
  const absl::Status other = InvalidField("measurements.channels[1]", "is unknown");
  EXPECT_EQ(AtRowOfData(other, 60), other);
}

}  // namespace
}  // namespace polyest::internal
