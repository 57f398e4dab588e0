// Tests models of UM-Bridge servers as models of an ensemble and of an estimate. The oracle of
// estimates is the same model as a text.

#include "core/umbridge/umbridge_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "core/propagation/ensemble_propagator.h"
#include "polyest/equation_model.h"
#include "polyest/estimator.h"
#include "tests/unit/core/umbridge/model_server.h"

namespace polyest::internal::umbridge_model_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Json = nlohmann::json;

// x = a e^{−b t} and v = −b x at the times of the configuration; a < 0 is refused.
void Decay(const Json& request, httplib::Response& answer) {
  const double a = request["input"][0][0];
  const double b = request["input"][1][0];
  if (a < 0) return ModelServer::Refuse("a must not be negative", answer);
  std::vector<double> x, v;
  for (const double t : request["config"]["times"]) {
    x.push_back(a * std::exp(-b * t));
    v.push_back(-b * x.back());
  }
  ModelServer::Answer({x, v}, answer);
}

UmBridgeDescription Description(const ModelServer& server) {
  UmBridgeDescription description;
  description.model.name = "decay";
  description.model.parameters = {{"a", "m", "", 1}, {"b", "1/s", "", 1}};
  description.model.outputs = {{"x", "m", ""}, {"v", "m/s", ""}};
  description.remote_name = "decay";
  description.input_sizes = {1, 1};
  description.servers.urls = {server.url()};
  description.servers.give_up_after_s = 0;
  return description;
}

// Advances points (a, b) to times; the outputs are v, x.
struct Ensemble {
  Ensemble(UmBridgeDescription description, const Matrix& points) {
    EnsembleSpecification specification;
    specification.model = std::make_shared<UmBridgeModel>(std::move(description));
    specification.parameters = points;
    specification.amplitudes = Matrix(points.rows(), 0);  // no inputs
    specification.outputs = {1, 0};
    propagator.emplace(std::move(specification), &inputs);
  }
  absl::StatusOr<Matrix> Advance(const std::vector<double>& times_s) {
    Matrix outputs(propagator->points(), 2 * std::ssize(times_s));
    const absl::Status status = propagator->Advance(times_s, outputs, Stop());
    if (!status.ok()) return status;
    return outputs;
  }
  InputSignals inputs;
  std::optional<EnsemblePropagator> propagator;
};

const Matrix kPoints{{1, 2}, {3, 0.5}};

TEST(UmBridgeModel, IsAskedForTheTimesOfSamples) {
  ModelServer server(Decay);
  Ensemble ensemble(Description(server), kPoints);
  const auto outputs = ensemble.Advance({0, 0.25});
  ASSERT_TRUE(outputs.ok()) << outputs.status();
  for (Eigen::Index q = 0; q < 2; ++q) {
    const double a = kPoints(q, 0), b = kPoints(q, 1);
    EXPECT_EQ((*outputs)(q, 0), -b * a);
    EXPECT_EQ((*outputs)(q, 1), a);
    EXPECT_EQ((*outputs)(q, 2), -b * (a * std::exp(-b * 0.25)));
    EXPECT_EQ((*outputs)(q, 3), a * std::exp(-b * 0.25));
  }
  EXPECT_EQ((*ensemble.Advance({0.5}))(0, 1), std::exp(-1.0));
  EXPECT_EQ(server.requests(), 4);
}

TEST(UmBridgeModel, IsAskedOnceIfItsTimesAreListed) {
  ModelServer server([](const Json& request, httplib::Response& answer) {
    EXPECT_EQ(request["config"], (Json{{"level", 3}}));
    const double a = request["input"][0][0];
    ModelServer::Answer({{a, 2 * a, 3 * a}, {0, 0, 0}}, answer);
  });
  UmBridgeDescription description = Description(server);
  description.config = R"({"level": 3})";
  description.time_s = {0, 0.1, 0.3};
  Ensemble ensemble(description, kPoints);
  EXPECT_EQ((*ensemble.Advance({0.1}))(1, 1), 6);
  EXPECT_EQ((*ensemble.Advance({0.1 + 0.2}))(1, 1), 9);  // a bit beside 0.3
  EXPECT_EQ(server.requests(), 2);
  EXPECT_EQ(ensemble.Advance({0.4}).status().message(),
            "umbridge decay: t = 0.4 s is not among the times of its description (timesS)");
}

