#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <regex>
#include <sstream>

#include "client/paper/figures.h"
#include "client/paper/paper_command.h"
#include "client/plot/contours.h"
#include "client/plot/svg_axis.h"
#include "client/plot/svg_writer.h"
#include "tests/paper/paper_experiments.h"
#include "tests/testing/well_formed.h"

namespace polyest::internal {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(WellFormedness, IsSeenAndMissed) {
  SvgWriter svg(100, 100, "a < b & \"c\"", "");
  for (int i = 0; i < 10; ++i) svg.Line(0, 0, i, i, {});
  const std::string good = svg.Finish();
  EXPECT_TRUE(IsWellFormed(good));
  EXPECT_FALSE(IsWellFormed(good.substr(0, good.size() - 8)));
  EXPECT_FALSE(IsWellFormed(good + "&x;"));
}

TEST(Contours, OfABowlAreClosedCircles) {
  const Vector axis = Vector::LinSpaced(41, -2, 2);
  const Matrix value = axis.array().square().matrix().replicate(1, 41) +
                       axis.array().square().matrix().transpose().replicate(41, 1);
  const auto lines = ContourLines(axis, axis, value, 1.05);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_TRUE(lines[0].closed);
  // The error of linear interpolation of x² over h = 0.1 is h²/4 at most: 2r Δr ≤ h²/4.
  for (const auto& [x, y] : lines[0].points) {
    EXPECT_NEAR(x * x + y * y, 1.05, 0.01 / 4 + 1e-12);
  }
}

TEST(Contours, ThatLeaveTheGridAreOpenAndHolesAreLeftOut) {
  const Vector axis = Vector::LinSpaced(11, 0, 1);
  Matrix value = axis.replicate(1, 11);  // value = x
  auto lines = ContourLines(axis, axis, value, 0.55);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_FALSE(lines[0].closed);
  EXPECT_EQ(lines[0].points.size(), 11u);
  for (const auto& point : lines[0].points) EXPECT_NEAR(point[0], 0.55, 1e-12);
  value(5, 5) = std::numeric_limits<double>::infinity();
  lines = ContourLines(axis, axis, value, 0.55);
  EXPECT_EQ(lines.size(), 2u);
}

TEST(Contours, OfASaddleDoNotCross) {
  const Vector axis = Vector::LinSpaced(2, 0, 1);
  Matrix value(2, 2);
  value << 1, 0, 0, 1;
  for (double level : {0.4, 0.6}) {
    const auto lines = ContourLines(axis, axis, value, level);
    ASSERT_EQ(lines.size(), 2u) << level;
    // At a level below the centre's ½ the high corners are joined, so that each line cuts off a low
    // corner.
    const auto& [x, y] = lines[0].points[0];
    const auto& [u, v] = lines[0].points[1];
    const bool cuts_off_low = std::abs((x + u) / 2 + (y + v) / 2 - 1) < 0.2;
    EXPECT_EQ(cuts_off_low, level < 0.5);
  }
}

TEST(Axis, TicksAreRoundAndInside) {
  const Axis axis = MakeAxis(-0.93, 1.07, 5, 0, 100);
  ASSERT_EQ(axis.ticks.size(), 4u);
  EXPECT_EQ(axis.ticks.front().text, "−0.5");
  EXPECT_EQ(axis.ticks[1].text, "0.0");
  EXPECT_NEAR(axis.Pixel(-0.93), 0, 1e-12);
  EXPECT_NEAR(axis.Pixel(1.07), 100, 1e-12);
  const Axis large = MakeAxis(0, 123456, 5, 0, 1);
  EXPECT_EQ(large.exponent, 5);
  EXPECT_EQ(large.ticks[1].text, "0.5");
  EXPECT_EQ(PowerOfTenText(-12), "×10⁻¹²");
}

// A constant whose values differ by rounding errors gets the axis of a constant, not a tick every
// 1e-16; a small constant is not drawn on an axis a million times as long.
TEST(Axis, OfAConstantHasFewTicks) {
  for (const double constant : {2.7, -4e-12, 0.0}) {
    const Axis axis = MakeAxis(constant - 4e-16 * std::abs(constant), constant, 5, 0, 100);
    EXPECT_GE(axis.ticks.size(), 2u) << constant;
    EXPECT_LE(axis.ticks.size(), 10u) << constant;
    EXPECT_NEAR(axis.Pixel(constant), 50, 1e-9) << constant;
    const double length = constant == 0 ? 1 : std::abs(constant);
    EXPECT_NEAR(axis.upper - axis.lower, length, 1e-12 * length) << constant;
  }
}

TEST(Axis, OfWhatIsNotFiniteIsThatFromZeroToOne) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [lower, upper] : {std::pair{kNaN, kNaN},
                                     {0.0, kNaN},
                                     {0.0, kInfinity},
                                     {-kInfinity, kInfinity},
                                     {kInfinity, kInfinity},
                                     {-1e308, 1e308},
                                     {0.0, 5e-324}}) {
    const Axis axis = MakeAxis(lower, upper, 5, 0, 100);
    EXPECT_EQ(axis.lower, 0) << lower << ", " << upper;
    EXPECT_EQ(axis.upper, 1) << lower << ", " << upper;
    EXPECT_EQ(axis.exponent, 0) << lower << ", " << upper;
    EXPECT_EQ(axis.ticks.size(), 6u) << lower << ", " << upper;
  }
}

