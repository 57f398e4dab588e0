#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

class ExportTest : public CommandTest {
 protected:
  // Streams the demonstration record into the session `monday`.
  void SetUp() override {
    const Finished run = Run({"stream", Example("oscillator.json"), "-", "--server",
                              daemon_.address(), "--session", "monday", "--format", "jsonl"},
                             DemoRows(100));
    ASSERT_EQ(run.exit_status, 0) << run.err;
  }
  Finished OfDaemon(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--server", daemon_.address()});
    return Run(arguments);
  }
  // Continues the stream of a session and returns its last estimate.
  std::string LastEstimateOf(const std::string& session) const {
    const Finished run = Run({"stream", Example("oscillator.json"), "-", "--server",
                              daemon_.address(), "--session", session, "--format", "jsonl"},
                             DemoRows(130));
    EXPECT_EQ(run.exit_status, 0) << run.err;
    return run.out.empty() ? "" : Lines(run.out).back();
  }

  DaemonProcess daemon_;
};

TEST_F(ExportTest, BringsASessionThroughAFileToTheSameEstimates) {
  const std::string file = File("monday.session", "");
  const Finished exported = OfDaemon({"export", "monday", file});
  EXPECT_EQ(exported.exit_status, 0) << exported.err;
  EXPECT_THAT(exported.out, HasSubstr("exported sessions/monday with 4 batches"));
  const Finished imported = OfDaemon({"import", file, "--session", "again"});
  EXPECT_EQ(imported.exit_status, 0) << imported.err;
  EXPECT_EQ(imported.out, "imported sessions/again with 4 batches and 100 samples\n");
  EXPECT_EQ(LastEstimateOf("again"), LastEstimateOf("monday"));
}

TEST_F(ExportTest, DeletesASessionOnce) {
  const Finished deleted = OfDaemon({"delete", "monday"});
  EXPECT_EQ(deleted.exit_status, 0) << deleted.err;
  EXPECT_EQ(deleted.out, "deleted sessions/monday\n");
  const Finished again = OfDaemon({"delete", "monday"});
  EXPECT_EQ(again.exit_status, 2);
  EXPECT_EQ(again.err, "polyest: there is no session \"sessions/monday\"\n");
}

TEST_F(ExportTest, SaysInOneLineWhatIsWrong) {
  const std::string file = File("good.session", "");
  ASSERT_EQ(OfDaemon({"export", "monday", file}).exit_status, 0);
  std::ostringstream contents;
  contents << std::ifstream(file, std::ios::binary).rdbuf();
  const std::string whole = contents.str();
  const auto flipped = [](std::string bytes, size_t at) {
    bytes[at] = static_cast<char>(bytes[at] ^ 1);
    return bytes;
  };
  struct Case {
    std::vector<std::string> arguments;
    int exit_status;
    std::string words;
  };
  for (const Case& one : {
           Case{{"export", "tuesday", File("x", "")}, 2, "there is no session"},
           Case{{"export", "monday", "/nowhere/x"},
                2,
                "cannot write /nowhere/x: No such file or directory"},
           Case{{"export", "monday", "/"}, 2, "cannot write /: Is a directory"},
           Case{{"import", "/nowhere/x"}, 2, "/nowhere/x: cannot be read"},
           Case{{"import", File("csv", "t,x\n0,1\n")},
                2,
                "is not a session file written by polyest export"},
           Case{{"import", file},
                2,
                "there is a session \"sessions/monday\" already; --session NAME imports it under "
                "another name"},
           Case{{"import", "/"}, 2, "/: is a folder, not a file"},
           Case{{"import", file, "--session", "A"},
                2,
                "polyest: --session: \"A\" must be 1 to 63 of a-z"},
           Case{{"import", File("cut", whole.substr(0, whole.size() - 9)), "--session", "b"},
                2,
                "is cut off or missing: the file is incomplete"},
           Case{{"import", File("no end", whole.substr(0, whole.size() - 10)), "--session", "b"},
                2,
                "is cut off or missing: the file is incomplete"},
           Case{{"import", File("longer", whole + '\0'), "--session", "b"},
                2,
                "is the end, but more follows"},
           Case{
               {"import", File("flipped", flipped(whole, whole.find('\n') + 20)), "--session", "b"},
               2,
               "is damaged: its checksum is not that of its bytes"},
       }) {
    const Finished run = OfDaemon(one.arguments);
    EXPECT_EQ(run.exit_status, one.exit_status) << one.words;
    EXPECT_EQ(run.out, "");
    EXPECT_EQ(Lines(run.err).size(), 1u) << run.err;
    EXPECT_THAT(run.err, HasSubstr(one.words));
  }
}

}  // namespace
}  // namespace polyest::internal
