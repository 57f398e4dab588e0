#include "core/bayes/population_cost.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/chaos/normal.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

// The germ of the spread beyond which it does not grow or shrink any more: s² stays a number,
// wherever the cost is evaluated.
constexpr double kFarthestSpread = 100;

using Components = Eigen::Array<double, Eigen::Dynamic, 1, 0, ScoreMixture::kMaxComponents, 1>;

// The derivatives of one run's f with respect to c, μ and λ = log s.
struct RunTerm {
  Eigen::Vector3d gradient;
  Eigen::Matrix3d hessian;
};

// With t = s², q = 1 − S and N the square brackets, 2f = log w + N/w − c² has the derivatives below
// with respect to c, μ and t, and those with respect to λ follow from dt/dλ = 2t.
RunTerm GaussianTerm(double c, double S, const RunScore& population) {
  const double mu = population.mean, t = population.variance;
  const double q = 1 - S, w = S + q * t;
  const double N = q * (c - mu) * (c - mu) + S * c * (2 * c - 2 * mu - t * c);
  const double N_c = 2 * q * (c - mu) + S * (4 * c - 2 * mu - 2 * t * c);
  const double N_m = -2 * q * (c - mu) - 2 * S * c;
  const double N_t = -S * c * c;
  const double f_t = (q + N_t - N * q / w) / w;
  const double f_tt = q * (-q - 2 * N_t + 2 * N * q / w) / w / w;
  const double f_cc = (2 * q + S * (4 - 2 * t)) / w - 2;
  const double f_cl = 2 * t * (-2 * S * c - N_c * q / w) / w;
  const double f_ml = -2 * t * N_m * q / w / w;
  RunTerm term;
  term.gradient << N_c / w - 2 * c, N_m / w, 2 * t * f_t;
  term.hessian << f_cc, -2 / w, f_cl,  //
      -2 / w, 2 * q / w, f_ml,         //
      f_cl, f_ml, 4 * t * (f_t + t * f_tt);
  term.gradient *= 0.5;
  term.hessian *= 0.5;
  return term;
}

Components CentresOf(double mean, const ScoreMixture& shape) {
  const Eigen::Index count = shape.log_weights.size();
  return Components::LinSpaced(count, 0, static_cast<double>(count - 1)) * shape.step +
         (mean + shape.first);
}

// Returns log w_k − f(c_k) of the components, where 2f = log w + ((1 − s²) c² − 2μc + (1 − S) μ²)/w
// is a parabola in k.
Components LogTerms(double mean, const ScoreMixture& shape, const RunScore& population) {
  const double mu = population.mean, t = population.variance;
  const double S = shape.step * shape.step, w = S + (1 - S) * t;
  const double c = mean + shape.first, h = shape.step;
  const double constant =
      -0.5 * (std::log(w) + ((1 - t) * c * c - 2 * mu * c + (1 - S) * mu * mu) / w);
  const double linear = -h * ((1 - t) * c - mu) / w, square = -0.5 * (1 - t) * h * h / w;
  const Eigen::Index count = shape.log_weights.size();
  Components terms(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto place = static_cast<double>(k);
    terms[k] = shape.log_weights[k] + constant + place * (linear + place * square);
  }
  return terms;
}

double MixtureValue(double mean, const ScoreMixture& shape, const RunScore& population) {
  const Components terms = LogTerms(mean, shape, population);
  const double greatest = terms.maxCoeff();
  return -greatest - std::log((terms - greatest).exp().sum());
}

// Returns the derivatives of F = −log Σ w_k e^{−f_k} with the shares ρ_k ∝ w_k e^{−f_k}: ∇F = Σ ρ_k
// ∇f_k and ∇²F = Σ ρ_k (∇²f_k − ∇f_k ∇f_kᵀ) + ∇F ∇Fᵀ.
RunTerm MixtureTerm(double mean, const ScoreMixture& shape, const RunScore& population) {
  const Components c = CentresOf(mean, shape);
  Components shares = LogTerms(mean, shape, population);
  shares = (shares - shares.maxCoeff()).exp();
  shares /= shares.sum();
  RunTerm result;
  result.gradient.setZero();
  result.hessian.setZero();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  const double S = shape.step * shape.step;
  // About the component with the largest share: the differences stay small where s is.
  Eigen::Index most = 0;
  shares.maxCoeff(&most);
  const Eigen::Vector3d about = GaussianTerm(c[most], S, population).gradient;
  Eigen::Vector3d mean_difference = Eigen::Vector3d::Zero();
  for (Eigen::Index k = 0; k < c.size(); ++k) {
    if (!(shares[k] > 0)) continue;
    const RunTerm term = GaussianTerm(c[k], S, population);
    const Eigen::Vector3d difference = term.gradient - about;
    mean_difference += shares[k] * difference;
    spread += shares[k] * difference * difference.transpose();
    result.hessian += shares[k] * term.hessian;
  }
  result.gradient = about + mean_difference;
  result.hessian -= spread - mean_difference * mean_difference.transpose();
  return result;
}

}  // namespace

RunScore InPopulation(const RunScore& alone, const RunScore& population) {
  const double w = alone.variance + (1 - alone.variance) * population.variance;
  return {(alone.mean * population.variance + population.mean * alone.variance) / w,
          alone.variance * population.variance / w};
}

