#include "server/web/umbridge_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

using testing::HasSubstr;

v1::ComputeLogDensityResponse TwoParameters() {
  v1::ComputeLogDensityResponse density;
  density.add_parameters("k");
  density.add_parameters("c");
  density.mutable_log_posterior()->add_value(-3);
  density.mutable_log_likelihood()->add_value(-2.5);
  for (const double slope : {1.0, -2.0}) density.mutable_log_likelihood()->add_gradient(slope);
  for (const double bend : {-4.0, 1.0, 1.0, -9.0}) {
    density.mutable_log_posterior()->add_hessian(bend);
  }
  return density;
}

std::string AnswerTo(const char* path, const char* body) {
  const auto request = ReadUmBridgeRequest(path, body);
  if (!request.ok()) return std::string(request.status().message());
  const auto answer = UmBridgeAnswer(*request, TwoParameters());
  return answer.ok() ? *answer : std::string(answer.status().message());
}

TEST(UmBridgeMessage, AnswersEachRequestOfTheProtocol) {
  EXPECT_EQ(AnswerTo("/InputSizes", R"({"name":"run7","config":{}})"), R"({"inputSizes":[2]})");
  EXPECT_EQ(AnswerTo("/OutputSizes", R"({"name":"run7"})"), R"({"outputSizes":[1,1]})");
  EXPECT_THAT(AnswerTo("/ModelInfo", R"({"name":"run7"})"), HasSubstr(R"("ApplyHessian":true)"));
  EXPECT_EQ(AnswerTo("/Evaluate", R"({"name":"run7","input":[[40,0.2]]})"),
            R"({"output":[[-3.0],[-2.5]]})");
  EXPECT_EQ(AnswerTo("/Gradient", R"({"name":"run7","outWrt":1,"inWrt":0,"input":[[40,0.2]],)"
                                  R"("sens":[2]})"),
            R"({"output":[2.0,-4.0]})");
  EXPECT_EQ(AnswerTo("/ApplyJacobian", R"({"name":"run7","outWrt":1,"inWrt":0,)"
                                       R"("input":[[40,0.2]],"vec":[3,1]})"),
            R"({"output":[1.0]})");
  EXPECT_EQ(AnswerTo("/ApplyHessian", R"({"name":"run7","outWrt":0,"inWrt1":0,"inWrt2":0,)"
                                      R"("input":[[40,0.2]],"sens":[2],"vec":[1,3]})"),
            R"({"output":[-2.0,-52.0]})");
}

TEST(UmBridgeMessage, NamesTheMemberThatIsWrong) {
  EXPECT_EQ(AnswerTo("/Evaluate", "[1]"), "the request must be a JSON object");
  EXPECT_EQ(AnswerTo("/Evaluate", R"({"input":[[1,2]]})"), "name: must be the name of a model");
  EXPECT_EQ(AnswerTo("/Evaluate", R"({"name":"a","config":{"x":1},"input":[[1,2]]})"),
            "config: the model has no configuration; must be {}");
  EXPECT_EQ(AnswerTo("/Evaluate", R"({"name":"a","input":[[1],[2]]})"),
            "input: must be a list of one vector, the parameters");
  EXPECT_EQ(AnswerTo("/Evaluate", R"({"name":"a","input":[[1,"2"]]})"),
            "input[0]: must be a list of numbers");
  EXPECT_EQ(AnswerTo("/Evaluate", R"({"name":"a","input":[[]]})"), "input[0]: has no numbers");
  EXPECT_EQ(AnswerTo("/Evaluate", R"({"name":"a","input":[[1,2,3,4]]})"),
            "input[0]: has 4 numbers; the model takes 2: k, c");
  EXPECT_EQ(AnswerTo("/Gradient", R"({"name":"a","input":[[1,2]],"outWrt":2,"inWrt":0})"),
            "outWrt: must be an integer from 0 to 1");
  EXPECT_EQ(AnswerTo("/Gradient", R"({"name":"a","input":[[1,2]],"outWrt":0,"inWrt":1})"),
            "inWrt: must be an integer from 0 to 0");
  EXPECT_EQ(
      AnswerTo("/Gradient", R"({"name":"a","input":[[1,2]],"outWrt":0,"inWrt":0,"sens":[1,2]})"),
      "sens: has 2 numbers; each output has 1");
  EXPECT_EQ(
      AnswerTo("/ApplyJacobian", R"({"name":"a","input":[[1,2]],"outWrt":0,"inWrt":0,"vec":[1]})"),
      "vec: has 1 numbers; the model takes 2: k, c");
}

}  // namespace
}  // namespace polyest::internal
