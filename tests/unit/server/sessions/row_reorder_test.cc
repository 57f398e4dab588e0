#include "server/sessions/row_reorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/common/sanitizer.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kWindow_s = 0.25;

struct Sample {
  std::string column;
  double time_s = 0;
  int run = 0;
};

// The value tells column, time and run, so that no two samples can be confused.
double ValueOf(const Sample& sample) {
  return 1'000 * sample.run + sample.time_s + 100 * static_cast<double>(sample.column[0] - 'a');
}

// Returns a batch with one row for each sample.
Samples BatchOf(const std::vector<Sample>& samples, bool end_of_run = false) {
  Samples batch;
  batch.end_of_run = end_of_run;
  for (const char* name : {"u", "x", "v"}) {
    SampleColumn column{name, {}, {}};
    for (const Sample& sample : samples) {
      column.value.push_back(ValueOf(sample));
      column.missing.push_back(sample.column != name);
    }
    batch.columns.push_back(std::move(column));
  }
  for (const Sample& sample : samples) {
    batch.time_s.push_back(sample.time_s);
    batch.run.push_back(sample.run);
  }
  return batch;
}

// Collects the rows released, each as its run, its time and its samples.
struct Collector {
  void Take(const Samples& samples) {
    const absl::StatusOr<RowReorder::Step> step = reorder.Next(samples);
    ASSERT_TRUE(step.ok()) << step.status();
    Add(step->released);
    reorder.Accept(*step);
  }
  void Add(const Samples& released) {
    for (size_t row = 0; row < released.rows(); ++row) {
      std::vector<double> one = {static_cast<double>(released.run[row]), released.time_s[row]};
      for (const SampleColumn& column : released.columns) {
        if (!column.missing[row]) one.push_back(column.value[row]);
      }
      rows.push_back(one);
    }
  }
  std::vector<double> Times() const {
    std::vector<double> times;
    for (const auto& row : rows) times.push_back(row[1]);
    return times;
  }

  RowReorder reorder{{"x", "v", "u"}, kWindow_s};
  std::vector<std::vector<double>> rows;
};

// Returns the samples of three channels with rates of their own, two runs, in time order.
std::vector<Sample> ThreeChannels() {
  std::vector<Sample> samples;
  for (const int run : {0, 1}) {
    for (int i = 0; i <= 300; ++i) samples.push_back({"x", i / 100.0, run});
    for (int i = 0; i <= 150; ++i) samples.push_back({"v", i / 50.0, run});
    for (int i = 0; i <= 111; ++i) samples.push_back({"u", i / 37.0, run});
  }
  std::ranges::stable_sort(samples, [](const Sample& a, const Sample& b) {
    return a.run != b.run ? a.run < b.run : a.time_s < b.time_s;
  });
  return samples;
}

// Returns the rows that the samples make: computed apart from the class.
std::vector<std::vector<double>> RowsOf(const std::vector<Sample>& ordered) {
  std::vector<std::vector<double>> rows;
  for (size_t i = 0; i < ordered.size();) {
    std::vector<double> row = {static_cast<double>(ordered[i].run), ordered[i].time_s};
    std::vector<double> values(3, std::nan(""));
    size_t next = i;
    for (; next < ordered.size() && ordered[next].run == ordered[i].run &&
           ordered[next].time_s == ordered[i].time_s;
         ++next) {
      values[ordered[next].column == "x"   ? 0
             : ordered[next].column == "v" ? 1
                                           : 2] = ValueOf(ordered[next]);
    }
    std::ranges::copy_if(values, std::back_inserter(row), [](double z) { return !std::isnan(z); });
    rows.push_back(row);
    i = next;
  }
  return rows;
}

