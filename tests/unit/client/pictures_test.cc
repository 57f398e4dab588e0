// Draws the answers about a shipped example, and writes its report.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "client/cli/commands.h"
#include "client/cli/fit_plot.h"
#include "client/cli/history_plot.h"
#include "client/cli/report_page.h"
#include "client/cli/study_plots.h"
#include "client/plot/contours.h"
#include "client/plot/plot_file.h"
#include "tests/testing/test_folder.h"
#include "tests/testing/well_formed.h"

namespace polyest::internal {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::filesystem::path kPictureExamples =
    std::filesystem::path(POLYEST_SOURCE_DIR) / "client/examples";

std::string TextOf(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

template <typename Arguments>
Arguments OfOscillator() {
  Arguments arguments;
  arguments.problem_file = kPictureExamples / "oscillator.json";
  if constexpr (requires { arguments.data_file; }) {
    arguments.data_file = kPictureExamples / "oscillator.csv";
  }
  return arguments;
}

class PicturesTest : public testing::Test {
 protected:
  // Runs the command and returns the SVG that it has drawn.
  template <typename Arguments>
  std::string Draw(Arguments arguments) {
    arguments.plot_file = folder_ / "plot.svg";
    std::ostringstream out, err;
    EXPECT_EQ(RunCommand(arguments, out, err), 0) << err.str();
    const std::string svg = TextOf(arguments.plot_file);
    EXPECT_TRUE(IsWellFormed(svg));
    EXPECT_THAT(svg, Not(HasSubstr("href")));
    EXPECT_FALSE(std::regex_search(svg, std::regex("[\",]-?(nan|inf)[\", ]")));
    return svg;
  }

  TestFolder folder_;
};

TEST_F(PicturesTest, OfEveryAnswerAreDrawnWithUnits) {
  const std::string fit = Draw(OfOscillator<FitArguments>());
  for (const char* part :
       {"x (m)", "t (s)", "measured", "95 % of new samples", "autocorrelation"}) {
    EXPECT_THAT(fit, HasSubstr(part));
  }
  EXPECT_THAT(Draw(OfOscillator<EstimateArguments>()), HasSubstr("k (N/m)"));
  const std::string corner = Draw(OfOscillator<PosteriorArguments>());
  for (const char* part : {"k (N/m)", "c (N s/m)", "50 %", "95 %"}) {
    EXPECT_THAT(corner, HasSubstr(part));
  }
  EXPECT_THAT(Draw(OfOscillator<ProfileArguments>()), HasSubstr("cost above its least"));
  auto sensitivity = OfOscillator<SensitivityArguments>();
  sensitivity.until_s = 5;
  EXPECT_THAT(Draw(sensitivity), HasSubstr("share of the variance of x"));
  auto design = OfOscillator<DesignArguments>();
  design.until_s = 5;
  EXPECT_THAT(Draw(design), HasSubstr("best sample times"));
}

TEST_F(PicturesTest, RefuseAnotherKindOfFileBeforeAnythingIsComputed) {
  auto arguments = OfOscillator<FitArguments>();
  arguments.plot_file = "fit.pdf";
  std::ostringstream out, err;
  EXPECT_EQ(RunCommand(arguments, out, err), 2);
  EXPECT_EQ(err.str(), "polyest: --plot: \"fit.pdf\" must end in .svg or .png\n");
  arguments.plot_file = folder_ / "no/fit.svg";
  std::ostringstream err2;
  EXPECT_EQ(RunCommand(arguments, out, err2), 1);
  EXPECT_EQ(err2.str(), "polyest: --plot: cannot write " + arguments.plot_file +
                            ": No such file or directory\n");
}

// The problem is not there either: the program is looked for first.
TEST_F(PicturesTest, MissTheProgramOfAPngBeforeAnythingIsRead) {
  const std::string path = getenv("PATH");
  setenv("PATH", (folder_ / "no").c_str(), 1);
  EstimateArguments arguments;
  arguments.problem_file = "no.json";
  arguments.plot_file = folder_ / "plot.png";
  std::ostringstream out, err;
  EXPECT_EQ(RunCommand(arguments, out, err), 2);
  setenv("PATH", path.c_str(), 1);
  EXPECT_THAT(err.str(), HasSubstr("a PNG needs the program rsvg-convert (No such file"));
  EXPECT_FALSE(std::filesystem::exists(arguments.plot_file));
}

// Importance sampling has no chains.
TEST_F(PicturesTest, PosteriorsWithoutChainsHaveNoRHat) {
  auto arguments = OfOscillator<PosteriorArguments>();
  arguments.format = Format::kCsv;
  std::ostringstream out, err;
  ASSERT_EQ(RunCommand(arguments, out, err), 0) << err.str();
  EXPECT_THAT(out.str(), HasSubstr("effectiveSampleSize,rHat\n"));
  EXPECT_TRUE(std::regex_search(out.str(), std::regex("\nk,[^\n]*[0-9],\n"))) << out.str();
}

// Of the same record as the estimate's, the score of the validation is that of the fit.
TEST_F(PicturesTest, FitScoresAnotherRecord) {
  auto arguments = OfOscillator<FitArguments>();
  arguments.format = Format::kCsv;
  arguments.rows = 3;
  std::ostringstream fit, validated, err;
  ASSERT_EQ(RunCommand(arguments, fit, err), 0) << err.str();
  arguments.validation_file = arguments.data_file;
  ASSERT_EQ(RunCommand(arguments, validated, err), 0) << err.str();
  EXPECT_EQ(fit.str(), validated.str());
  EXPECT_THAT(fit.str(),
              HasSubstr("run,t,x_mean,x_stdDev,x_q0.025,x_q0.5,x_q0.975,x_sampleStdDev"));
  const std::string lines = fit.str();
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 4);
}

TEST_F(PicturesTest, ReportIsOnePageWithAllThatSupportsTheEstimate) {
  auto arguments = OfOscillator<ReportArguments>();
  arguments.output_file = folder_ / "report.html";
  std::ostringstream out, err;
  ASSERT_EQ(RunCommand(arguments, out, err), 0) << err.str();
  const std::string page = TextOf(arguments.output_file);
  for (const char* part : {"<!DOCTYPE html>", "Parameters", "identified", "N s/m", "No warnings",
                           "How it was computed", "How the estimate came about",
                           "&quot;builtin&quot;: &quot;mass_spring_damper&quot;"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  // Nothing is loaded from elsewhere.
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
}

TEST(ReportPage, ShowsNoScoresWithoutSamples) {
  ReportContent content;
  content.estimate.add_channels()->set_output("x");
  v1::PredictResponse::Output& output = *content.prediction.add_outputs();
  output.set_output("x");
  output.mutable_score();
  const std::string page = ReportPage(content);
  EXPECT_THAT(page, HasSubstr("<tr><td>x</td><td></td><td>0</td><td>-</td><td>-</td><td>-</td>"));
  EXPECT_THAT(page, HasSubstr("<tr><td>x</td><td>0</td><td>-</td>"));
  EXPECT_THAT(page, Not(HasSubstr(">0 %")));
}

TEST(ReportPage, ShowsTextsOfUsersAsTextAndWarnings) {
  ReportContent content;
  content.subject = "<b>rig</b> & co";
  v1::ParameterEstimate& k = *content.estimate.add_parameters();
  k.set_name("<k>");
  k.set_verdict(v1::Identifiability::NOT_IDENTIFIED);
  k.set_map(0.15);
  k.set_std_dev(0.5);
  k.set_mean(0.29);
  k.set_posterior_std_dev(0.44);
  v1::Diagnostic& diagnostic = *content.estimate.add_diagnostics();
  diagnostic.set_code(v1::Diagnostic::MODEL_MISFIT);
  diagnostic.set_message("residuals > noise");
  const std::string page = ReportPage(content);
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;rig&lt;/b&gt; &amp; co"));
  EXPECT_THAT(page, HasSubstr("&lt;k&gt;"));
  EXPECT_THAT(page, HasSubstr("<td>0.29 ± 0.44</td>"));
  EXPECT_THAT(page, HasSubstr("model misfit: residuals &gt; noise"));
  EXPECT_THAT(page, HasSubstr("class=\"verdict NOT_IDENTIFIED\""));
  EXPECT_THAT(page, Not(HasSubstr("No warnings")));
}

// Cubic interpolation is exact for quadratics on an even grid.
TEST(RefinedGrid, KeepsQuadraticsAndLeavesGapsLinear) {
  const Vector axis = Vector::LinSpaced(5, -2, 2);
  const auto bowl = [](double x, double y) { return x * x - x * y + 2 * y * y; };
  Matrix value(5, 5);
  for (Eigen::Index i = 0; i < 5; ++i) {
    for (Eigen::Index j = 0; j < 5; ++j) value(i, j) = bowl(axis[i], axis[j]);
  }
  const ContourGrid fine = RefinedGrid(axis, axis, value, 4);
  ASSERT_EQ(fine.x.size(), 17);
  for (Eigen::Index i = 0; i < 17; ++i) {
    for (Eigen::Index j = 0; j < 17; ++j) {
      EXPECT_NEAR(fine.value(i, j), bowl(fine.x[i], fine.y[j]), 1e-12);
    }
  }
  value(4, 4) = std::numeric_limits<double>::infinity();
  const ContourGrid holed = RefinedGrid(axis, axis, value, 4);
  EXPECT_TRUE(holed.value.topLeftCorner(9, 9).allFinite());
  EXPECT_FALSE(std::isfinite(holed.value(16, 16)));
}

}  // namespace
}  // namespace polyest::internal
