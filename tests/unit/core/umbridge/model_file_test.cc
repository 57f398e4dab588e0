// Tests which descriptions of UM-Bridge models are read, and how others are refused.

#include "core/umbridge/model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr char kParts[] =
    R"("urls": ["http://127.0.0.1:4242"], "parameters": [{"name": "k"}], "outputs": [{"name": "x"}])";

std::string With(const std::string& more) {
  return "{" + std::string(kParts) + (more.empty() ? "" : ", ") + more + "}";
}

TEST(UmBridgeDescription, HasDefaults) {
  const auto read = ParseUmBridgeDescription("spring", With(""));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->remote_name, "spring");
  EXPECT_THAT(read->input_sizes, ElementsAre(1));
  EXPECT_EQ(read->servers.requests_per_server, 1);
  EXPECT_EQ(read->servers.timeout_s, 600);
  EXPECT_EQ(read->servers.give_up_after_s, 60);
  EXPECT_FALSE(read->model.parameters[0].has_default);
}

TEST(UmBridgeDescription, HasWhatTheFileSays) {
  const auto read = ParseUmBridgeDescription("spring", R"({
    "urls": ["http://one:1", "https://two"], "name": "forward", "summary": "a spring",
    "parameters": [{"name": "k", "unit": "N/m", "meaning": "stiffness", "default": 2},
                   {"name": "c"}, {"name": "m"}],
    "inputSizes": [2, 0, 1], "outputs": [{"name": "x", "unit": "m"}],
    "config": {"level": 3}, "timesS": [0, 0.5], "requestsPerServer": 4, "timeoutS": 7,
    "giveUpAfterS": 0})");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_THAT(read->servers.urls, ElementsAre("http://one:1", "https://two"));
  EXPECT_EQ(read->remote_name, "forward");
  EXPECT_EQ(read->model.summary, "a spring");
  EXPECT_EQ(read->model.parameters[0].unit, "N/m");
  EXPECT_EQ(read->model.parameters[0].default_value, 2);
  EXPECT_THAT(read->input_sizes, ElementsAre(2, 0, 1));
  EXPECT_EQ(read->config, R"({"level":3})");
  EXPECT_THAT(read->time_s, ElementsAre(0, 0.5));
  EXPECT_EQ(read->servers.requests_per_server, 4);
  EXPECT_EQ(read->servers.timeout_s, 7);
  EXPECT_EQ(read->servers.give_up_after_s, 0);
}

TEST(UmBridgeDescription, TellsModelsApartAndNotServers) {
  const auto identity = [](const std::string& json) {
    const auto read = ParseUmBridgeDescription("spring", json);
    return read.ok() ? read->model.identity : read.status().ToString();
  };
  EXPECT_NE(identity(With("")), identity(With(R"("config": {"level": 3})")));
  EXPECT_NE(identity(With(R"("timesS": [1])")), identity(With(R"("timesS": [2])")));
  EXPECT_EQ(identity(With("")), identity(R"({"urls": ["http://elsewhere:1"],
                                "parameters": [{"name": "k"}], "outputs": [{"name": "x"}]})"));
}

TEST(UmBridgeDescription, HasInputs) {
  const auto read = ParseUmBridgeDescription(
      "spring", With(R"("inputs": [{"name": "force", "unit": "N", "meaning": "at the mass"}])"));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->model.inputs.size(), 1u);
  EXPECT_EQ(read->model.inputs[0].name, "force");
  EXPECT_EQ(read->model.inputs[0].unit, "N");
}

TEST(UmBridgeDescription, NamesWhatIsWrong) {
  const std::vector<std::pair<std::string, const char*>> wrong = {
      {"", "the file must be an object in JSON"},
      {"[]", "the file must be an object in JSON"},
      {"{", "the file must be an object in JSON"},
      {"{}", "urls: null must be a list"},
      {R"({"urls": []})", "urls: [] must be a list"},
      {R"({"urls": ["ftp://x"]})", "urls: \"ftp://x\" must be like"},
      {R"({"urls": ["http://x/y"]})", "without a path"},
      {R"({"urls": ["http://"]})", "urls: \"http://\" must be like"},
      {R"({"urls": ["http://x"]})", "parameters: null must be a list"},
      {R"({"urls": ["http://x"], "parameters": [{}]})", "parameters: {} must have a \"name\""},
      {R"({"urls": ["http://x"], "parameters": [{"name": "k", "sd": 1}]})",
       "parameters has a member sd that is not known; there are name, unit, meaning, default"},
      {R"({"urls": ["http://x"], "parameters": [{"name": "k"}, {"name": "k"}]})",
       "has the name of another one"},
      {R"({"urls": ["http://x"], "parameters": [{"name": "k"}]})", "outputs: null must be a list"},
      {With(R"("url": "x")"), "the file has a member url that is not known; there are urls, name"},
      {With(R"("name": 1)"), "name: 1 must be a string"},
      {With(R"("inputSizes": 1)"), "inputSizes: 1 must be a list"},
      {With(R"("inputSizes": [2])"), "with the sum 1, the number of parameters"},
      {With(R"("inputSizes": [])"), "inputSizes: [] must be a list"},
      {With(R"("inputSizes": [-1, 2])"), "inputSizes: -1 must be"},
      {With(R"("config": 1)"), "config: 1 must be an object"},
      {With(R"("config": {"times": 1})"), "must not have \"times\""},
      {With(R"("inputs": [])"), "inputs: [] must be a list"},
      {With(R"("inputs": [{"name": "u", "default": 1}])"), "inputs has a member default"},
      {With(R"("inputs": [{"name": "u"}, {"name": "u"}])"), "has the name of another one"},
      {With(R"("inputs": [{"name": "u"}], "timesS": [1])"),
       "inputs: [{\"name\":\"u\"}] cannot drive a model with timesS"},
      {With(R"("inputs": [{"name": "u"}], "config": {"inputs": 1})"), "must not have \"inputs\""},
      {With(R"("timesS": [1, 1])"), "timesS: 1 must be a list of increasing times"},
      {With(R"("timesS": [-1])"), "timesS: -1 must be a list of increasing times"},
      {With(R"("timesS": [])"), "timesS: [] must be a list of increasing times"},
      {With(R"("requestsPerServer": 0)"), "requestsPerServer: 0 must be a number from 1 to 1000"},
      {With(R"("requestsPerServer": 1.5)"), "requestsPerServer: 1.5 must be a whole number"},
      {With(R"("timeoutS": 0)"), "timeoutS: 0 must be a number from 0.001"},
      {With(R"("giveUpAfterS": "1")"), "giveUpAfterS: \"1\" must be a number from 0"},
  };
  for (const auto& [json, reason] : wrong) {
    const absl::Status status = ParseUmBridgeDescription("spring", json).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << json;
    EXPECT_THAT(std::string(status.message()), HasSubstr(reason)) << json;
  }
}

}  // namespace
}  // namespace polyest::internal
