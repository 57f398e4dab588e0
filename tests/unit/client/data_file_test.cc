#include "polyest/data_file.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <sstream>

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

const DataColumns kColumns = {{"x", "v"}, {"force"}};
const DataColumns kMeasuredOnly = {{"x", "v"}, {}};

absl::StatusOr<v1::Measurements> ReadAll(const std::string& text,
                                         const DataColumns& columns = kMeasuredOnly) {
  std::istringstream in(text);
  auto reader = DataReader::Open(in, "data.csv", columns);
  if (!reader.ok()) return reader.status();
  return reader->Read(std::numeric_limits<int64_t>::max());
}

// Returns the message with which a bad file is refused.
std::string ErrorOf(const std::string& text, const DataColumns& columns = kMeasuredOnly) {
  const auto data = ReadAll(text, columns);
  EXPECT_EQ(data.status().code(), absl::StatusCode::kInvalidArgument) << text;
  return std::string(data.status().message());
}

TEST(DataReader, ReadsColumnsByName) {
  const auto data = ReadAll("t,v,x,force\n0,1,2,3\n0.5,-1e-3,2.5,+4\n", kColumns);
  ASSERT_TRUE(data.ok()) << data.status();
  EXPECT_THAT(data->time_s(), ElementsAre(0, 0.5));
  EXPECT_THAT(data->run(), IsEmpty());
  ASSERT_THAT(data->channels(), SizeIs(3));
  EXPECT_EQ(data->channels(0).name(), "v");
  EXPECT_THAT(data->channels(0).values(), ElementsAre(1, -1e-3));
  EXPECT_EQ(data->channels(1).name(), "x");
  EXPECT_THAT(data->channels(1).values(), ElementsAre(2, 2.5));
  EXPECT_EQ(data->channels(2).name(), "force");
  EXPECT_THAT(data->channels(2).values(), ElementsAre(3, 4));
}

TEST(DataReader, ReadsEveryDigit) {
  const auto data = ReadAll("t,x\n0.1,6.0221407599999999e23\n");
  ASSERT_TRUE(data.ok()) << data.status();
  EXPECT_EQ(data->time_s(0), 0.1);
  EXPECT_EQ(data->channels(0).values(0), 6.0221407599999999e23);
}

TEST(DataReader, TakesAnEmptyCellForAMissingSample) {
  const auto data = ReadAll("t,x,v\n0,,2\n1,3,\n2,4,\n");
  ASSERT_TRUE(data.ok()) << data.status();
  EXPECT_THAT(data->channels(0).missing(), ElementsAre(0));
  EXPECT_THAT(data->channels(0).values(), ElementsAre(0, 3, 4));
  EXPECT_THAT(data->channels(1).missing(), ElementsAre(1, 2));
}

TEST(DataReader, AcceptsCarriageReturnsSpacesBlankLinesAMarkAndNoLastLineEnd) {
  const auto data = ReadAll("\xEF\xBB\xBFt, x\r\n\r\n0 ,1\r\n 1,\t2\r\n\r\n2,3");
  ASSERT_TRUE(data.ok()) << data.status();
  EXPECT_THAT(data->time_s(), ElementsAre(0, 1, 2));
  EXPECT_THAT(data->channels(0).values(), ElementsAre(1, 2, 3));
}

TEST(DataReader, RestartsTheClockAtANewRun) {
  const auto data = ReadAll("t,run,x\n0,0,1\n1,0,2\n0.5,1,3\n0,2,4\n");
  ASSERT_TRUE(data.ok()) << data.status();
  EXPECT_THAT(data->run(), ElementsAre(0, 0, 1, 2));
  EXPECT_THAT(data->time_s(), ElementsAre(0, 1, 0.5, 0));
}

TEST(DataReader, CutsTheSameRowsIntoBatches) {
  std::istringstream in("t,run,x\n0,0,\n1,0,2\n2,0,3\n3,0,\n4,0,5\n");
  auto reader = DataReader::Open(in, "data.csv", kMeasuredOnly);
  ASSERT_TRUE(reader.ok()) << reader.status();
  std::vector<v1::Measurements> batches;
  for (int i = 0; i < 4; ++i) {
    auto batch = reader->Read(2);
    ASSERT_TRUE(batch.ok()) << batch.status();
    batches.push_back(*batch);
  }
  EXPECT_THAT(batches[0].time_s(), ElementsAre(0, 1));
  EXPECT_THAT(batches[0].channels(0).missing(), ElementsAre(0));
  EXPECT_THAT(batches[1].time_s(), ElementsAre(2, 3));
  EXPECT_THAT(batches[1].run(), ElementsAre(0, 0));
  EXPECT_THAT(batches[1].channels(0).missing(), ElementsAre(1));
  EXPECT_THAT(batches[2].time_s(), ElementsAre(4));
  EXPECT_THAT(batches[3].time_s(), IsEmpty());
}