TEST(UmBridgeModel, IsNotAskedForAPointWhoseParametersAreNotFinite) {
  ModelServer server(Decay);
  Ensemble ensemble(Description(server), Matrix{{1, 2}, {std::nan(""), 2}});
  const auto outputs = ensemble.Advance({0.5});
  ASSERT_TRUE(outputs.ok()) << outputs.status();
  EXPECT_EQ((*outputs)(0, 1), std::exp(-1.0));
  EXPECT_TRUE(std::isnan((*outputs)(1, 1)));
  ASSERT_THAT(ensemble.propagator->failures(), SizeIs(1));
  EXPECT_EQ(ensemble.propagator->failures()[0].point, 1);
  EXPECT_THAT(ensemble.propagator->failures()[0].reason, HasSubstr("not finite"));
  EXPECT_EQ(server.requests(), 1);
}

TEST(UmBridgeModel, LeavesOutPointsThatFail) {
  ModelServer server(Decay);
  Ensemble ensemble(Description(server), Matrix{{1, 2}, {-1, 2}});
  ASSERT_TRUE(ensemble.Advance({0.5}).ok());
  const auto outputs = ensemble.Advance({1});
  ASSERT_TRUE(outputs.ok()) << outputs.status();
  EXPECT_EQ((*outputs)(0, 1), std::exp(-2.0));
  EXPECT_TRUE(std::isnan((*outputs)(1, 1)));
  EXPECT_EQ(server.requests(), 3);
  const std::vector<PointFailure>& failures = ensemble.propagator->failures();
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_EQ(failures[0].point, 1);
  EXPECT_EQ(failures[0].reason, "InvalidInput: a must not be negative");
}

TEST(UmBridgeModel, SaysHowItsOutputsDifferFromItsDescription) {
  const std::vector<std::pair<Json, const char*>> wrong = {
      {{{1}}, "it has 1 output vectors where its description has 2 outputs"},
      {{{1}, {1, 2}}, "its output vector 1 has 2 values for 1 times"}};
  for (const auto& [output, reason] : wrong) {
    ModelServer server([&output = output](const Json&, httplib::Response& answer) {
      ModelServer::Answer(output, answer);
    });
    Ensemble ensemble(Description(server), kPoints);
    ASSERT_TRUE(ensemble.Advance({1}).ok());
    ASSERT_THAT(ensemble.propagator->failures(), SizeIs(2));
    EXPECT_EQ(ensemble.propagator->failures()[0].reason, reason);
  }
}

Problem DecayProblem(std::shared_ptr<const Model> model) {
  Problem problem;
  problem.model = std::move(model);
  problem.uncertain = {UncertainParameter::Normal("a", 1, 0.3).value(),
                       UncertainParameter::Uniform("b", 0.2, 3).value()};
  problem.measured = {{"x", {.absolute = 0.02}}};
  return problem;
}

absl::StatusOr<Estimate> EstimateWith(std::shared_ptr<const Model> model) {
  auto estimator = Estimator::Make(DecayProblem(std::move(model)));
  if (!estimator.ok()) return estimator.status();
  Samples record;
  record.columns = {{"x", {}, {}}};
  for (int k = 0; k < 100; ++k) {
    const double t = 0.02 * k;
    record.time_s.push_back(t);
    record.columns[0].value.push_back(1.2 * std::exp(-0.7 * t) + 0.02 * std::sin(1000 * t * t));
  }
  if (absl::Status status = (*estimator)->Append(record); !status.ok()) return status;
  if (absl::Status status = (*estimator)->Process(); !status.ok()) return status;
  return (*estimator)->CurrentEstimate();
}

