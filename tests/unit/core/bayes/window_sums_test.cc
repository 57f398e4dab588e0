// Compares the windows with sums taken over their rows directly.

#include "core/bayes/window_sums.h"

#include <gtest/gtest.h>

#include <cmath>

namespace polyest::internal::window_sums_test {
namespace {

constexpr int kTerms = 3;

Vector Coefficients(int64_t row, int channel) {
  return Vector::NullaryExpr(kTerms, [&](auto s) {
    return std::sin(0.3 * static_cast<double>(row) + static_cast<double>(s) + channel);
  });
}

void AddRow(int64_t row, std::vector<ChannelSums>& sums, WindowSums& windows) {
  for (size_t c = 0; c < sums.size(); ++c) {
    const auto channel = static_cast<int>(c);
    sums[c].samples.Add(Coefficients(row, channel), std::cos(0.1 * static_cast<double>(row)), 0.25);
  }
  windows.EndRow(sums, static_cast<int>(row / 100), 0.5 * static_cast<double>(row));
}

// One channel with known noise and two with a learned scale, of which the first is last in order.
std::vector<ChannelSums> ThreeChannels() {
  std::vector<ChannelSums> sums(3, ChannelSums(kTerms));
  sums[0].scale_unknown = sums[1].scale_unknown = true;
  return sums;
}

TEST(WindowSums, AreThoseOfTheirRows) {
  std::vector<ChannelSums> sums = ThreeChannels();
  WindowSums windows;
  constexpr int64_t kRows = 301;
  for (int64_t row = 0; row < kRows; ++row) AddRow(row, sums, windows);
  EXPECT_TRUE(windows.Suits(sums, kRows));
  // 64 windows of 4 rows hold 256, 37 of 8 rows hold 296.
  ASSERT_EQ(windows.count(), 38);
  int64_t row = 0;
  std::vector<MismatchSums> expected(3, MismatchSums(kTerms));
  const int group_of_channel[] = {1, 2, 0};
  for (int w = 0; w < windows.count(); ++w) {
    const WindowSpan& span = windows.span(w);
    EXPECT_EQ(span.rows, w < 37 ? 8 : 5);
    EXPECT_EQ(span.first_run, row / 100);
    EXPECT_EQ(span.start_s, 0.5 * static_cast<double>(row));
    for (int64_t end = row + span.rows; row < end; ++row) {
      for (int c = 0; c < 3; ++c) {
        expected[static_cast<size_t>(group_of_channel[c])].Add(
            Coefficients(row, c), std::cos(0.1 * static_cast<double>(row)), 0.25);
      }
    }
    EXPECT_EQ(span.last_run, (row - 1) / 100);
    EXPECT_EQ(span.end_s, 0.5 * static_cast<double>(row - 1));
    const std::vector<WindowSums::Totals> totals = windows.TotalsAt(w, sums);
    ASSERT_EQ(totals.size(), 3);
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(WindowSums::Unpack(totals[k].g, kTerms), expected[k].G());
      EXPECT_EQ(totals[k].b, expected[k].b());
    }
  }
  EXPECT_EQ(row, kRows);
}

TEST(WindowSums, StayFewForALongRecord) {
  std::vector<ChannelSums> sums(1, ChannelSums(kTerms));
  WindowSums windows;
  for (int64_t row = 0; row < 10'000; ++row) {
    AddRow(row, sums, windows);
    ASSERT_LE(windows.count(), 65);
    ASSERT_TRUE(row < 32 || windows.count() >= 32);
    ASSERT_TRUE(windows.Suits(sums, row + 1));
  }
}

TEST(WindowSums, AreFewerWhereTheirMemoryIsLarge) {
  EXPECT_EQ(WindowSums::Capacity({ChannelSums(56)}), 64);
  const int capacity = WindowSums::Capacity({ChannelSums(210)});
  EXPECT_LT(capacity, 64);
  EXPECT_GE(capacity, 16);
  EXPECT_EQ(WindowSums::Capacity({ChannelSums(495)}), 16);
}

TEST(WindowSums, DoNotSuitOtherRowsOrTerms) {
  std::vector<ChannelSums> sums = ThreeChannels();
  WindowSums windows;
  for (int64_t row = 0; row < 70; ++row) AddRow(row, sums, windows);
  EXPECT_TRUE(windows.Suits(sums, 70));
  EXPECT_FALSE(windows.Suits(sums, 71));
  EXPECT_FALSE(windows.Suits(std::vector<ChannelSums>(3, ChannelSums(kTerms)), 70));
  EXPECT_FALSE(windows.Suits(std::vector<ChannelSums>(1, ChannelSums(kTerms + 1)), 70));
}

// Substitutes terms and compares with windows of the substituted coefficients.
TEST(WindowSums, AreThoseOfOtherTerms) {
  std::vector<ChannelSums> sums = ThreeChannels(), expected_sums = ThreeChannels();
  WindowSums windows, expected;
  const Matrix t{{2, -1, 0.5}, {0, 1, 3}, {1, 0, -1}};
  const Vector shift{{0.3, -0.2, 0.1}};
  for (int64_t row = 0; row < 150; ++row) {
    AddRow(row, sums, windows);
    for (int c = 0; c < 3; ++c) {
      // e′ = e − cᵀδ for the coefficients c′ = T c
      const Vector before = Coefficients(row, c);
      expected_sums[static_cast<size_t>(c)].samples.Add(
          t * before, std::cos(0.1 * static_cast<double>(row)) - before.dot(shift), 0.25);
    }
    expected.EndRow(expected_sums, static_cast<int>(row / 100), 0.5 * static_cast<double>(row));
  }
  windows.Substitute(t, shift);
  ASSERT_EQ(windows.count(), expected.count());
  for (int w = 0; w + 1 < windows.count(); ++w) {
    const auto a = windows.TotalsAt(w, sums), b = expected.TotalsAt(w, expected_sums);
    for (size_t group = 0; group < 3; ++group) {
      // Sums of 150 products of at most 10 each.
      EXPECT_LT((a[group].g - b[group].g).cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_LT((a[group].b - b[group].b).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

TEST(WindowSums, OfALearnedScaleAreDividedAlone) {
  std::vector<ChannelSums> sums = ThreeChannels();
  WindowSums windows;
  for (int64_t row = 0; row < 70; ++row) AddRow(row, sums, windows);
  const auto before = windows.TotalsAt(3, sums);
  windows.Divide(Vector{{4, 2, 1}}, sums);
  const auto after = windows.TotalsAt(3, sums);
  const double factors[] = {1, 4, 2};  // the known channel's group comes first
  for (size_t group = 0; group < 3; ++group) {
    EXPECT_EQ(after[group].g, before[group].g / factors[group]);
    EXPECT_EQ(after[group].b, before[group].b / factors[group]);
  }
}

}  // namespace
}  // namespace polyest::internal::window_sums_test
