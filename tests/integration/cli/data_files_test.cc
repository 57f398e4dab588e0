// Tests the commands with data files as spreadsheets write them.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_replace.h>
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/integration/cli/command_test.h"

namespace polyest::internal::data_files_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

// The truth, which no file names: an undamped oscillator of 1 kg, released at 1 m.
constexpr double kStiffness = 41.3;
constexpr double kNoise = 0.01;
constexpr int kRows = 400;

constexpr char kProblem[] = R"({
  "model": {"builtin": "mass_spring_damper"},
  "fixed": {"m": 1.0, "x0": 1.0, "c": 0},
  "uncertain": [{"name": "k", "uniform": {"lower": 31.584, "upper": 47.376}}],
  "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  COLUMNS
})";
constexpr char kColumns[] = R"(, "columns": {"x": {"from": "Disp [mm]"}})";
constexpr char kFound[] =
    "semicolons, decimal comma, UTF-16; 'Disp [mm]' → x, mm → m; 'Zeit [s]' is t; 2 columns "
    "ignored "
    "('Temp [°C]', 'Bemerkung'); 400 rows, t = 0 at 12,345";

std::string Problem(const std::string& columns = kColumns) {
  return absl::StrReplaceAll(kProblem, {{"COLUMNS", columns}});
}

// Returns ASCII and ° in UTF-16 with a byte order mark.
std::string Utf16(const std::string& utf8) {
  std::string bytes = "\xFF\xFE";
  for (const char c : absl::StrReplaceAll(utf8, {{"°", "\xB0"}})) {
    bytes += c;
    bytes += '\0';
  }
  return bytes;
}

// Returns what a German spreadsheet exports of the record, and the same plainly.
std::pair<std::string, std::string> Records() {
  std::mt19937 generator(7);
  std::normal_distribution<double> noise(0, kNoise);
  std::string german = "\"Disp [mm]\";Temp [°C];\"Zeit [s]\";Bemerkung\r\n";
  std::string plain = "t,x\n";
  for (int row = 0; row < kRows; ++row) {
    const double t = 0.05 * row;
    const double x = std::cos(std::sqrt(kStiffness) * t) + noise(generator);
    const std::string cells =
        absl::StrFormat("%.4f;21.5;%.3f;\"a; \"\"b\"\"\"\r\n", 1000 * x, 12.345 + t);
    absl::StrAppend(&german, absl::StrReplaceAll(cells, {{".", ","}}));
    absl::StrAppendFormat(&plain, "%.3f,%.7f\n", t, x);
  }
  return {Utf16(german), plain};
}

class DataFilesTest : public CommandTest {
 protected:
  const std::string german_ = File("german.csv", Records().first);
  const std::string plain_ = File("plain.csv", Records().second);
  const std::string problem_ = File("problem.json", Problem());
};

TEST_F(DataFilesTest, EstimateFromAGermanSpreadsheet) {
  const Finished run =
      Run({"estimate", problem_, german_, "--time-zero", "first", "--format", "json"});
  ASSERT_EQ(run.exit_status, 0) << run.err;
  EXPECT_EQ(run.err, absl::StrCat(german_, ": ", kFound, "\n"));
  const v1::ParameterEstimate k = ParseEstimate(run.out).parameters(0);
  EXPECT_NEAR(k.mean(), kStiffness, 4 * k.posterior_std_dev());
  EXPECT_LT(k.posterior_std_dev(), 0.02);
  EXPECT_EQ(k.verdict(), v1::Identifiability::IDENTIFIED);
  const Finished plain = Run({"estimate", File("p.json", Problem("")), plain_, "--format", "json"});
  ASSERT_EQ(plain.exit_status, 0) << plain.err;
  EXPECT_THAT(plain.err, IsEmpty());
  // The times of the two files differ by the rounding of a subtraction.
  const v1::ParameterEstimate same = ParseEstimate(plain.out).parameters(0);
  EXPECT_NEAR(k.mean(), same.mean(), 1e-6 * kStiffness);
  EXPECT_NEAR(k.std_dev(), same.std_dev(), 1e-4 * same.std_dev());
}

