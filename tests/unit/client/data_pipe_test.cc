// Reads data files from pipes, without waiting for more than the next row.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "tests/testing/test_folder.h"
#include "tests/unit/client/data_file_cases.h"

namespace polyest::internal {
namespace {

// A pipe that has so much of a text and no more: reading on fails the test.
class Pipe : public std::streambuf {
 public:
  void Add(std::string text) {
    rest_ = std::move(text);
    setg(rest_.data(), rest_.data(), rest_.data() + rest_.size());
  }

 protected:
  int_type underflow() override {
    ADD_FAILURE() << "the reader waits for more than it needs";
    return traits_type::eof();
  }

 private:
  std::string rest_;
};

TEST(DataPipe, ReturnsRowsAsSoonAsTheyAreThere) {
  Pipe pipe;
  std::istream in(&pipe);
  pipe.Add("t;x [mm]\r\n");
  auto reader = DataReader::Open(in, "pipe", XAndForce());
  ASSERT_TRUE(reader.ok()) << reader.status();
  for (int row = 0; row < 3; ++row) {
    // The end of a line may come after its carriage return.
    pipe.Add(absl::StrCat(row == 0 ? "" : "\n", row, ";", row, ",5\r"));
    const auto batch = reader->Read(1);
    ASSERT_TRUE(batch.ok()) << batch.status();
    EXPECT_EQ(batch->time_s_size(), 1);
    EXPECT_EQ(batch->channels(0).values(0), (row + 0.5) / 1000);
  }
  EXPECT_EQ(reader->Found(),
            "pipe: semicolons, decimal comma; 'x [mm]' → x, mm → m; the first 3 rows from 0 s");
}

TEST(DataPipe, CountsRowsWithSeparators) {
  std::string text = "t;x\n";
  for (int row = 0; row < 1'234; ++row) absl::StrAppend(&text, row, ";1\n");
  std::string found;
  Outcome(text, nullptr, &found);
  EXPECT_EQ(found, "d.csv: semicolons; 1,234 rows from 0 s");
}

// A program that is killed leaves what it had written so far of a block: "0.3,0.123" as "0.3,0".
TEST(DataPipe, TakesNoMeasurementFromALineWithoutItsEnd) {
  const auto whole_lines = [](DataColumns& columns) { columns.options.whole_lines = true; };
  EXPECT_EQ(Outcome("t,x\n0.1,1\n0.2,2\n0.3,0", whole_lines), "t=0.1,0.2 x=1,2");
  EXPECT_EQ(Outcome("t,x\n0.1,1\n0.2,2\n", whole_lines), "t=0.1,0.2 x=1,2");
  EXPECT_EQ(Outcome("t,x\n0.1,1\r\n0.2", whole_lines), "t=0.1 x=1");
  EXPECT_EQ(Outcome("t,x\n0.1,1", whole_lines),
            "d.csv: has no rows below its header but one that has no end");
}

TEST(DataPipe, SaysThatALineHasNoEnd) {
  const auto said = [](const std::string& text, bool whole_lines) {
    DataColumns columns = XAndForce();
    columns.options.whole_lines = whole_lines;
    std::istringstream in(text);
    auto reader = DataReader::Open(in, "pipe", columns);
    EXPECT_TRUE(reader.ok() && reader->Read(10).ok());
    return reader->UnendedLine();
  };
  EXPECT_EQ(said("t,x\n0,1\n1,2", true), "pipe:3: the last line has no end and is left out");
  EXPECT_EQ(said("t,x\n0,1\n1,2", false),
            "pipe:3: the last line has no end; its last value may be cut off");
  EXPECT_EQ(said("t,x\n0,1\n1,2\n", true), "");
  EXPECT_EQ(said("t,x\n0,1\n1,2\n\n  ", false), "");
}

TEST(DataPipe, SaysOfAFileWithoutALastEndWhatIsFoundFirst) {
  const TestFolder folder;
  const std::string file = folder.Write("d.csv", "t;x\n0;1\n1;2");
  std::string found;
  const auto data = ReadDataFile(file, XAndForce(), StopAtRefusedLine, &found);
  ASSERT_TRUE(data.ok()) << data.status();
  EXPECT_EQ(data->time_s_size(), 2);
  EXPECT_EQ(found, file + ": semicolons; 2 rows from 0 s\n" + file +
                       ":3: the last line has no end; its last value may be cut off");
}

}  // namespace
}  // namespace polyest::internal
