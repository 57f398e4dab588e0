#include "client/cli/exit_status.h"

#include <gtest/gtest.h>

#include <sstream>

#include "core/common/field_error.h"

namespace polyest::internal {
namespace {

constexpr char kServer[] = "rig:50051";

TEST(ExitStatusOf, TellsBadInputFromARefusal) {
  EXPECT_EQ(ExitStatusOf(absl::OkStatus(), ""), 0);
  EXPECT_EQ(ExitStatusOf(absl::InvalidArgumentError(""), kServer), 2);
  EXPECT_EQ(ExitStatusOf(absl::NotFoundError(""), kServer), 2);
  EXPECT_EQ(ExitStatusOf(absl::AlreadyExistsError(""), kServer), 2);
  EXPECT_EQ(ExitStatusOf(absl::UnavailableError(""), kServer), 3);
  EXPECT_EQ(ExitStatusOf(absl::UnavailableError(""), ""), 1);  // a model cannot be asked
  EXPECT_EQ(ExitStatusOf(absl::AbortedError(""), kServer), 3);
  EXPECT_EQ(ExitStatusOf(absl::DeadlineExceededError(""), kServer), 3);
  EXPECT_EQ(ExitStatusOf(absl::DeadlineExceededError(""), ""), 1);
  EXPECT_EQ(ExitStatusOf(absl::InternalError(""), kServer), 1);
}

TEST(ExitStatusOf, TakesALimitPassedInThisProcessForBadInput) {
  EXPECT_EQ(ExitStatusOf(absl::ResourceExhaustedError(""), ""), 2);
  EXPECT_EQ(ExitStatusOf(absl::ResourceExhaustedError(""), kServer), 3);
}

TEST(ExitStatusOf, TakesWhatADaemonsStateDoesNotAllowForARefusal) {
  EXPECT_EQ(ExitStatusOf(absl::FailedPreconditionError(""), kServer), 3);
  EXPECT_EQ(ExitStatusOf(absl::FailedPreconditionError(""), ""), 2);
}

TEST(Report, PrintsOneLine) {
  std::ostringstream err;
  EXPECT_EQ(Report(absl::InvalidArgumentError("first\nsecond"), "", err), 2);
  EXPECT_EQ(err.str(), "polyest: first second\n");
}

TEST(Report, NamesTheServerThatRefused) {
  std::ostringstream err;
  EXPECT_EQ(Report(absl::UnavailableError("no route"), kServer, err), 3);
  EXPECT_EQ(err.str(), "polyest: server rig:50051: no route\n");
}

TEST(Report, NamesTheOptionThatMakesACommandGiveUp) {
  std::ostringstream err;
  EXPECT_EQ(Report(absl::DeadlineExceededError("Deadline Exceeded"), kServer, err), 3);
  EXPECT_EQ(err.str(), "polyest: server rig:50051: there is no answer within the --deadline\n");
}

TEST(Report, NamesTheOptionInPlaceOfTheField) {
  std::ostringstream err;
  EXPECT_EQ(Report(InvalidField("probabilities[0]", "2 must be above 0 and below 1"), "", err), 2);
  EXPECT_EQ(Report(InvalidField("fixed.q", "unknown"), "", err), 2);
  EXPECT_EQ(err.str(),
            "polyest: --quantiles: 2 must be above 0 and below 1\npolyest: fixed.q: unknown\n");
}

}  // namespace
}  // namespace polyest::internal
