#include "tests/properties/problems.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>

#include "core/common/check.h"

namespace polyest::internal::properties {
namespace {

constexpr int kDraws = 60;        // of the prior, at which sharpness is looked at
constexpr double kQuieter = 1.5;  // factor by which the noise is raised until a grid can be had
constexpr double kFarOut = 4.5;   // prior standard deviations of a truth that contradicts its prior

// Sample times in (0, until]: at equal intervals, irregular, in bursts, or late.
std::vector<double> DrawTimes(Random& random, double until_s) {
  const int count = random.Chance(0.2) ? random.Integer(3, 8) : random.Integer(8, 60);
  const double from_s = random.Chance(0.2) ? random.Uniform(0, 0.6) * until_s : 0;
  const int kind = random.Integer(0, 2);
  std::vector<double> times;
  for (int k = 1; k <= count; ++k) {
    double part = static_cast<double>(k) / count;
    if (kind == 1) part = random.Uniform(0, 1);
    if (kind == 2) part = (std::floor(4 * part * 0.999) + 0.3 * random.Uniform(0, 1)) / 4;
    times.push_back(from_s + (until_s - from_s) * std::max(part, 1e-3));
  }
  std::ranges::sort(times);
  const double least = 1e-6 * until_s;
  for (size_t k = 1; k < times.size(); ++k) times[k] = std::max(times[k], times[k - 1] + least);
  return times;
}

Vector DrawUnknowns(const SmallProblem& small, Random& random) {
  const size_t nonlinear = small.law.nonlinear.size();
  Vector theta(static_cast<Eigen::Index>(nonlinear + small.law.linear.size()));
  for (size_t i = 0; i < nonlinear; ++i) {
    const Density& density = small.law.nonlinear[i].density;
    theta[static_cast<Eigen::Index>(i)] = density.ToParameter(density.Draw(random));
  }
  // β of correlated priors: the mean and a triangular factor of the covariance times normal
  // numbers.
  const Matrix& covariance = small.linear_covariance;
  Matrix factor = Matrix::Zero(covariance.rows(), covariance.cols());
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double rest = covariance(i, j) - factor.row(i).head(j).dot(factor.row(j).head(j));
      factor(i, j) = i == j ? std::sqrt(rest) : rest / factor(j, j);
    }
  }
  Vector normal(covariance.rows());
  for (double& number : normal) number = random.Normal();
  const Vector deviation = factor * normal;
  for (Eigen::Index j = 0; j < deviation.size(); ++j) {
    theta[static_cast<Eigen::Index>(nonlinear) + j] =
        small.law.linear[static_cast<size_t>(j)].mean + deviation[j];
  }
  return theta;
}

void SetPriors(SmallProblem& small, Random& random) {
  const auto count = static_cast<Eigen::Index>(small.law.linear.size());
  small.linear_covariance = Matrix::Zero(count, count);
  for (const Law::Nonlinear& one : small.law.nonlinear) {
    small.problem.uncertain.push_back(one.density.Parameter(one.name));
  }
  for (Eigen::Index j = 0; j < count; ++j) {
    const Law::Linear& one = small.law.linear[static_cast<size_t>(j)];
    small.linear_covariance(j, j) = one.std_dev * one.std_dev;
    small.problem.uncertain.push_back(*UncertainParameter::Normal(one.name, one.mean, one.std_dev));
  }
  if (count < 2 || !random.Chance(0.15)) return;
  const Law::Linear &first = small.law.linear[0], &second = small.law.linear[1];
  const double coefficient = random.Chance(0.5) ? random.Uniform(-0.9, 0.9) : 0.999;
  small.problem.correlations = {{first.name, second.name, coefficient}};
  small.linear_covariance(0, 1) = small.linear_covariance(1, 0) =
      coefficient * first.std_dev * second.std_dev;
}

// Raises the noise until a grid over ν can resolve the posterior wherever it may be.
void QuietenUntilResolved(SmallProblem& small) {
  while (NodesOf(small, SafeSteps(small)) > kMaxNodes) small.sigma *= kQuieter;
}

void SetNoise(SmallProblem& small, Random& random) {
  const std::vector<double> clean = Outputs(small.law, small.truth, small.record.time_s);
  double mean = 0, spread = 0, size = 0;
  const auto count = static_cast<double>(clean.size());
  for (const double y : clean) mean += y / count;
  for (const double y : clean) spread += (y - mean) * (y - mean) / count;
  for (const double y : clean) size += y * y / count;
  const double scale = std::sqrt(spread > 1e-6 * size ? spread : std::max(size, 1e-6));
  small.sigma = scale * random.LogUniform(0.003, 0.5);
  const double kind = random.Uniform(0, 1);
  const bool enough = count >= 10 + 4 * static_cast<double>(small.truth.size());
  if (kind < 0.15 && enough) small.sigma_unknown = true;
  if (kind > 0.85) small.time_constant_s = small.law.until_s / count * random.LogUniform(0.5, 5);
  QuietenUntilResolved(small);
  NoiseModel noise{.absolute = small.sigma};
  if (small.sigma_unknown) noise = {.unknown = true};
  if (small.time_constant_s > 0) {
    noise.correlation = NoiseCorrelation::kKnown;
    noise.time_constant_s = small.time_constant_s;
  }
  small.problem.measured = {{"y", noise}};
}

