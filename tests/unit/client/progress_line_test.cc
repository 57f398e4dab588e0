#include "client/cli/progress_line.h"

#include <gtest/gtest.h>

#include "client/cli/stream_progress.h"
#include "core/common/check.h"
#include "tests/testing/test_folder.h"

#include <fcntl.h>
#include <unistd.h>

namespace polyest::internal {
namespace {

RowBlock Rows(int count) {
  RowBlock block;
  for (int i = 0; i < count; ++i) block.rows.push_back({0, 0.1 * i});
  block.values.assign(static_cast<size_t>(count), 1.0);
  block.noise.assign(static_cast<size_t>(count), 1.0);
  return block;
}

TEST(EstimationProgress, TellsTakingFromReExpanding) {
  const auto progress = std::make_shared<EstimationProgress>();
  WatchedStore store(progress);
  EXPECT_EQ(progress->Describe(), "computing");
  ASSERT_TRUE(store.Append(Rows(100)).ok());
  EXPECT_EQ(progress->Describe(), "computing");
  RowBlock block;
  ASSERT_TRUE(store.Read(0, 64, block).ok());
  EXPECT_EQ(block.count(), 64);
  EXPECT_EQ(progress->Describe(), "row 64 of 100");
  ASSERT_TRUE(store.Read(0, 10, block).ok());
  EXPECT_EQ(progress->Describe(), "re-expanding, row 10 of 64");
  ASSERT_TRUE(store.Read(64, 36, block).ok());
  EXPECT_EQ(progress->Describe(), "all 100 rows taken, assessing the posterior");
}

TEST(StreamProgress, CountsTheRowsOfAFile) {
  const TestFolder folder;
  const std::string file = folder / "d.csv";
  std::ofstream(file) << "t,x\n0,1\n1,2\n2,3";
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_GE(descriptor, 0);
  StreamProgress progress;
  EXPECT_EQ(progress.Describe(), "waiting for data");
  progress.CountRowsOf(descriptor);
  EXPECT_EQ(lseek(descriptor, 0, SEEK_CUR), 0);
  close(descriptor);
  progress.AddRows(2);
  EXPECT_EQ(progress.Describe(), "row 2 of 3 sent");
  progress.SetEstimateTime(1.5);
  EXPECT_EQ(progress.Describe(), "row 2 of 3 sent, estimate up to t = 1.5 s");
}

TEST(StreamProgress, LeavesAPipeAlone) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  ASSERT_EQ(write(ends[1], "t\n0\n", 4), 4);
  StreamProgress progress;
  progress.CountRowsOf(ends[0]);
  progress.AddRows(1);
  EXPECT_EQ(progress.Describe(), "row 1 sent");
  char first = 0;
  EXPECT_EQ(read(ends[0], &first, 1), 1);
  EXPECT_EQ(first, 't');
  close(ends[0]);
  close(ends[1]);
}

}  // namespace
}  // namespace polyest::internal
