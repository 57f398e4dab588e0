#include "core/common/field_error.h"

#include <absl/strings/ascii.h>
#include <absl/strings/cord.h>
#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(FieldPath, IsWrittenAsItWouldBeInAProgram) {
  EXPECT_EQ((FieldPath{"measured", 0, "noise", "absolute"}).ToString(),
            "measured[0].noise.absolute");
  EXPECT_EQ((FieldPath{"fixed", FieldStep::Key("force.amplitude")}).ToString(),
            "fixed.force.amplitude");
  EXPECT_EQ(FieldPath().ToString(), "");
}

TEST(FieldPath, IsReadFromWhatAProgramHasWritten) {
  const FieldPath path{"measured", 12, "noise", "absolute"};
  EXPECT_EQ(FieldPath("measured[12].noise.absolute"), path);
  EXPECT_EQ(FieldPath(""), FieldPath());
  // A path from another program's message may be any text.
  for (const char* odd : {"[", "a[", "a[0", ".", "a..b", "[]", "]"}) FieldPath(odd).ToString();
}

TEST(FieldError, HasItsPathAsDataAndInItsMessage) {
  const absl::Status status = InvalidField({"fixed", FieldStep::Key("a: b")}, "1: too much");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message(), "fixed.a: b: 1: too much");
  EXPECT_EQ(FieldOf(status), (FieldPath{"fixed", FieldStep::Key("a: b")}));
  EXPECT_EQ(SentenceOf(status), "1: too much");
}

TEST(FieldError, IsNotReadOutOfASentence) {
  const absl::Status status = absl::InvalidArgumentError("session: must be given");
  EXPECT_EQ(FieldOf(status), std::nullopt);
  EXPECT_EQ(SentenceOf(status), "session: must be given");
}

TEST(FieldError, OfTheWholeHasNoPathInItsMessage) {
  const absl::Status status = InvalidField(FieldPath(), "name must not be empty");
  EXPECT_EQ(status.message(), "name must not be empty");
  EXPECT_EQ(Within({"uncertain", 0}, status).message(), "uncertain[0]: name must not be empty");
}

TEST(Within, PutsTheOuterPlaceInFrontAndKeepsTheRest) {
  absl::Status inner =
      FieldError(absl::StatusCode::kResourceExhausted, "noise.absolute", "too much");
  inner.SetPayload("other", absl::Cord("kept"));
  const absl::Status status = Within({"measured", 0}, inner);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message(), "measured[0].noise.absolute: too much");
  EXPECT_EQ(FieldOf(status), (FieldPath{"measured", 0, "noise", "absolute"}));
  EXPECT_EQ(status.GetPayload("other"), absl::Cord("kept"));
}

TEST(Within, GivesAPlaceToARefusalWithoutOneAndToNothingElse) {
  EXPECT_EQ(Within("inputs[2]", absl::InvalidArgumentError("it needs a signal")),
            InvalidField("inputs[2]", "it needs a signal"));
  EXPECT_EQ(Within("inputs[2]", absl::CancelledError("stopped")), absl::CancelledError("stopped"));
  EXPECT_TRUE(Within("inputs[2]", absl::OkStatus()).ok());
  EXPECT_EQ(*Within("inputs[2]", absl::StatusOr<int>(3)), 3);
}

TEST(Within, LeavesASentenceAloneThatNamesThePlaceInWords) {
  const absl::Status row =
      NamedInWords({"time_s", 3}, absl::InvalidArgumentError("row 3, column t: too early"));
  const absl::Status status = Within("measurements", row);
  EXPECT_EQ(status.message(), "row 3, column t: too early");
  EXPECT_EQ(FieldOf(status)->ToString(), "measurements.time_s[3]");
  EXPECT_EQ(SentenceOf(status), status.message());
}

TEST(RenameFields, RenamesNamesAndNoKeys) {
  const absl::Status status =
      RenameFields(InvalidField({"fixed", FieldStep::Key("a_b"), 0, "c"}, "bad"),
                   [](const std::string& name) { return absl::AsciiStrToUpper(name); });
  EXPECT_EQ(status.message(), "FIXED.a_b[0].C: bad");
}

}  // namespace
}  // namespace polyest::internal