TEST(UmBridgeModel, GivesTheEstimateOfTheSameModelAsText) {
  ModelServer one(Decay), two(Decay);
  UmBridgeDescription description = Description(one);
  description.servers.urls.push_back(two.url());
  const auto remote = EstimateWith(std::make_shared<UmBridgeModel>(description));
  ASSERT_TRUE(remote.ok()) << remote.status();
  const auto text = EstimateWith(*MakeEquationModel({.outputs = {{"x", "a*exp(-b*t)"}}}));
  ASSERT_TRUE(text.ok()) << text.status();
  for (size_t i = 0; i < 2; ++i) {
    // The models differ by rounding, which may move the points at which they are expanded; the
    // error of an expansion is small beside the standard deviation.
    const double near = 0.05 * text->parameters[i].posterior_std_dev;
    EXPECT_NEAR(remote->parameters[i].mean, text->parameters[i].mean, near);
    EXPECT_NEAR(remote->parameters[i].posterior_std_dev, text->parameters[i].posterior_std_dev,
                near);
  }
}

// Each point finds its own input, amplitude · shape(t − delay) + offset, up to the last time.
TEST(UmBridgeModel, IsToldItsInputs) {
  ModelServer server([](const Json& request, httplib::Response& answer) {
    const Json& u = request["config"]["inputs"]["u"];
    EXPECT_EQ(u["times"].back(), request["config"]["times"].back());
    ModelServer::Answer({u["times"], u["values"]}, answer);
  });
  UmBridgeDescription description = Description(server);
  description.model.inputs = {{"u", "N", ""}};
  EnsembleSpecification specification;
  specification.model = std::make_shared<UmBridgeModel>(description);
  specification.parameters = kPoints;
  specification.amplitudes = Matrix{{2}, {10}};
  specification.input_delays_s = Matrix{{0}, {0.5}};
  specification.input_offsets = Matrix{{0}, {1}};
  specification.outputs = {0, 1};
  const InputSignals inputs = {
      InputSignal::Make(TableInput{.time_s = {0, 1, 2}, .value = {0, 1, 1}}).value()};
  EnsemblePropagator propagator(std::move(specification), &inputs);
  Matrix outputs(2, 6);
  // As many times as the first point's input has points: 0, 1 and 1.5 s. The second one's has the
  // knots 0 s, 0.5 s and 1.5 s; at 1.5 s its shape is that of 1 s.
  ASSERT_TRUE(propagator.Advance(std::vector<double>{0.25, 0.5, 1.5}, outputs, Stop()).ok());
  EXPECT_EQ(outputs, (Matrix{{0, 0, 1, 2, 1.5, 2}, {0, 1, 0.5, 1, 1.5, 11}}));
}

TEST(UmBridgeModel, SaysWhichInputHasTooManyLines) {
  ModelServer server(Decay);
  UmBridgeDescription description = Description(server);
  description.model.inputs = {{"u", "N", ""}};
  EnsembleSpecification specification;
  specification.model = std::make_shared<UmBridgeModel>(description);
  specification.parameters = kPoints;
  specification.amplitudes = Matrix::Ones(2, 1);
  specification.outputs = {0, 1};
  const InputSignals inputs = {InputSignal::Make(SinusoidInput{.frequency_hz = 1e7}).value()};
  EnsemblePropagator propagator(std::move(specification), &inputs);
  Matrix outputs(2, 2);
  EXPECT_EQ(propagator.Advance(std::vector<double>{1}, outputs, Stop()).message(),
            "umbridge decay: input u: more than 1e+06 lines would have to stand for it up to "
            "t = 1 s");
  EXPECT_EQ(server.requests(), 0);
}

TEST(UmBridgeModel, EndsAnEstimateIfNoServerIsLeft) {
  std::optional<ModelServer> server(Decay);
  const UmBridgeDescription description = Description(*server);
  server.reset();
  const absl::Status status = EstimateWith(std::make_shared<UmBridgeModel>(description)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("umbridge decay: no server could be reached for 0 s"));
}

}  // namespace
}  // namespace polyest::internal::umbridge_model_test