class EveryFigure : public testing::TestWithParam<std::string> {};

TEST_P(EveryFigure, PlotsAsWellFormedSvgWithoutOutsideResources) {
  const Plot plot = MakePlot(Rerun(GetParam()));
  EXPECT_GE(plot.panels.size(), 2u);
  const std::string svg = RenderSvg(plot);
  EXPECT_TRUE(IsWellFormed(svg));
  EXPECT_THAT(svg, HasSubstr("true value"));
  EXPECT_THAT(svg, HasSubstr("estimate"));
  EXPECT_THAT(svg, HasSubstr("<poly"));
  EXPECT_THAT(svg, Not(HasSubstr("href")));
  // The picture contains no NaN or infinity, neither as an attribute nor among a line's points.
  EXPECT_FALSE(std::regex_search(svg, std::regex("[\",]-?(nan|inf)[\", ]")));
  EXPECT_TRUE(svg == RenderSvg(plot)) << "not the same text again";
}

INSTANTIATE_TEST_SUITE_P(Paper, EveryFigure, testing::ValuesIn(PaperFigures()),
                         [](const auto& figure) {
                           std::string name = figure.param;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

TEST(PaperCommand, AnswersAnUnknownFigureWithTheFiguresThereAre) {
  std::ostringstream out, err;
  EXPECT_EQ(RunPaper({.figure = "9", .plot_file = ""}, out, err), 2);
  EXPECT_EQ(out.str(), "");
  EXPECT_EQ(
      err.str(),
      "polyest: figure: \"9\" must be one of 4, 5, 6, 7, 8, 11, 12, 13, 14, 3.5, 3.6, reference\n");
}

TEST(PaperCommand, RefusesAPlotOfNoFigure) {
  std::ostringstream out, err;
  EXPECT_EQ(RunPaper({.figure = "", .plot_file = "all.svg"}, out, err), 2);
  EXPECT_EQ(out.str(), "");
  EXPECT_THAT(err.str(), HasSubstr("--plot"));
}

TEST(PaperCommand, FailsWhenThePlotCannotBeWritten) {
  std::ostringstream out, err;
  EXPECT_EQ(RunPaper({.figure = "8", .plot_file = testing::TempDir() + "/no/such/x.svg"}, out, err),
            1);
  EXPECT_THAT(err.str(), HasSubstr("cannot write"));
}

TEST(PaperCommand, PrintsAFigureAndWritesItsPlot) {
  const std::string file = testing::TempDir() + "/polyest_figure_4.svg";
  std::ostringstream out, err;
  EXPECT_EQ(RunPaper({.figure = "4", .plot_file = file}, out, err), 0);
  EXPECT_EQ(err.str(), "");
  EXPECT_THAT(out.str(), HasSubstr("Figure 4"));
  EXPECT_THAT(out.str(), HasSubstr("NOT_IDENTIFIED"));
  EXPECT_THAT(out.str(), HasSubstr("UNDERSAMPLED"));
  EXPECT_THAT(out.str(), HasSubstr("The paper:"));
  std::ostringstream written;
  written << std::ifstream(file).rdbuf();
  EXPECT_TRUE(IsWellFormed(written.str()));
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace polyest::internal