void Measure(SmallProblem& small, Random& random) {
  SampleColumn column{"y", Outputs(small.law, small.truth, small.record.time_s), {}};
  double e = 0;
  for (size_t k = 0; k < column.value.size(); ++k) {
    double a = 0;
    if (k > 0 && small.time_constant_s > 0) {
      a = std::exp((small.record.time_s[k - 1] - small.record.time_s[k]) / small.time_constant_s);
    }
    e = a * e + std::sqrt(1 - a * a) * random.Normal();
    column.value[k] += small.sigma * e;
  }
  small.record.columns = {std::move(column)};
}

}  // namespace

std::vector<double> Outputs(const Law& law, const Vector& theta,
                            const std::vector<double>& time_s) {
  std::vector<double> outputs;
  double g[1 + kMaxLinear];
  for (const double t : time_s) {
    law.shapes(theta.data(), t, g);
    double y = g[0];
    for (size_t j = 0; j < law.linear.size(); ++j) {
      y += theta[static_cast<Eigen::Index>(law.nonlinear.size() + j)] * g[1 + j];
    }
    outputs.push_back(y);
  }
  return outputs;
}

void Whiten(const std::vector<double>& time_s, double time_constant_s,
            std::vector<double>& values) {
  if (time_constant_s <= 0) return;
  for (size_t k = values.size(); k-- > 1;) {
    const double a = std::exp((time_s[k - 1] - time_s[k]) / time_constant_s);
    values[k] = (values[k] - a * values[k - 1]) / std::sqrt(1 - a * a);
  }
}

Vector SafeSteps(const SmallProblem& small) {
  Random random(1);  // always the same draws, so that more noise only makes the steps larger
  const std::vector<double>& time_s = small.record.time_s;
  const auto count = static_cast<Eigen::Index>(small.law.nonlinear.size());
  Vector steepest = Vector::Zero(count);
  for (int draw = 0; draw <= kDraws; ++draw) {
    const Vector theta = draw == 0 ? small.truth : DrawUnknowns(small, random);
    std::vector<double> base = Outputs(small.law, theta, time_s);
    Whiten(time_s, small.time_constant_s, base);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Density& density = small.law.nonlinear[static_cast<size_t>(i)].density;
      const double step = 1e-5 * (density.upper() - density.lower());
      // The coordinate of θ, which ToParameter inverts, moves by `step`.
      Vector moved = theta;
      const bool logarithm = density.ToParameter(1) != 1;
      moved[i] = logarithm ? theta[i] * std::exp(step) : theta[i] + step;
      std::vector<double> other = Outputs(small.law, moved, time_s);
      Whiten(time_s, small.time_constant_s, other);
      double sum = 0;
      for (size_t k = 0; k < base.size(); ++k) sum += std::pow(other[k] - base[k], 2);
      steepest[i] = std::max(steepest[i], std::sqrt(sum) / step / small.sigma);
    }
  }
  return steepest.cwiseMax(1e-300).cwiseInverse();
}

double NodesOf(const SmallProblem& small, const Vector& steps) {
  double nodes = 1;
  for (Eigen::Index i = 0; i < steps.size(); ++i) {
    const Density& density = small.law.nonlinear[static_cast<size_t>(i)].density;
    nodes *= std::max(1.0, (density.upper() - density.lower()) / steps[i]);
  }
  return nodes;
}

SmallProblem DrawProblem(uint64_t seed) {
  Random random(seed);
  SmallProblem small;
  small.law = DrawLaw(random);
  const auto model = MakeEquationModel(small.law.equations);
  POLYEST_CHECK(model.ok());
  small.problem.model = *model;
  SetPriors(small, random);
  small.record.time_s = DrawTimes(random, small.law.until_s);
  small.truth = DrawUnknowns(small, random);
  if (!small.law.linear.empty() && random.Chance(0.15)) {
    const auto j = static_cast<Eigen::Index>(small.law.nonlinear.size());
    small.truth[j] = small.law.linear[0].mean + kFarOut * small.law.linear[0].std_dev;
  }
  SetNoise(small, random);
  Measure(small, random);
  return small;
}

std::string Describe(const SmallProblem& small) {
  std::string text = small.law.name;
  for (const auto& [name, equation] : small.law.equations.states) {
    absl::StrAppendFormat(&text, "\n  d%s/dt = %s", name, equation);
  }
  for (const auto& [name, equation] : small.law.equations.outputs) {
    absl::StrAppendFormat(&text, "\n  %s = %s", name, equation);
  }
  for (size_t i = 0; i < small.problem.uncertain.size(); ++i) {
    const UncertainParameter& one = small.problem.uncertain[i];
    absl::StrAppendFormat(&text, "\n  %s: %s, location %.6g, scale %.6g, truth %.8g", one.name,
                          one.map == ParameterMap::kExponential     ? "lognormal"
                          : one.germ.family == GermFamily::kNormal  ? "normal"
                          : one.germ.family == GermFamily::kUniform ? "uniform"
                                                                    : "beta(2, 2)",
                          one.location, one.scale, small.truth[static_cast<Eigen::Index>(i)]);
  }
  for (const Correlation& pair : small.problem.correlations) {
    absl::StrAppendFormat(&text, "\n  correlation of %s and %s: %.6g", pair.first, pair.second,
                          pair.coefficient);
  }
  const std::vector<double>& time_s = small.record.time_s;
  absl::StrAppendFormat(&text, "\n  %d samples from t = %.6g to %.6g s, noise %.4g%s",
                        time_s.size(), time_s.front(), time_s.back(), small.sigma,
                        small.sigma_unknown ? ", unknown" : "");
  if (small.time_constant_s > 0) {
    absl::StrAppendFormat(&text, ", correlated over %.4g s", small.time_constant_s);
  }
  return text;
}

}  // namespace polyest::internal::properties
