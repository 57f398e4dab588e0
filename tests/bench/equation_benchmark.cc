// Compares the time per point of a right-hand side given as text with that of the same model in
// C++, for blocks of 64 points, as the integrators request them.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "core/common/check.h"
#include "core/model/builtin/duffing.h"
#include "core/model/builtin/pendulum.h"
#include "core/model/equations/equation_model.h"
#include "core/model/lane_model.h"
#include "tests/bench/half_car.h"
#include "tests/bench/half_car_equations.h"

namespace polyest::internal::bench {
namespace {

constexpr Eigen::Index kRows = 64;
constexpr int kRepetitions = 9;
constexpr int kCalls = 20'000;

Eigen::ArrayXXd Varied(size_t columns, double phase) {
  return Eigen::ArrayXXd::NullaryExpr(
      kRows, static_cast<Eigen::Index>(columns), [phase](Eigen::Index i, Eigen::Index j) {
        return 0.1 * std::sin(0.7 * static_cast<double>(i) + 2.3 * static_cast<double>(j) + phase);
      });
}

// Returns the shortest time of several runs, ns per point.
template <class Call>
double Measure(const Call& call) {
  double shortest = INFINITY;
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kCalls; ++i) call(1e-3 * i);
    const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - begin;
    shortest = std::min(shortest, time.count() / (kCalls * kRows));
  }
  return shortest;
}

double MeasureDerivatives(const StateSpaceModel& model) {
  const ModelDescription& description = model.description();
  const Eigen::ArrayXXd states = Varied(description.states.size(), 1);
  const Eigen::ArrayXXd parameters = 1 + Varied(description.parameters.size(), 2);
  const Eigen::ArrayXXd inputs = Varied(description.inputs.size(), 3);
  Eigen::ArrayXXd derivatives(kRows, states.cols());
  return Measure(
      [&](double time_s) { model.Derivatives(time_s, states, parameters, inputs, derivatives); });
}

double MeasureJacobian(const StateSpaceModel& model) {
  const ModelDescription& description = model.description();
  const Eigen::ArrayXXd states = Varied(description.states.size(), 1);
  const Eigen::ArrayXXd parameters = 1 + Varied(description.parameters.size(), 2);
  const Eigen::ArrayXXd inputs = Varied(description.inputs.size(), 3);
  Eigen::ArrayXXd jacobian(kRows, states.cols() * states.cols());
  return Measure(
      [&](double time_s) { model.StateJacobian(time_s, states, parameters, inputs, jacobian); });
}

void Compare(const char* name, const StateSpaceModel& model,
             const EquationSpecification& equations) {
  const auto text = MakeEquationModel(equations);
  POLYEST_CHECK(text.ok());
  const double compiled = MeasureDerivatives(model);
  const double interpreted = MeasureDerivatives(**text);
  std::printf("%-12s %12.2f %12.2f %8.1f %16.2f\n", name, compiled, interpreted,
              interpreted / compiled, MeasureJacobian(**text));
}

int Main() {
  std::printf("%-12s %12s %12s %8s %16s\n", "model", "C++ ns/point", "text ns/point", "ratio",
              "Jacobian ns/point");
  Compare("half_car", LaneModel<HalfCar>(), HalfCarEquations());
  Compare("duffing", LaneModel<builtin::Duffing>(),
          {.states = {{"x", "v"}, {"v", "(force + offset - c*v - (k + (k2 + k3*x)*x)*x)/m"}},
           .outputs = {{"x", "x"}, {"v", "v"}},
           .inputs = {"force"}});
  Compare("pendulum", LaneModel<builtin::Pendulum>(),
          {.states = {{"theta", "omega"},
                      {"omega", "-g_over_l*sin(theta) - (c + c2*abs(omega))*omega"}},
           .outputs = {{"angle", "theta"}, {"rate", "omega"}},
           .parameters = {{"g_over_l", 1}, {"c", 1}, {"c2", 1}}});
  return 0;
}

}  // namespace
}  // namespace polyest::internal::bench

int main() { return polyest::internal::bench::Main(); }