TEST(DataReader, ChecksTimesFromOneBatchToTheNext) {
  std::istringstream in("t,x\n0,1\n1,2\n1,3\n");
  auto reader = DataReader::Open(in, "data.csv", kMeasuredOnly);
  ASSERT_TRUE(reader.ok()) << reader.status();
  ASSERT_TRUE(reader->Read(2).ok());
  EXPECT_EQ(reader->Read(2).status().message(),
            "data.csv:4: column t: 1 must be later than 1 of the row before");
}

TEST(DataReader, KeepsTheRowsBeforeARefusedLine) {
  std::istringstream in("t,x\n0,1\n1,2\n2,many\n3,4\n");
  auto reader = DataReader::Open(in, "data.csv", kMeasuredOnly);
  ASSERT_TRUE(reader.ok()) << reader.status();
  v1::Measurements batch;
  EXPECT_EQ(reader->Read(10, batch).message(), "data.csv:4: column x: \"many\" must be a number");
  EXPECT_THAT(batch.time_s(), ElementsAre(0, 1));
  EXPECT_THAT(batch.channels(0).values(), ElementsAre(1, 2));
}

TEST(DataReader, KnowsTheLinesOfItsRows) {
  std::istringstream in("rig 3\n# t in s\nt,x\ns,m\n0,1\n1,2\n\n# a pause\n2,3\n2,4\n3,4\n");
  auto reader = DataReader::Open(in, "data.csv", kMeasuredOnly);
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ(reader->Lines().LineOf(0), 0);
  const auto leave_out = [](const absl::Status&) { return absl::OkStatus(); };
  while (reader->Read(1, leave_out)->time_s_size() > 0) continue;
  const RowLines& lines = reader->Lines();
  EXPECT_EQ(lines.LineOf(-1), 0);
  EXPECT_EQ(lines.LineOf(0), 5);
  EXPECT_EQ(lines.LineOf(1), 6);
  EXPECT_EQ(lines.LineOf(2), 9);
  EXPECT_EQ(lines.LineOf(3), 11);
  EXPECT_EQ(lines.LineOf(4), 0);
}

TEST(DataReader, MayBeginWithALaterRun) {
  DataColumns columns = kMeasuredOnly;
  columns.options.any_first_run = true;
  std::istringstream in("t,run,x\n0,2,1\n1,2,2\n");
  auto reader = DataReader::Open(in, "data.csv", columns);
  ASSERT_TRUE(reader.ok()) << reader.status();
  const auto batch = reader->Read(10);
  ASSERT_TRUE(batch.ok()) << batch.status();
  EXPECT_THAT(batch->run(), ElementsAre(2, 2));
}

TEST(DataReader, RefusesTextAndSaysWhere) {
  EXPECT_EQ(ErrorOf("t,x\n0,1\n1,abc\n"), "data.csv:3: column x: \"abc\" must be a number");
  EXPECT_EQ(ErrorOf("t,x\n0,1.5m\n"), "data.csv:2: column x: \"1.5m\" must be a number");
  EXPECT_EQ(ErrorOf("t,x\n0,1 2\n"), "data.csv:2: column x: \"1 2\" must be a number");
  EXPECT_EQ(ErrorOf("t,x\n0,+-1\n"), "data.csv:2: column x: \"+-1\" must be a number");
  EXPECT_EQ(ErrorOf("t,x\nx,1\n"),
            "data.csv:2: column t: \"x\" must be a number, or a time such as "
            "2026-01-31T13:00:00.5 or 13:00:00.5");
  EXPECT_THAT(ErrorOf("t,x\n0,1e999\n"), HasSubstr("\"1e999\" is out of the range of a double"));
}

