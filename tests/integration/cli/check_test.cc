// Tests the output of `polyest check`, `init` and `schema`.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>

#include <cmath>

#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

constexpr char kProblem[] = R"({
  "model": {"builtin": "mass_spring_damper"},
  "fixed": {"m": 1.0, "x0": 1.0},
  "uncertain": [{"name": "k", "uniform": {"lower": 31.584, "upper": 47.376}}],
  "inputs": [{"name": "force", "streamed": {}}],
  "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
})";

class CheckTest : public CommandTest {
 protected:
  // Returns the warnings about data for the problem above.
  std::string Warnings(const std::string& data) {
    const Finished run = Run({"check", File("p.json", kProblem), File("d.csv", data)});
    EXPECT_EQ(run.exit_status, 0) << run.err;
    const size_t start = run.out.find("warning: ");
    return start == std::string::npos ? "" : run.out.substr(start);
  }
};

TEST_F(CheckTest, SaysWhatWouldBeEstimated) {
  const Finished run = Run({"check", Example("oscillator.json"), Example("oscillator.csv")});
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("mass_spring_damper"), HasSubstr("uniform on [31.584, 47.376] N/m"),
                    HasSubstr("noise 0.01 m"), HasSubstr("10 terms, 20 collocation points"),
                    HasSubstr("1000 rows, t from 0.05 to 50 s, every 0.05 s (20 Hz)"),
                    HasSubstr("x: 1000 samples"), Not(HasSubstr("warning"))));
}

TEST_F(CheckTest, HasNothingAgainstTheExamples) {
  for (const char* const name :
       {"bicycle", "damper_rig", "oscillator", "quarter_car", "roll_plane", "roll_plane_4dof"}) {
    const Finished run =
        Run({"check", Example(absl::StrCat(name, ".json")), Example(absl::StrCat(name, ".csv"))});
    EXPECT_EQ(run.exit_status, 0) << run.err;
    EXPECT_THAT(run.out, Not(HasSubstr("warning"))) << name;
  }
}

TEST_F(CheckTest, SaysAllThatIsWrongWithProblemAndDataAtOnce) {
  const std::string problem = File("p.json", R"({
    "model": {"builtin": "mass_spring_damper"},
    "uncertain": [{"name": "k", "uniform": {"lower": 5, "upper": 3}}],
    "measured": [{"output": "x"}]
  })");
  const std::string data = File("d.csv", "t,x,y\n0,1,1\n0.1,abc,1\n0.2,1,1\n0.1,1,1\n0.3\n");
  const Finished run = Run({"check", problem, data});
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_THAT(Lines(run.err),
              ElementsAre(HasSubstr("d.csv: 1 column ignored ('y'); 2 rows from 0 s"),
                          HasSubstr("p.json: uncertain[0].uniform: lower 5"),
                          HasSubstr("p.json: measured[0].noise"),
                          HasSubstr("d.csv:3: column x: \"abc\" must be a number"),
                          HasSubstr("d.csv:5: column t: 0.1 must be later than 0.2"),
                          HasSubstr("d.csv:6: the row has 1 cells"), "polyest: 5 errors"));
}

TEST_F(CheckTest, NamesAProblemFileThatIsCalledAsAField) {
  File("model", R"({"model": {"builtin": "rocket"}})");
  const Finished run = RunProgram(
      {"/usr/bin/env", "--chdir=" + folder_.string(), POLYEST_PROGRAM, "check", "model"});
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(Lines(run.err)[0], HasSubstr("polyest: model: model.builtin: "));
}

TEST_F(CheckTest, CountsTheBadLinesThatItDoesNotShow) {
  std::string data = "t,x\n";
  for (int i = 0; i < 50; ++i) absl::StrAppend(&data, i, ",?", i, "\n");
  const Finished run = Run({"check", Example("oscillator.json"), File("d.csv", data)});
  EXPECT_EQ(run.exit_status, 2);
  const std::vector<std::string> lines = Lines(run.err);
  EXPECT_THAT(lines, SizeIs(22));
  EXPECT_THAT(lines[20], HasSubstr("d.csv: … and 30 more"));
  EXPECT_EQ(lines[21], "polyest: 50 errors");
}

TEST_F(CheckTest, SaysOnceWhatIsWrongWithManyLines) {
  std::string data = "t,x\n";
  for (int i = 0; i < 50; ++i) absl::StrAppend(&data, i, i == 30 ? ",!\n" : ",?\n");
  const Finished run = Run({"check", Example("oscillator.json"), File("d.csv", data)});
  EXPECT_EQ(run.exit_status, 2);
  EXPECT_THAT(
      Lines(run.err),
      ElementsAre(AllOf(HasSubstr("d.csv:2: column x: \"?\" must be a number"),
                        EndsWith(" (and so in 48 further lines)")),
                  HasSubstr("d.csv:32: column x: \"!\" must be a number"), "polyest: 50 errors"));
}

TEST_F(CheckTest, AnswersInJson) {
  const auto ask = [this](const std::string& problem) {
    const Finished run = Run({"check", File("p.json", problem), "--format", "json"});
    google::protobuf::Struct answer;
    EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(run.out, &answer).ok()) << run.out;
    EXPECT_EQ(run.exit_status, answer.fields().at("ok").bool_value() ? 0 : 2);
    EXPECT_TRUE(answer.fields().contains("warnings"));
    return answer.fields().at("errors").list_value().values_size();
  };
  EXPECT_EQ(ask(kProblem), 0);
  EXPECT_EQ(ask(R"({"model": {"builtin": "rocket"}, "regularization": -1})"), 3);
}