TEST_F(DataFilesTest, EveryCommandSaysWhatItFound) {
  for (const std::vector<std::string>& command : {std::vector<std::string>{"explain"},
                                                  {"check"},
                                                  {"cost"},
                                                  {"posterior", "--format", "json"},
                                                  {"profile", "--format", "json"},
                                                  {"regularization", "--format", "json"},
                                                  {"fit"},
                                                  {"report", "-o", File("report.html", "")},
                                                  {"design", "--until", "1"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {problem_, german_, "--time-zero", "first"});
    const Finished run = Run(arguments);
    EXPECT_EQ(run.exit_status, 0) << command[0] << run.err;
    EXPECT_EQ(run.err, absl::StrCat(german_, ": ", kFound, "\n")) << command[0];
    EXPECT_THAT(run.out, Not(HasSubstr("semicolons"))) << command[0];
  }
}

TEST_F(DataFilesTest, StreamsThemToo) {
  DaemonProcess daemon;
  const std::vector<std::string> arguments = {
      "stream",         problem_,   "-",     "--time-zero", "first", "--server",
      daemon.address(), "--format", "jsonl", "--batch",     "100"};
  const Finished run = Run(arguments, Records().first);
  ASSERT_EQ(run.exit_status, 0) << run.err;
  // What is said after the first batch knows its rows only.
  EXPECT_THAT(run.err, AllOf(StartsWith("standard input: semicolons, decimal comma, UTF-16; 'Disp"),
                             HasSubstr("100 rows, t = 0 at 12,345\n")));
  const v1::ParameterEstimate k = ParseEstimate(Lines(run.out).back()).parameters(0);
  EXPECT_NEAR(k.mean(), kStiffness, 4 * k.posterior_std_dev());
}

TEST_F(DataFilesTest, RefusalsNameTheRemedy) {
  const auto error = [&](const std::vector<std::string>& options, const std::string& problem) {
    std::vector<std::string> arguments = {"estimate", File("q.json", problem), german_};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Finished run = Run(arguments);
    EXPECT_EQ(run.exit_status, 2);
    EXPECT_EQ(Lines(run.err).size(), 1u) << run.err;
    return run.err;
  };
  EXPECT_THAT(error({}, Problem("")),
              HasSubstr("map one in the problem: \"columns\": {\"x\": {\"from\": \"Disp [mm]\"}}"));
  EXPECT_THAT(error({"--decimal", "point"}, Problem()),
              AllOf(HasSubstr("german.csv:2: column \"Disp [mm]\" (x): "),
                    HasSubstr("--decimal comma reads it")));
  EXPECT_THAT(error({"--delimiter", "comma"}, Problem()),
              HasSubstr("there is no column \"Disp [mm]\" for x"));
  EXPECT_THAT(error({"--time-column", "Bemerkung"}, Problem()),
              HasSubstr("german.csv:2: column \"Bemerkung\" (t): \"a; \"b\"\" must be a number"));
  EXPECT_THAT(error({"--time-zero", "last"}, Problem()), HasSubstr("must be one of file, first"));
  EXPECT_THAT(error({}, Problem(R"(, "columns": {"x": {"unit": "kN"}})")),
              AllOf(HasSubstr("q.json: columns.x.unit: "), HasSubstr("their dimensions differ")));
}

TEST_F(DataFilesTest, AreWhatAProblemIsProposedFor) {
  const std::string proposed = folder_ / "proposed.json";
  const Finished init = Run({"init", "--from", german_, "mass_spring_damper", "-o", proposed});
  ASSERT_EQ(init.exit_status, 0) << init.err;
  EXPECT_THAT(init.err, AllOf(HasSubstr("\"Disp [mm]\" → x; not used: \"Temp [°C]\"")));
  std::ostringstream text;
  text << std::ifstream(proposed).rdbuf();
  EXPECT_THAT(text.str(),
              AllOf(HasSubstr(R"("x": {"from": "Disp [mm]"})"),
                    HasSubstr(R"({"output": "x", "noise": {"unknown": true}})"),
                    Not(HasSubstr(R"("output": "v")")), Not(HasSubstr("force\", \"s"))));
  EXPECT_EQ(Run({"check", proposed, german_, "--time-zero", "first"}).exit_status, 0);
  const Finished list = Run({"init", "--from", german_});
  EXPECT_EQ(list.exit_status, 0) << list.err;
  EXPECT_THAT(list.out, AllOf(HasSubstr("mass_spring_damper"), HasSubstr("\"Disp [mm]\" → x")));
  const Finished none = Run({"init", "--from", german_, "bicycle"});
  EXPECT_EQ(none.exit_status, 2);
  EXPECT_THAT(none.err, HasSubstr("no column fits an output of bicycle"));
}

}  // namespace
}  // namespace polyest::internal::data_files_test