TEST(DataReader, RefusesWhatIsNotFinite) {
  for (const char* const cell : {"inf", "-inf", "Infinity"}) {
    EXPECT_THAT(ErrorOf(absl::StrCat("t,x\n0,", cell, "\n")),
                StartsWith(absl::StrCat("data.csv:2: column x: \"", cell, "\" must be finite")));
  }
  EXPECT_THAT(
      ErrorOf("t,x\nnan,1\n"),
      StartsWith("data.csv:2: column t: a value is missing (nan); every row needs its time"));
}

TEST(DataReader, RefusesTimesThatGoBackStandStillOrAreNegative) {
  EXPECT_EQ(ErrorOf("t,x\n0,1\n2,2\n1.5,3\n"),
            "data.csv:4: column t: 1.5 must be later than 2 of the row before; a new run needs a "
            "column run "
            "that changes");
  EXPECT_EQ(ErrorOf("t,x\n1769903998.0625,1\n1769903998.03125,2\n"),
            "data.csv:3: column t: 1769903998.03125 must be later than 1769903998.0625 of the row "
            "before; a new run needs a column run that changes");
  EXPECT_EQ(ErrorOf("t,x\n23:59:59.5,1\n00:00:00.5,2\n"),
            "data.csv:3: column t: 0.5 must be later than 86399.5 of the row before; a record that "
            "passes midnight needs dates");
  EXPECT_EQ(ErrorOf("t,run,x\n0,0,1\n0,1,2\n0,1,3\n"),
            "data.csv:4: column t: 0 must be later than 0 of the row before");
  EXPECT_EQ(ErrorOf("t,x\n-1,1\n"),
            "data.csv:2: column t: -1 must be ≥ 0; --time-zero first lets the time begin at the "
            "first row");
  EXPECT_THAT(ErrorOf("t,x\n,1\n"), StartsWith("data.csv:2: column t: a value is missing"));
}

TEST(DataReader, RefusesRunsThatAreNoneStartLateOrDecrease) {
  EXPECT_EQ(ErrorOf("t,run,x\n0,a,1\n"),
            "data.csv:2: column run: \"a\" must be a whole number ≥ 0");
  EXPECT_EQ(ErrorOf("t,run,x\n0,-1,1\n"),
            "data.csv:2: column run: \"-1\" must be a whole number ≥ 0");
  EXPECT_EQ(ErrorOf("t,run,x\n0,0.5,1\n"),
            "data.csv:2: column run: \"0.5\" must be a whole number ≥ 0");
  EXPECT_EQ(ErrorOf("t,run,x\n0,1,1\n"),
            "data.csv:2: column run: the first row's run is 1, it must be 0");
  EXPECT_EQ(ErrorOf("t,run,x\n0,0,1\n0,1,1\n1,0,1\n"),
            "data.csv:4: column run: 0 after 1; it must not decrease");
}

TEST(DataReader, RefusesAHeaderThatIsMissing) {
  EXPECT_EQ(ErrorOf("0,1\n1,2\n"),
            "data.csv:1: no column is the time t; the first line must name the columns, and the "
            "file's columns are \"0\", \"1\"; --time-column \"0\" or \"columns\": {\"t\": "
            "{\"from\": \"0\"}} in the problem names it");
  EXPECT_THAT(ErrorOf("x,v\n1,0\n"), StartsWith("data.csv:1: no column is the time t;"));
}

TEST(DataReader, LeavesOutUnknownColumns) {
  const auto data = ReadAll("t,y,x,\n0,a,2,\n");
  ASSERT_TRUE(data.ok()) << data.status();
  ASSERT_THAT(data->channels(), SizeIs(1));
  EXPECT_THAT(data->channels(0).values(), ElementsAre(2));
}

TEST(DataReader, RefusesRepeatedAndMisspeltColumns) {
  EXPECT_EQ(ErrorOf("t,x,x\n0,1,2\n"),
            "data.csv:1: the column \"x\" is named twice; columns.x.from of the problem takes a "
            "whole header");
  EXPECT_EQ(ErrorOf("t,t,x\n0,1,2\n"), "data.csv:1: the column \"t\" is named twice");
  EXPECT_EQ(ErrorOf("t,x,Force\n0,1,2\n", kColumns),
            "data.csv:1: unknown column \"Force\"; did you mean \"force\"? Rename it, or map it in "
            "the problem: \"columns\": {\"force\": {\"from\": \"Force\"}}");
}