TEST_F(CheckTest, WarnsOfDataThatDeserveASecondLook) {
  EXPECT_EQ(Warnings("t,x,force\n0,1,0\n0.1,0.8,1\n0.2,0.3,2\n0.3,-0.3,1\n"), "");
  EXPECT_THAT(Warnings("t,x,force\n0,1,5\n0.1,0.8,5\n0.2,0.3,5\n"),
              HasSubstr("force never changes: it is 5"));
  EXPECT_THAT(Warnings("t,x,force\n0,,0\n0.1,,1\n"), HasSubstr("no sample"));
  EXPECT_THAT(Warnings("t,x,force\n37,1,0\n37.1,0.8,1\n37.2,0.3,0\n"),
              HasSubstr("first row is at t = 37 s"));
  EXPECT_THAT(Warnings("t,x,force\n0,1,0\n0.1,0.8,1\n0.2,0.3,0\n9,-0.3,1\n9.1,1,0\n"),
              HasSubstr("the longest is 8.8 s, after t = 0.2 s"));
  EXPECT_THAT(Warnings("t,x,force\n0,1,0\n0.1,1.001,1\n0.2,1.002,0\n0.3,1,2\n"),
              HasSubstr("noise of 0.01 is larger than the spread of its samples"));
  EXPECT_THAT(Warnings("t,x,force\n0,0,0\n0.1,10,1\n0.2,-10,0\n0.3,20,2\n"),
              HasSubstr("noise of at most 0.01 is less than the rounding of its samples, 2.9"));
}

TEST_F(CheckTest, WarnsAsCommandsDoBeforeTheyCompute) {
  const std::string problem = File("p.json", kProblem);
  std::string rows = "t,x,force\n";  // in mm, which no unit says
  for (int i = 0; i < 40; ++i) {
    absl::StrAppend(&rows, 0.05 * i, ",", 1000 * std::cos(0.3 * i), ",", i % 3, "\n");
  }
  const std::string data = File("d.csv", rows);
  const std::string warnings = Warnings(rows);
  ASSERT_THAT(warnings, HasSubstr("check the unit of x"));
  EXPECT_EQ(Run({"estimate", problem, data}).err, warnings);
  const DaemonProcess daemon;
  EXPECT_EQ(Run({"estimate", problem, data, "--server", daemon.address()}).err, warnings);
  // What is validated is warned of by the name of its file, and what problems share once.
  const std::string other = File("o.csv", "t,x,force\n0,1,5\n0.1,0.8,5\n0.2,0.3,5\n");
  EXPECT_THAT(
      Run({"fit", problem, data, "--validate", other}).err,
      AllOf(StartsWith(warnings),
            HasSubstr("warning: " + other + ": force never changes: it is 5 in every row")));
  EXPECT_EQ(Run({"compare", problem, problem, data}).err, warnings);
}

TEST_F(CheckTest, WarnsOfNoiseThatVanishesWithTheSignal) {
  std::string problem = kProblem;
  problem.replace(problem.find("absolute"), 8, "relative");
  const std::string data = File("d.csv", "t,x,force\n0,1,0\n0.1,0.0001,1\n0.2,-1,0\n");
  const Finished run = Run({"check", File("p.json", problem), data});
  EXPECT_EQ(run.exit_status, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("x: its noise goes down to 1e-06"));
  problem.replace(problem.find("\"relative"), 0, "\"unknown\": true, ");
  const Finished unknown = Run({"check", File("p.json", problem), data});
  EXPECT_EQ(unknown.exit_status, 0) << unknown.err;
  EXPECT_THAT(unknown.out, HasSubstr("x: its noise goes down to less than a thousandth"));
}

TEST_F(CheckTest, ChecksWhatInitWrites) {
  const Finished models = Run({"models", "--format", "json"});
  google::protobuf::Struct list;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(models.out, &list).ok());
  for (const auto& model : list.fields().at("models").list_value().values()) {
    const std::string name =
        model.struct_value().fields().at("name").string_value().substr(sizeof("models/") - 1);
    const std::string file = folder_ / (name + ".json");
    EXPECT_EQ(Run({"init", name, "-o", file}).exit_status, 0) << name;
    const Finished checked = Run({"check", file});
    EXPECT_EQ(checked.exit_status, 0) << checked.err;
    EXPECT_THAT(checked.out, Not(HasSubstr("warning"))) << name;
  }
  const Finished equations = Run({"init", "--equations"});
  EXPECT_EQ(equations.exit_status, 0);
  EXPECT_EQ(Run({"check", File("equations.json", equations.out)}).exit_status, 0);
}

TEST_F(CheckTest, InitListsTheModelsAndKeepsFilesThatAreThere) {
  EXPECT_EQ(Run({"init"}).out, Run({"models"}).out);
  EXPECT_THAT(Run({"init", "rocket"}).err, HasSubstr("duffing"));
  const std::string file = File("mine.json", "mine");
  const Finished refused = Run({"init", "duffing", "-o", file});
  EXPECT_EQ(refused.exit_status, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("mine.json"), HasSubstr("--force")));
  EXPECT_EQ(Run({"init", "duffing", "-o", file, "--force"}).exit_status, 0);
  EXPECT_EQ(Run({"check", file}).exit_status, 0);
}

TEST_F(CheckTest, PrintsTheSchema) {
  const Finished run = Run({"schema"});
  EXPECT_EQ(run.exit_status, 0);
  google::protobuf::Struct schema;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(run.out, &schema).ok());
  EXPECT_TRUE(schema.fields().at("properties").struct_value().fields().contains("uncertain"));
}

}  // namespace
}  // namespace polyest::internal
