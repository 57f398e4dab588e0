#include "core/estimator/record/checkpoints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;

TEST(Checkpoints, AreAFunctionOfTheRecord) {
  std::vector<SampleRow> rows;
  for (int run = 0; run < 3; ++run) {
    for (int k = 0; k < 25; ++k) rows.push_back({run, 0.1 * k});
  }
  for (const bool inside_runs : {true, false}) {
    for (const size_t batch : {1U, 7U, 75U}) {
      Checkpoints checkpoints(10, inside_runs);
      std::vector<int64_t> all;
      for (size_t first = 0; first < rows.size(); first += batch) {
        const auto begin = rows.begin() + static_cast<std::ptrdiff_t>(first);
        const size_t count = std::min(batch, rows.size() - first);
        checkpoints.Add({begin, begin + static_cast<std::ptrdiff_t>(count)});
        for (; checkpoints.next(); checkpoints.Pass(all.back())) all.push_back(*checkpoints.next());
      }
      if (inside_runs) {
        EXPECT_THAT(all, ElementsAre(10, 20, 35, 45, 60, 70));
      } else {
        EXPECT_THAT(all, ElementsAre(25, 50));
      }
    }
  }
}

}  // namespace
}  // namespace polyest::internal