TEST(DataReader, RefusesAStreamedInputThatIsNotThere) {
  EXPECT_EQ(ErrorOf("t,x\n0,1\n", kColumns),
            "data.csv:1: the column \"force\" for the streamed input of that name is missing; the "
            "file's columns are \"t\", \"x\"");
}

TEST(DataReader, ReadsChannelsWithTimesOfTheirOwnAndTheColumnsOfACondition) {
  v1::Problem problem;
  problem.add_measured()->set_output("x");
  v1::Input& force = *problem.add_inputs();
  force.set_name("force");
  force.mutable_streamed();
  problem.set_use_when("speed > 5 && x < t");
  const DataColumns columns = ColumnsOf(problem);
  EXPECT_EQ(columns.conditions, std::vector<std::string>{"speed"});
  std::istringstream in("t,x,force,speed\n0,1,,3\n0.5,,7,\n");
  auto reader = DataReader::Open(in, "data.csv", columns);
  ASSERT_TRUE(reader.ok()) << reader.status();
  const auto batch = reader->Read(10);
  ASSERT_TRUE(batch.ok()) << batch.status();
  ASSERT_EQ(batch->channels_size(), 3);
  for (const auto& channel : batch->channels()) {
    ASSERT_EQ(channel.missing_size(), 1) << channel.name();
    EXPECT_EQ(channel.missing(0), channel.name() == "force" ? 0 : 1) << channel.name();
  }
  EXPECT_EQ(ErrorOf("t,x,force\n0,1,2\n", columns),
            "data.csv:1: the column \"speed\", which useWhen names, is missing; the file's columns "
            "are \"t\", \"x\", \"force\"");
}

TEST(DataReader, RefusesRaggedRows) {
  EXPECT_EQ(ErrorOf("t,x\n0,1\n1\n"), "data.csv:3: the row has 1 cells, the header has 2");
  EXPECT_EQ(ErrorOf("t,x\n0,1,2\n"),
            "data.csv:2: the row has 3 cells, the header has 2; numbers with a decimal comma need "
            "another "
            "delimiter or quotes");
}

TEST(DataReader, RefusesAFileWithoutAnything) {
  EXPECT_THAT(ErrorOf(""), StartsWith("data.csv: is empty"));
  EXPECT_THAT(ErrorOf("\n\r\n"), StartsWith("data.csv: is empty"));
  EXPECT_EQ(ErrorOf("t,x\n"), "data.csv: has no rows below its header");
}

