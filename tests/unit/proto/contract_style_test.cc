// Checks that polyest.v1 keeps to its style, and that the rules find what breaks them.

#include "tests/unit/proto/contract_style.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Lists the names in problem files and in estimates as JSON on which scripts rely. They stay, even
// if a rule would rename them.
const ContractStyle::Exceptions& NamesThatScriptsRelyOn() {
  static const ContractStyle::Exceptions names = {
      // The next ones are "time" and the counts of an estimate.
      "Estimate.time", "Estimate.samples", "ChannelEstimate.samples", "ChannelEstimate.outliers",
      "ExpansionSummary.terms", "ExpansionSummary.points", "ExpansionSummary.reexpansions",
      "ExpansionSummary.trajectories",
      // "maxSteps" of a problem.
      "IntegrationOptions.max_steps"};
  return names;
}

// Reads files with their comments, as protoc does.
class Files {
 public:
  Files(const std::filesystem::path& root, const std::string& names) {
    const TestFolder folder;
    const std::string set = folder / "files.desc";
    const std::string command =
        std::string(PROTOC) +
        " --include_imports --include_source_info --descriptor_set_out=" + set +
        " --proto_path=" + root.string() + " " + names;
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    std::ifstream in(set, std::ios::binary);
    EXPECT_TRUE(set_.ParseFromIstream(&in));
    for (const auto& file : set_.file()) EXPECT_NE(pool_.BuildFile(file), nullptr) << file.name();
  }

  std::vector<const google::protobuf::FileDescriptor*> Of(const std::string& package) const {
    std::vector<const google::protobuf::FileDescriptor*> files;
    for (const auto& file : set_.file()) {
      if (file.package() == package) files.push_back(pool_.FindFileByName(file.name()));
    }
    return files;
  }

 private:
  google::protobuf::FileDescriptorSet set_;
  google::protobuf::DescriptorPool pool_;
};

TEST(ContractStyle, IsThatOfEveryFile) {
  const std::filesystem::path root = std::filesystem::path(POLYEST_SOURCE_DIR) / "proto";
  std::string names;
  size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(root / "polyest" / "v1")) {
    names += " polyest/v1/" + entry.path().filename().string();
    ++count;
  }
  const Files files(root, names);
  ASSERT_THAT(files.Of("polyest.v1"), SizeIs(count));
  ContractStyle style(NamesThatScriptsRelyOn());
  for (const auto* const file : files.Of("polyest.v1")) style.Check(*file);
  EXPECT_THAT(style.breaches(), IsEmpty());
  EXPECT_THAT(style.Unused(), IsEmpty());
}

// Returns what the rules find in a file with this body.
std::vector<std::string> BreachesOf(const std::string& body) {
  const TestFolder folder;
  std::filesystem::create_directories(folder / "polyest/v1");
  folder.Write("polyest/v1/some_service.proto",
               "syntax = \"proto3\";\npackage polyest.v1;\n" + body);
  const Files files(folder.path(), "polyest/v1/some_service.proto");
  ContractStyle style({"Kept.time"});
  for (const auto* const file : files.Of("polyest.v1")) style.Check(*file);
  return style.breaches();
}

TEST(ContractStyle, HasNothingAgainstAGoodFile) {
  EXPECT_THAT(BreachesOf(R"(
    // Does something.
    service SomeService {
      // Does it.
      rpc Watch(stream WatchRequest) returns (stream WatchResponse);
    }
    // Asks for it.
    message WatchRequest {
      // How long, s. Required.
      double until_s = 1;
    }
    // Answers. Output only.
    message WatchResponse {
      // How many.
      int32 row_count = 1;
    }
    // Is as it always was. Output only.
    message Kept {
      // s.
      double time = 1;
    })"),
              IsEmpty());
}

