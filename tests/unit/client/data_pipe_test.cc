// Reads data files from pipes, without waiting for more than the next row.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace polyest::internal
