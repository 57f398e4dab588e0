#include "tests/calibration/campaigns.h"

#include <cmath>
#include <random>

#include "core/common/check.h"
#include "core/propagation/ensemble_propagator.h"
#include "polyest/catalogue.h"

namespace polyest::internal::calibration {
namespace {

constexpr double kCorrelationIntervals = 3;

UncertainParameter Uniform(const char* name, double lower, double upper) {
  return *UncertainParameter::Uniform(name, lower, upper);
}

Rig Oscillator() {
  Rig rig{"oscillator", {}, 0.05, 40, 400};
  rig.problem.model = *FindBuiltinModel("mass_spring_damper");
  rig.problem.fixed = {{"m", 1}, {"x0", 1}};
  rig.problem.uncertain = {Uniform("k", 31.58, 47.37), Uniform("c", 0.1, 0.3)};
  rig.problem.measured = {{"x", {.absolute = 0.02}}};
  return rig;
}

Rig QuarterCar() {
  Rig rig{"quarter car", {}, 0.01, 80, 400};
  rig.problem.model = *FindBuiltinModel("quarter_car");
  rig.problem.fixed = {{"ms", 290}, {"mu", 59}};
  rig.problem.uncertain = {Uniform("ks", 12'000, 22'000), Uniform("cs", 500, 2'000),
                           *UncertainParameter::Normal("kt", 190'000, 20'000)};
  rig.problem.inputs = {
      {"road", HalfSineBumpInput{.amplitude = 0.05, .start_s = 0.1, .duration_s = 0.15}}};
  rig.problem.measured = {{"travel", {.absolute = 0.002}}, {"zs_accel", {.absolute = 0.2}}};
  return rig;
}

Rig RollPlane() {
  Rig rig{"roll plane", {}, 0.02, 75, 250};
  rig.problem.model = *FindBuiltinModel("roll_plane_4dof");
  rig.problem.uncertain = {*UncertainParameter::Beta("m_a", 2, 2, 50, 350), Uniform("d", 0.2, 1.3)};
  rig.problem.inputs = {
      {"y1", HalfSineBumpInput{.amplitude = 0.05, .start_s = 0.2, .duration_s = 0.2}},
      {"y2", HalfSineBumpInput{.amplitude = 0.05, .start_s = 0.8, .duration_s = 0.2}}};
  rig.problem.measured = {{"d1", {.absolute = 0.001}}, {"d2", {.absolute = 0.001}}};
  return rig;
}

// Returns the outputs of a problem at the truth, rows × channels.
Matrix Simulate(const Problem& problem, const Vector& truth, const std::vector<double>& times_s) {
  Problem exact = problem;
  exact.integration.relative_tolerance = 1e-11;
  const ResolvedProblem resolved = ResolvedProblem::Make(std::move(exact)).value();
  const InputSignals inputs = resolved.MakeInputs();
  EnsemblePropagator propagator(resolved.MakeEnsemble(truth.transpose(), resolved.outputs(), 1),
                                &inputs);
  Matrix outputs(1, static_cast<Eigen::Index>(times_s.size()) * resolved.channels());
  POLYEST_CHECK(propagator.Advance(times_s, outputs, Stop()).ok() && outputs.allFinite());
  return outputs.reshaped<Eigen::RowMajor>(static_cast<Eigen::Index>(times_s.size()),
                                           resolved.channels());
}

}  // namespace

const char* NameOf(Noise noise) {
  switch (noise) {
    case Noise::kWhite:
      return "white, known";
    case Noise::kUnknown:
      return "white, unknown";
    case Noise::kCorrelated:
      return "AR(1), unknown";
  }
  return "";
}

std::vector<Rig> Rigs() { return {Oscillator(), QuarterCar(), RollPlane()}; }

Campaign MakeCampaign(const Rig& rig, int rows, Noise noise, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  Campaign campaign{rig.problem, {}, {}, {}};
  const Prior prior(rig.problem.uncertain);
  const Vector xi = Vector::NullaryExpr(prior.dimension(), [&](Eigen::Index i) {
    return prior.germs()[static_cast<size_t>(i)].Quantile(uniform(random));
  });
  campaign.truth = prior.ToParameters(xi);
  for (int k = 1; k <= rows; ++k) campaign.record.time_s.push_back(k * rig.interval_s);
  const Matrix outputs = Simulate(rig.problem, campaign.truth, campaign.record.time_s);
  campaign.signal = outputs;
  const double a = noise == Noise::kCorrelated ? std::exp(-1 / kCorrelationIntervals) : 0;
  for (Eigen::Index c = 0; c < outputs.cols(); ++c) {
    MeasuredOutput& measured = campaign.problem.measured[static_cast<size_t>(c)];
    SampleColumn column{measured.output, {}, {}};
    double e = normal(random);
    for (const double y : outputs.col(c)) {
      column.value.push_back(y + measured.noise.absolute * e);
      e = a * e + std::sqrt(1 - a * a) * normal(random);
    }
    campaign.record.columns.push_back(std::move(column));
    if (noise != Noise::kWhite) measured.noise = {.unknown = true};
    if (noise == Noise::kCorrelated) measured.noise.correlation = NoiseCorrelation::kUnknown;
  }
  return campaign;
}

}  // namespace polyest::internal::calibration