// Returns the samples in an order in which each is at most the window late: that of the times at
// which they arrive, each after a delay of up to the window.
std::vector<Sample> Shuffled(const std::vector<Sample>& ordered, std::mt19937& random) {
  std::uniform_real_distribution<double> delay(0, kWindow_s);
  std::vector<std::pair<double, Sample>> arriving;
  for (const Sample& sample : ordered) {
    // Runs follow one another after all samples have arrived.
    arriving.emplace_back(1'000 * sample.run + sample.time_s + delay(random), sample);
  }
  std::ranges::stable_sort(arriving, {}, &std::pair<double, Sample>::first);
  std::vector<Sample> samples;
  for (const auto& [when, sample] : arriving) samples.push_back(sample);
  return samples;
}

TEST(RowReorder, ReleasesTheSameRowsHoweverChannelsAreInterleavedAndCutIntoBatches) {
  const std::vector<Sample> ordered = ThreeChannels();
  const auto expected = RowsOf(ordered);
  std::mt19937 random(1);  // NOLINT(cert-msc51-cpp): the same in every run
  for (int trial = 0; trial < 50; ++trial) {
    const std::vector<Sample> arriving = Shuffled(ordered, random);
    Collector collector;
    for (size_t first = 0; first < arriving.size();) {
      const size_t count =
          std::min<size_t>(arriving.size() - first, 1 + random() % (trial % 2 == 0 ? 3 : 90));
      const auto begin = arriving.begin() + static_cast<std::ptrdiff_t>(first);
      collector.Take(BatchOf({begin, begin + static_cast<std::ptrdiff_t>(count)}));
      first += count;
    }
    EXPECT_LT(collector.rows.size(), expected.size());
    collector.Take(BatchOf({}, /*end_of_run=*/true));
    ASSERT_EQ(collector.rows, expected) << trial;
  }
}

TEST(RowReorder, HoldsRowsBackForTheWindowAndNoLonger) {
  Collector collector;
  collector.Take(BatchOf({{"x", 0}, {"x", 0.5}, {"x", 0.25}}));
  EXPECT_THAT(collector.Times(), ElementsAre(0));  // 0.25 is the window behind, not more
  EXPECT_EQ(collector.reorder.held_rows(), 2);
  collector.Take(BatchOf({{"v", 0.25}, {"u", 0.3}}));
  EXPECT_THAT(collector.Times(), ElementsAre(0));
  collector.Take(BatchOf({{"x", 0.75}}));
  EXPECT_THAT(collector.Times(), ElementsAre(0, 0.25, 0.3));
  EXPECT_EQ(collector.rows[1].size(), 4u);  // run, time, x and v
  collector.Take(BatchOf({}, /*end_of_run=*/true));
  EXPECT_THAT(collector.Times(), ElementsAre(0, 0.25, 0.3, 0.5, 0.75));
  EXPECT_EQ(collector.reorder.held_rows(), 0);
}

TEST(RowReorder, ReleasesARunWhenALaterOneBegins) {
  Collector collector;
  collector.Take(BatchOf({{"x", 0.2}, {"v", 0.1}}));
  const auto step = collector.reorder.Next(BatchOf({{"x", 0, 1}}));
  ASSERT_TRUE(step.ok()) << step.status();
  EXPECT_THAT(step->released.time_s, ElementsAre(0.1, 0.2));
  EXPECT_TRUE(step->released.end_of_run);
}

TEST(RowReorder, RefusesWhatComesTooLateWithItsChannelItsRowAndTheTimes) {
  Collector collector;
  collector.Take(BatchOf({{"x", 0.5}, {"x", 1}}));
  const absl::Status late = collector.reorder.Next(BatchOf({{"v", 0.8}, {"v", 0.625}})).status();
  EXPECT_EQ(late.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(late.message(),
            "row 1 (counted from 0), column v: t = 0.625 s comes too late: the newest row is at 1 "
            "s, and the rows "
            "more than reorderWindowS = 0.25 s before it, up to 0.75 s, have been released to the "
            "estimator");
  // A row is late, too, if the row that makes it late is in the same batch: it does not matter how
  // rows are cut into batches.
  EXPECT_THAT(collector.reorder.Next(BatchOf({{"x", 2}, {"v", 1.5}})).status().message(),
              HasSubstr("row 1 (counted from 0), column v: t = 1.5 s comes too late"));
  collector.Take(BatchOf({}, /*end_of_run=*/true));
  EXPECT_THAT(collector.reorder.Next(BatchOf({{"v", 0.9}})).status().message(),
              HasSubstr("row 0 (counted from 0): run 0 has ended"));
  EXPECT_THAT(collector.reorder.Next(BatchOf({{"v", 0, 1}, {"v", 0.9, 0}})).status().message(),
              HasSubstr("row 1 (counted from 0), column run: 0 after 1"));
}

TEST(RowReorder, RefusesASecondSampleOfAChannelAtATime) {
  Collector collector;
  collector.Take(BatchOf({{"x", 0.5}, {"v", 0.5}}));
  const std::string rule = "column x: there is another sample at t = 0.5 s of run 0";
  EXPECT_THAT(collector.reorder.Next(BatchOf({{"u", 0.5}, {"x", 0.5}})).status().message(),
              HasSubstr("row 1 (counted from 0), " + rule));
  EXPECT_THAT(Collector().reorder.Next(BatchOf({{"x", 0.5}, {"x", 0.5}})).status().message(),
              HasSubstr("row 1 (counted from 0), " + rule));
}

TEST(RowReorder, IsLeftAsItWasByABatchThatIsRefused) {
  const std::vector<Sample> first = {{"x", 0}, {"x", 0.5}, {"v", 0.4}};
  const std::vector<Sample> last = {{"u", 0.45}, {"x", 0.9}, {"u", 0.9}};
  Collector untouched, refusing;
  for (Collector* collector : {&untouched, &refusing}) collector->Take(BatchOf(first));
  EXPECT_FALSE(refusing.reorder.Next(BatchOf({{"u", 0.45}, {"u", 7}, {"x", 0.5}})).ok());
  EXPECT_FALSE(refusing.reorder.Next(BatchOf({{"u", 0.6}, {"x", 0.5}})).ok());
  for (Collector* collector : {&untouched, &refusing}) {
    collector->Take(BatchOf(last, /*end_of_run=*/true));
  }
  EXPECT_EQ(refusing.rows, untouched.rows);
  EXPECT_EQ(refusing.rows.size(), 5u);
}

TEST(RowReorder, RefusesMoreRowsThanItMayHoldBack) {
  RowReorder reorder({"x"}, 1'000);
  Samples batch;
  batch.columns = {{"x", {}, {}}};
  for (int64_t row = 0; row < RowReorder::kMaxHeldRows; ++row) {
    batch.time_s.push_back(0.001 * static_cast<double>(row));
    batch.columns[0].value.push_back(1);
  }
  auto step = reorder.Next(batch);
  ASSERT_TRUE(step.ok()) << step.status();
  reorder.Accept(*std::move(step));
  Samples one;
  one.time_s = {500};
  one.columns = {{"x", {1}, {}}};
  const absl::Status refused = reorder.Next(one).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), HasSubstr("100001 rows within reorderWindowS = 1000 s"));
  one.time_s = {1'000.5};  // releases the first ones
  EXPECT_TRUE(reorder.Next(one).ok());
}

// Every batch may be the one from which the rows are read again.
TEST(RowReorder, ReleasesTheSameRowsAfterAResumption) {
  std::mt19937 random(2);  // NOLINT(cert-msc51-cpp): the same in every run
  const std::vector<Sample> arriving = Shuffled(ThreeChannels(), random);
  std::vector<Samples> batches;
  for (size_t first = 0; first < arriving.size(); first += 40) {
    const auto begin = arriving.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end =
        arriving.begin() + static_cast<std::ptrdiff_t>(std::min(arriving.size(), first + 40));
    batches.push_back(BatchOf({begin, end}));
  }
  struct State {
    size_t rows = 0;
    int64_t held_from = 0;
  };
  Collector whole;
  std::vector<State> states;  // after each batch
  for (const Samples& batch : batches) {
    whole.Take(batch);
    states.push_back({whole.rows.size(), whole.reorder.held_from()});
  }
  int64_t longest = 0;
  for (size_t after = 0; after < batches.size(); ++after) {
    const auto [rows, held_from] = states[after];
    longest = std::max(longest, static_cast<int64_t>(after) + 2 - held_from);
    RowReorder::Resumption from{.first_batch = held_from, .released = std::nullopt};
    if (rows > 0) {
      const std::vector<double>& last = whole.rows[rows - 1];
      from.released = SampleRow{static_cast<int>(last[0]), last[1]};
    }
    Collector resumed{.reorder = RowReorder({"x", "v", "u"}, kWindow_s, from), .rows = {}};
    for (size_t next = static_cast<size_t>(held_from) - 1; next < batches.size(); ++next) {
      resumed.Take(batches[next]);
      if (next <= after) {
        ASSERT_TRUE(resumed.rows.empty());
      }
    }
    const std::vector<std::vector<double>> expected(
        whole.rows.begin() + static_cast<std::ptrdiff_t>(rows), whole.rows.end());
    ASSERT_EQ(resumed.rows, expected) << after;
  }
  EXPECT_GE(longest, 2);  // some rows are held back over several batches
}

TEST(RowReorder, HasAWindowOfUpToAnHour) {
  EXPECT_TRUE(CheckReorderWindow("session.reorderWindowS", 0).ok());
  EXPECT_TRUE(CheckReorderWindow("session.reorderWindowS", 3'600).ok());
  for (const double wrong :
       {-1.0, 3'601.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(CheckReorderWindow("session.reorderWindowS", wrong).message(),
                HasSubstr("session.reorderWindowS: "));
  }
}

TEST(RowReorder, WeighsAboutWhatTheAllocatorGivesForTheRowsHeldBack) {
  if (POLYEST_ADDRESS_SANITIZER || POLYEST_THREAD_SANITIZER) {
    GTEST_SKIP() << "a sanitizer has an allocator of its own";
  }
  for (const size_t columns : {1u, 10u, 100u}) {
    std::vector<std::string> names;
    for (size_t column = 0; column < columns; ++column) names.push_back(std::to_string(column));
    Samples batch;
    batch.columns.push_back({names[0], {}, {}});
    for (int row = 0; row < 2'000; ++row) {
      batch.time_s.push_back(1e-3 * row);
      batch.columns[0].value.push_back(row);
    }
    RowReorder reorder(names, /*window_s=*/3600);
    const double before = static_cast<double>(mallinfo2().uordblks);
    auto step = reorder.Next(batch);
    ASSERT_TRUE(step.ok()) << step.status();
    reorder.Accept(*std::move(step));
    step = absl::CancelledError();  // frees what is left of it
    const double given = static_cast<double>(mallinfo2().uordblks) - before;
    ASSERT_EQ(reorder.held_rows(), 2'000);
    EXPECT_NEAR(static_cast<double>(reorder.held_bytes()), given, 0.2 * given) << columns;
  }
}

}  // namespace
}  // namespace polyest::internal