TEST(ContractStyle, WantsACommentOnEverything) {
  const auto breaches = BreachesOf(R"(
    message Thing {
      string name = 1;
      oneof either { Kind kind = 2; }
      enum Kind { KIND_UNSPECIFIED = 0; }
    }
    service SomeService { rpc Do(DoRequest) returns (DoResponse); }
    // Asks.
    message DoRequest {}
    // Answers.
    message DoResponse {})");
  for (const char* name : {"Thing: ", "Thing.name: ", "Thing.either: ", "Thing.kind: ",
                           "Thing.Kind: ", "Thing.KIND_UNSPECIFIED: ", "SomeService: ", "Do: "}) {
    EXPECT_THAT(breaches, testing::Contains(std::string(name) + "has no comment"));
  }
  EXPECT_THAT(breaches, SizeIs(9));  // The ninth: Thing.name says no presence.
}

void ExpectBreach(const std::string& field, const std::string& breach) {
  const auto breaches =
      BreachesOf("// A thing. Output only.\nmessage Thing {\n  // A field.\n  " + field + "\n}");
  ASSERT_THAT(breaches, SizeIs(1)) << field;
  EXPECT_THAT(breaches[0], HasSubstr(breach));
}

TEST(ContractStyle, WantsUnitsAndCountsInNames) {
  ExpectBreach("double idle_time = 1;", "without its unit");
  ExpectBreach("double until = 1;", "without its unit");
  ExpectBreach("repeated double step = 1;", "without its unit");
  ExpectBreach("int64 memory = 1;", "without its unit");
  ExpectBreach("int64 samples = 1;", "without _count");
}

TEST(ContractStyle, WantsNoUnsignedIntegers) {
  ExpectBreach("uint32 size = 1;", "unsigned");
  ExpectBreach("fixed64 size = 1;", "unsigned");
}

TEST(ContractStyle, WantsNoMapsInStreams) {
  const std::string messages = R"(
    // Asks.
    message DoRequest {}
    // Answers. Output only.
    message DoResponse {
      // What is in it.
      Inner inner = 1;
    }
    // Is in it. Output only.
    message Inner {
      // By name.
      map<string, double> values = 1;
    }
    // Does.
    service SomeService {
      // Does it.
      rpc Do(DoRequest) returns ()";
  EXPECT_THAT(BreachesOf(messages + "DoResponse); }"), IsEmpty());
  const auto breaches = BreachesOf(messages + "stream DoResponse); }");
  ASSERT_THAT(breaches, SizeIs(1));
  EXPECT_THAT(breaches[0], HasSubstr("Inner.values: is a map in a streaming message"));
}

TEST(ContractStyle, WantsTheNamesOfRequestsAndAnswers) {
  const auto of_method = [](const std::string& method) {
    return BreachesOf(
        "// Asks.\nmessage Ask {}\n// Answers.\nmessage Answer {}\n"
        "// Does.\nservice SomeService {\n  // Does it.\n  " +
        method + "\n}");
  };
  EXPECT_THAT(of_method("rpc Do(Ask) returns (Answer);"), SizeIs(2));
  EXPECT_THAT(of_method("rpc CreateThing(Ask) returns (Answer);"), SizeIs(3));
  EXPECT_THAT(of_method("rpc ListThings(Ask) returns (Answer);"), SizeIs(3));
  EXPECT_THAT(of_method("rpc ComputeThing(Ask) returns (Answer);"), SizeIs(4));
}

TEST(ContractStyle, WantsFieldsToSayWhoSetsThemAndWhatMayBeLeftOut) {
  const std::string field = " {\n  // A name.\n  string name = 1;\n}";
  const auto breaches = BreachesOf("// Asks.\nmessage DoRequest" + field);
  ASSERT_THAT(breaches, SizeIs(1));
  EXPECT_THAT(breaches[0], HasSubstr("says neither"));
  EXPECT_THAT(BreachesOf("// Is asked for.\nmessage Thing" + field), SizeIs(1));
  EXPECT_THAT(BreachesOf("// Answers. Output only.\nmessage DoResponse" + field), IsEmpty());
}

}  // namespace
}  // namespace polyest::internal
