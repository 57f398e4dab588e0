#include "core/estimator/expansion/control_trajectories.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr double kControlWeight = 1e-3;   // that counts, relative to the heaviest check point
constexpr double kMinEigenvalue = 1e-14;  // relative to the largest

double ShiftAt(const RegionalExpansion& expansion, const Cost& cost, int control) {
  const ExpansionDesign& design = expansion.design();
  const Vector eta = design.check_points.row(control).transpose();
  Vector phi(design.basis->size());
  Matrix slope(design.basis->size(), eta.size());  // ∂φ
  design.basis->EvaluateWithGradient(eta, phi, slope);
  const Vector d = cost.BasisDifference(eta);
  // The prior's precision in local coordinates: ξ = centre + axes η.
  const Matrix axes =
      cost.prior().GermStandardDeviation().cwiseInverse().asDiagonal() * design.region.axes();
  Matrix hessian = axes.transpose() * axes;
  Vector score = Vector::Zero(eta.size());
  for (int c = 0; c < static_cast<int>(expansion.sums().size()); ++c) {
    const ChannelSums& sums = expansion.sums()[static_cast<size_t>(c)];
    const double weight = cost.power() * sums.Weight(d);
    hessian += weight * (slope.transpose() * (sums.samples.G() * slope));
    score += weight * (slope.transpose() * expansion.ControlScore(control, c));
  }
  if (!hessian.allFinite() || !score.allFinite()) return 0;
  // √(sᵀ H⁻¹ s)
  const SymmetricEigen eigen = DecomposeSymmetric(hessian);
  const double least = kMinEigenvalue * eigen.values.maxCoeff();
  return (eigen.vectors.transpose() * score)
      .cwiseQuotient(eigen.values.cwiseMax(least).cwiseSqrt())
      .norm();
}

}  // namespace

double IntegrationShift(const RegionalExpansion& expansion, const Cost& cost) {
  const ExpansionDesign& design = expansion.design();
  std::vector<double> log_weights, shifts;
  for (int i = 0; i < expansion.controls(); ++i) {
    if (!expansion.IsControlValid(i)) continue;
    const double total = cost.Evaluate(design.check_points.row(i).transpose()).total;
    if (!std::isfinite(total)) continue;
    log_weights.push_back(design.check_costs[i] - total);
    shifts.push_back(ShiftAt(expansion, cost, i));
  }
  if (shifts.empty()) return 0;
  const double heaviest = *std::max_element(log_weights.begin(), log_weights.end());
  double largest = 0;
  for (size_t i = 0; i < shifts.size(); ++i) {
    if (std::exp(log_weights[i] - heaviest) > kControlWeight) {
      largest = std::max(largest, shifts[i]);
    }
  }
  return largest;
}

// Compares the check points' own trajectories with the expansion at one sample.
void RegionalExpansion::Compare(const WeightedSample& sample) {
  for (int i = 0; i < trajectories_.checks(); ++i) {
    if (!absorbed_.check_valid[static_cast<size_t>(i)]) continue;
    const double y = block_.outputs(points() + i, sample.column);
    if (!std::isfinite(y)) {
      absorbed_.check_valid[static_cast<size_t>(i)] = false;
      continue;
    }
    const double error = sample.value - y;
    const double difference = y - block_.check_predictions(i, sample.column);
    absorbed_.check_chi_squared(i, sample.channel) += error * error / sample.noise;
    absorbed_.check_residual[i] += difference * difference / sample.noise;
  }
}

RegionalExpansion::Check RegionalExpansion::Checks() const {
  const double samples = std::max<double>(1, static_cast<double>(absorbed_.sample_count));
  const Vector& residual = absorbed_.few ? absorbed_.few->check_residual : absorbed_.check_residual;
  return {absorbed_.CheckChiSquared(), (residual / samples).cwiseSqrt(), absorbed_.check_valid,
          absorbed_.sample_count};
}

// Adds c_k δ_k/R_k of one sample.
void RegionalExpansion::CompareControls(const WeightedSample& sample) {
  const auto outputs = block_.outputs.col(sample.column);
  const int first = points() + trajectories_.checks();
  for (int i = 0; i < controls(); ++i) {
    const double difference = outputs[first + i] - outputs[points() + i];
    if (!std::isfinite(difference)) {
      absorbed_.control_valid[static_cast<size_t>(i)] = false;
      continue;
    }
    absorbed_.control_scores.col(i * channels_ + sample.channel) +=
        (difference / sample.variance()) * CoefficientsOf(sample);
  }
}

}  // namespace polyest::internal
