#include "core/propagation/ensemble_propagator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "core/model/catalogue.h"

namespace polyest {
namespace {

std::shared_ptr<const Model> Builtin(const char* name) { return *FindBuiltinModel(name); }

// Every parameter at its default for all points.
Matrix DefaultParameters(const Model& model, int points) {
  const auto& parameters = model.description().parameters;
  Matrix values(points, static_cast<Eigen::Index>(parameters.size()));
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    values.col(j).setConstant(parameters[j].default_value);
  }
  return values;
}

int ParameterIndex(const Model& model, const char* name) {
  return *model.description().FindParameter(name);
}

InputSignal Signal(InputSpecification specification) {
  return *InputSignal::Make(std::move(specification));
}

// x(t), v(t) of m ẍ + c ẋ + k x = 0.
struct Oscillator {
  double m, c, k, x0, v0;
  double X(double t) const {
    const double d = c / (2 * m), w = std::sqrt(k / m - d * d);
    return std::exp(-d * t) * (x0 * std::cos(w * t) + (v0 + d * x0) / w * std::sin(w * t));
  }
};

class EnsembleOfOscillators : public ::testing::Test {
 protected:
  void SetUp() override { Make(20); }
  void Make(int points) {
    specification_.model = Builtin("mass_spring_damper");
    const Model& model = *specification_.model;
    specification_.parameters = DefaultParameters(model, points);
    specification_.amplitudes = Matrix::Zero(points, 1);
    specification_.outputs = {*model.description().FindOutput("x")};
    oscillators_.clear();
    for (int p = 0; p < points; ++p) {
      const Oscillator o{1 + 0.01 * p, 0.1 + 0.02 * p, 30.0 + p, p % 3 == 0 ? 0.0 : 1.0, 1.0};
      oscillators_.push_back(o);
      const std::pair<const char*, double> values[] = {
          {"m", o.m}, {"c", o.c}, {"k", o.k}, {"x0", o.x0}, {"v0", o.v0}};
      for (const auto& [name, value] : values) {
        specification_.parameters(p, ParameterIndex(model, name)) = value;
      }
    }
    inputs_ = {Signal(ConstantInput{0})};
  }
  EnsembleSpecification specification_;
  InputSignals inputs_;
  std::vector<Oscillator> oscillators_;
};

TEST_F(EnsembleOfOscillators, FollowsTheClosedForm) {
  specification_.integration.relative_tolerance = 1e-9;
  EnsemblePropagator propagator(specification_, &inputs_);
  std::vector<double> times;
  for (int i = 0; i <= 100; ++i) times.push_back(0.05 * i);
  Matrix x(20, times.size());
  ASSERT_TRUE(propagator.Advance(times, x, Stop()).ok());
  EXPECT_TRUE(propagator.failures().empty());
  double worst = 0;
  for (int p = 0; p < 20; ++p) {
    for (size_t i = 0; i < times.size(); ++i) {
      worst = std::max(worst, std::abs(x(p, i) - oscillators_[p].X(times[i])));
    }
  }
  EXPECT_LT(worst, 1e-7);
}

}  // namespace
}  // namespace polyest