TEST(DataReader, RefusesALineThatNeverEnds) {
  EXPECT_EQ(ErrorOf(absl::StrCat("t,x\n0,", std::string(100'000, '1'), "\n")),
            "data.csv:2: the line is longer than 65535 bytes");
}

TEST(DataReader, ShowsOnlyTheStartOfALongCell) {
  EXPECT_EQ(ErrorOf(absl::StrCat("t,x\n0,", std::string(100, 'z'), "\n")),
            absl::StrCat("data.csv:2: column x: \"", std::string(40, 'z'), "…\" must be a number"));
}

TEST(ReadDataFile, NamesAFileThatCannotBeOpened) {
  const auto data = ReadDataFile("/nowhere/data.csv", kMeasuredOnly);
  EXPECT_EQ(data.status().message(),
            "/nowhere/data.csv: cannot be opened: No such file or directory");
}

TEST(ReadDataFile, RefusesAFolder) {
  EXPECT_EQ(ReadDataFile("/", kMeasuredOnly).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ColumnsOf, AreMeasuredOutputsAndStreamedInputs) {
  v1::Problem problem;
  problem.add_measured()->set_output("x");
  problem.add_inputs()->set_name("force");
  problem.mutable_inputs(0)->mutable_constant()->set_amplitude(1);
  problem.add_inputs()->set_name("road");
  problem.mutable_inputs(1)->mutable_streamed();
  const DataColumns columns = ColumnsOf(problem);
  EXPECT_THAT(columns.measured, ElementsAre("x"));
  EXPECT_THAT(columns.streamed, ElementsAre("road"));
}

// Holds the good lines of a file and the refusals of the bad ones.
struct Sieved {
  absl::StatusOr<v1::Measurements> data;
  std::vector<std::string> refusals;
};

Sieved Sieve(const std::string& text, const DataColumns& columns = kMeasuredOnly) {
  Sieved sieved;
  const auto refused = [&sieved](const absl::Status& refusal) {
    sieved.refusals.emplace_back(refusal.message());
    return absl::OkStatus();
  };
  std::istringstream in(text);
  auto reader = DataReader::Open(in, "data.csv", columns, refused);
  sieved.data =
      reader.ok() ? reader->Read(std::numeric_limits<int64_t>::max(), refused) : reader.status();
  return sieved;
}

TEST(DataReader, GoesOnAfterABadLineIfAsked) {
  const Sieved sieved =
      Sieve("t,x,v,run\n0,1,,0\n1,?,2,0\n2,,?,0\n3,4,,0\n2,9,9,0\n4,5,6,x\n5,7\n6,8,9,1\n");
  EXPECT_THAT(sieved.refusals,
              ElementsAre(HasSubstr("data.csv:3: column x: \"?\""),
                          HasSubstr("data.csv:4: column v: \"?\""),
                          HasSubstr("data.csv:6: column t: 2 must be later than 3"),
                          HasSubstr("data.csv:7: column run: \"x\""),
                          HasSubstr("data.csv:8: the row has 2 cells")));
  ASSERT_TRUE(sieved.data.ok()) << sieved.data.status();
  // The result keeps nothing of a refused row.
  EXPECT_THAT(sieved.data->time_s(), ElementsAre(0, 3, 6));
  EXPECT_THAT(sieved.data->run(), ElementsAre(0, 0, 1));
  EXPECT_THAT(sieved.data->channels(0).values(), ElementsAre(1, 4, 8));
  EXPECT_THAT(sieved.data->channels(0).missing(), IsEmpty());
  EXPECT_THAT(sieved.data->channels(1).values(), ElementsAre(0, 0, 9));
  EXPECT_THAT(sieved.data->channels(1).missing(), ElementsAre(0, 1));
}

TEST(RowLines, ForgetTheOldestWhereALineIsBetweenRows) {
  RowLines lines;
  constexpr int64_t kRows = 200'000;
  for (int64_t row = 0; row < kRows; ++row) lines.Add(2 * row + 2);
  EXPECT_EQ(lines.LineOf(0), 0);
  EXPECT_EQ(lines.LineOf(kRows - 1), 2 * kRows);
  EXPECT_EQ(lines.LineOf(kRows - 30'000), 2 * (kRows - 30'000) + 2);
  EXPECT_EQ(lines.LineOf(kRows), 0);
}

TEST(DataReader, SaysOfTheRowsAfterAClockWentBackFromWhereItDid) {
  const Sieved sieved =
      Sieve("t,x,v,run\n0,1,1,0\n5,1,1,0\n1,1,1,0\n2,1,1,0\n6,1,1,0\n5.5,1,1,0\n");
  EXPECT_THAT(
      sieved.refusals,
      ElementsAre(HasSubstr("data.csv:4: column t: 1 must be later than 5 of the row before"),
                  HasSubstr("data.csv:5: column t: 2 must be later than 5, where the time "
                            "went back; a new run needs a column run that changes"),
                  HasSubstr("data.csv:7: column t: 5.5 must be later than 6 of the row before")));
}

TEST(DataReader, GoesOnAfterABadColumnIfAsked) {
  const Sieved sieved = Sieve("t,v,x,x\n0,1,a,b\n1,?,a,b\n", kColumns);
  EXPECT_THAT(sieved.refusals, ElementsAre(HasSubstr("\"x\" is named twice"),
                                           HasSubstr("the column \"force\" for the streamed input"),
                                           HasSubstr("data.csv:3: column v")));
  ASSERT_TRUE(sieved.data.ok()) << sieved.data.status();
  ASSERT_THAT(sieved.data->channels(), SizeIs(1));
  EXPECT_EQ(sieved.data->channels(0).name(), "v");
  EXPECT_FALSE(Sieve("x,v\n1,2\n").data.ok());
}

TEST(DataReader, SaysOnlyOnceThatThereIsNoGoodRow) {
  const Sieved sieved = Sieve("t,x\n0,?\n");
  EXPECT_THAT(sieved.refusals, SizeIs(1));
  EXPECT_TRUE(sieved.data.ok()) << sieved.data.status();
}

}  // namespace
}  // namespace polyest::internal
