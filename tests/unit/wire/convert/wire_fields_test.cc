#include "proto/wire/convert/wire_fields.h"

#include <gtest/gtest.h>

#include "core/common/field_error.h"

namespace polyest::internal {
namespace {

std::string OnTheWire(const FieldPath& field) {
  return FieldOf(WireFields(InvalidField(field, "no")))->ToString();
}

TEST(WireFields, NamesCountsOfARequestAsTheContractDoes) {
  EXPECT_EQ(OnTheWire("points"), "pointCount");
  EXPECT_EQ(OnTheWire("density_bins"), "densityBinCount");
  EXPECT_EQ(OnTheWire("until_s"), "untilS");
}

TEST(WireFields, LeavesFieldsOfAProblemTheirNames) {
  EXPECT_EQ(OnTheWire("expansion.points"), "expansion.points");
  EXPECT_EQ(OnTheWire("measured[0].noise.relative_to_max"), "measured[0].noise.relativeToMax");
}

TEST(WireFields, NamesTheTimesAndChannelsOfMeasurements) {
  EXPECT_EQ(OnTheWire("measurements.time_s[3]"), "measurements.timeS[3]");
  EXPECT_EQ(OnTheWire("measurements.columns[1].value[2]"), "measurements.channels[1].values[2]");
}

TEST(WireFields, MayBeAppliedAgain) {
  const absl::Status once = WireFields(InvalidField("points", "no"));
  EXPECT_EQ(WireFields(once), once);
}

}  // namespace
}  // namespace polyest::internal
