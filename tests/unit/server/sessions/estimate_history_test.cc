#include "server/sessions/estimate_history.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

v1::Estimate EstimateOfBatch(int64_t sequence) {
  v1::Estimate estimate;
  estimate.set_sequence(sequence);
  estimate.set_time(0.01 * static_cast<double>(sequence));
  return estimate;
}

// Keeps what a journal would.
class Kept {
 public:
  void Save(const std::optional<JournalHistoryPoint>& point, int64_t stride) {
    if (!point) return;
    points_.push_back(*point);
    std::erase_if(points_, [&](const auto& one) { return one.ordinal % stride != 0; });
    ++saved_;
  }
  const std::vector<JournalHistoryPoint>& points() const { return points_; }
  int saved() const { return saved_; }

 private:
  std::vector<JournalHistoryPoint> points_;
  int saved_ = 0;
};

TEST(EstimateHistory, StaysSmallAndEvenlySpacedHoweverManyEstimatesThereAre) {
  constexpr int kEstimates = 100'000;
  EstimateHistory history;
  Kept kept;
  for (int64_t batch = 1; batch <= kEstimates; ++batch) {
    const auto point = history.Add(EstimateOfBatch(batch));
    kept.Save(point, history.stride());
    ASSERT_LE(std::ssize(kept.points()), EstimateHistory::kMaxPoints);
  }
  const v1::EstimateHistory points = history.Points(kept.points());
  EXPECT_GE(points.points_size(), EstimateHistory::kMaxPoints / 2);
  EXPECT_EQ(points.points(0).sequence(), 1);
  EXPECT_EQ(points.points(points.points_size() - 1).sequence(), kEstimates);
  for (int i = 1; i + 1 < points.points_size(); ++i) {
    EXPECT_EQ(points.points(i).sequence() - points.points(i - 1).sequence(), history.stride());
  }
  // 512 points, and half as many for each of the 8 times that the stride doubles.
  EXPECT_LE(kept.saved(), 512 + 8 * 256);

  // What is restored continues in the same way.
  EstimateHistory restored(kept.points());
  EXPECT_EQ(restored.stride(), history.stride());
  EXPECT_EQ(restored.Points(kept.points()).points(0).sequence(), 1);
  const auto point = restored.Add(EstimateOfBatch(kEstimates + 1));
  kept.Save(point, restored.stride());
  EXPECT_EQ(restored.Points(kept.points()).points().rbegin()->sequence(), kEstimates + 1);
  ASSERT_LE(std::ssize(kept.points()), EstimateHistory::kMaxPoints);
}

TEST(EstimateHistory, AddsNoEstimateTwice) {
  EstimateHistory history;
  Kept kept;
  for (const int64_t batch : {4, 4, 3}) kept.Save(history.Add(EstimateOfBatch(batch)), 1);
  EXPECT_EQ(kept.saved(), 1);
  EXPECT_EQ(history.Points(kept.points()).points_size(), 1);
}

TEST(EstimateHistory, LeavesOutWhatCannotBeRead) {
  const std::vector<JournalHistoryPoint> kept = {{0, 1, "\xFF\xFF"}};
  EXPECT_EQ(EstimateHistory(kept).Points(kept).points_size(), 0);
}

}  // namespace
}  // namespace polyest::internal