double QuantileInPopulation(const RunScore& alone, const ScoreMixture& shape,
                            const RunScore& population, double probability) {
  constexpr double kReach = 9;
  constexpr int kBisections = 60;
  Components centres = Components::Constant(1, alone.mean), shares = Components::Ones(1);
  double variance = alone.variance;
  if (shape.log_weights.size() > 0) {
    variance = shape.step * shape.step;
    centres = CentresOf(alone.mean, shape);
    shares = LogTerms(alone.mean, shape, population);
    shares = (shares - shares.maxCoeff()).exp();
    shares /= shares.sum();
  }
  double deviation = 0;
  for (double& centre : centres) {
    const RunScore with = InPopulation({centre, variance}, population);
    centre = with.mean;
    deviation = std::sqrt(with.variance);
  }
  double lower = centres.minCoeff() - kReach * deviation;
  double upper = centres.maxCoeff() + kReach * deviation;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (lower + upper);
    double below = 0;
    for (Eigen::Index k = 0; k < centres.size(); ++k) {
      below += shares[k] * NormalCdf((middle - centres[k]) / deviation);
    }
    (below < probability ? lower : upper) = middle;
  }
  return 0.5 * (lower + upper);
}

RunScore PopulationOfGerms(double mean, double spread) {
  const double deviation = PopulationCost::kMedianSpread *
                           std::exp(PopulationCost::kLogDeviation *
                                    std::clamp(spread, -kFarthestSpread, kFarthestSpread));
  return {mean, deviation * deviation};
}

PopulationCost::PopulationCost(int mean, int spread, Vector base, Matrix slope, Vector variance,
                               std::vector<ScoreMixture> shapes)
    : mean_(mean),
      spread_(spread),
      base_(std::move(base)),
      slope_(std::move(slope)),
      variance_(std::move(variance)),
      shapes_(std::move(shapes)) {
  POLYEST_CHECK(base_.size() == slope_.rows() && base_.size() == variance_.size());
  POLYEST_CHECK(variance_.minCoeff() >= 0 && variance_.maxCoeff() <= 1);
  POLYEST_CHECK(std::ssize(shapes_) <= base_.size());
}

RunScore PopulationCost::PopulationAt(const ConstVectorRef& xi) const {
  return PopulationOfGerms(xi[mean_], xi[spread_]);
}

// Returns the shape of a run's posterior, or nothing where that counts as a Gaussian.
const ScoreMixture* PopulationCost::ShapeOf(Eigen::Index run, const RunScore& population) const {
  if (run >= std::ssize(shapes_)) return nullptr;
  if (variance_[run] < kNarrow * kNarrow * population.variance) return nullptr;
  const ScoreMixture& shape = shapes_[static_cast<size_t>(run)];
  return shape.log_weights.size() > 0 ? &shape : nullptr;
}

double PopulationCost::Evaluate(const ConstVectorRef& xi, double power) const {
  const RunScore population = PopulationAt(xi);
  const double mu = population.mean, t = population.variance;
  thread_local Vector scores;  // kept between calls, so that a sampler's sweeps do not allocate
  scores.noalias() = slope_ * xi;
  double sum = 0;
  for (Eigen::Index r = 0; r < base_.size(); ++r) {
    const double c = base_[r] + scores[r], S = variance_[r], share = PowerOf(r, power);
    if (const ScoreMixture* shape = ShapeOf(r, population)) {
      sum += 2 * share * MixtureValue(c, *shape, population);
      continue;
    }
    const double w = S + (1 - S) * t;
    const double square = (1 - S) * (c - mu) * (c - mu) + S * c * (2 * c - 2 * mu - t * c);
    sum += share * (std::log(w) + square / w - c * c);
  }
  return 0.5 * sum;
}

PopulationCost::Derivatives PopulationCost::Differentiate(const ConstVectorRef& xi,
                                                          double power) const {
  const RunScore population = PopulationAt(xi);
  const Vector scores = base_ + slope_ * xi;
  const Eigen::Index runs = base_.size();
  Vector by_c(runs), by_cc(runs), by_cm(runs), by_cl(runs);
  RunTerm sum;
  sum.gradient.setZero();
  sum.hessian.setZero();
  for (Eigen::Index r = 0; r < runs; ++r) {
    const ScoreMixture* shape = ShapeOf(r, population);
    RunTerm term = shape != nullptr ? MixtureTerm(scores[r], *shape, population)
                                    : GaussianTerm(scores[r], variance_[r], population);
    term.gradient *= PowerOf(r, power);
    term.hessian *= PowerOf(r, power);
    by_c[r] = term.gradient[0];
    by_cc[r] = term.hessian(0, 0);
    by_cm[r] = term.hessian(0, 1);
    by_cl[r] = term.hessian(0, 2);
    sum.gradient += term.gradient;
    sum.hessian += term.hessian;
  }
  Derivatives result;
  result.value = Evaluate(xi, power);
  result.gradient = slope_.transpose() * by_c;
  result.gradient[mean_] += sum.gradient[1];
  result.gradient[spread_] += kLogDeviation * sum.gradient[2];
  const Vector mixed_m = slope_.transpose() * by_cm;
  const Vector mixed_l = kLogDeviation * (slope_.transpose() * by_cl);
  Matrix& hessian = result.hessian;
  hessian = slope_.transpose() * by_cc.asDiagonal() * slope_;
  hessian.col(mean_) += mixed_m;
  hessian.row(mean_) += mixed_m.transpose();
  hessian.col(spread_) += mixed_l;
  hessian.row(spread_) += mixed_l.transpose();
  hessian(mean_, mean_) += sum.hessian(1, 1);
  hessian(mean_, spread_) += kLogDeviation * sum.hessian(1, 2);
  hessian(spread_, mean_) += kLogDeviation * sum.hessian(1, 2);
  hessian(spread_, spread_) += kLogDeviation * kLogDeviation * sum.hessian(2, 2);
  return result;
}

}  // namespace polyest::internal
