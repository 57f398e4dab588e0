#include "core/estimator/posterior/window_scores.h"

#include <algorithm>
#include <utility>

#include "core/common/check.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

void Append(const WindowScore& next, WindowScore& window) {
  window.span.rows += next.span.rows;
  window.span.last_run = next.span.last_run;
  window.span.end_s = next.span.end_s;
  window.score += next.score;
  window.information += next.information;
}

// Returns the weight of each group of channels (WindowSums::TotalsAt).
std::vector<double> GroupWeights(const std::vector<ChannelSums>& sums, const Vector& difference) {
  std::vector<double> weights;
  bool any_known = false;
  for (const ChannelSums& channel : sums) {
    if (channel.scale_unknown) {
      weights.push_back(channel.Weight(difference));
    } else {
      any_known = true;
    }
  }
  if (any_known) weights.insert(weights.begin(), 1.0);
  return weights;
}

// Computes the score and information of all rows up to the end of a window, in local coordinates.
class ScoreOfTotals {
 public:
  ScoreOfTotals(const WindowSums& windows, const std::vector<ChannelSums>& sums, const Basis& basis,
                const Vector& reference, const Vector& eta)
      : windows_(windows), sums_(sums) {
    Vector phi(basis.size()), reference_phi(basis.size());
    gradient_.resize(basis.size(), eta.size());
    basis.EvaluateWithGradient(eta, phi, gradient_);
    basis.Evaluate(reference, reference_phi);
    difference_ = phi - reference_phi;
    weights_ = GroupWeights(sums, difference_);
  }

  WindowScore At(int window) const {
    const Eigen::Index n = gradient_.cols();
    WindowScore score{windows_.span(window), Vector::Zero(n), Matrix::Zero(n, n)};
    const auto totals = windows_.TotalsAt(window, sums_);
    POLYEST_CHECK(totals.size() == weights_.size());
    for (size_t k = 0; k < totals.size(); ++k) {
      const Matrix g = WindowSums::Unpack(totals[k].g, static_cast<int>(difference_.size()));
      // ∂φᵀ (G d − b) and ∂φᵀ G ∂φ
      score.score += weights_[k] * (gradient_.transpose() * (g * difference_ - totals[k].b));
      score.information += weights_[k] * (gradient_.transpose() * (g * gradient_));
    }
    return score;
  }

 private:
  const WindowSums& windows_;
  const std::vector<ChannelSums>& sums_;
  Matrix gradient_;    // ∂φ/∂η, S × n
  Vector difference_;  // φ(η) − φ_0
  std::vector<double> weights_;
};

// Returns ∂ξ/∂s.
Matrix GermByScaled(const Prior& prior) {
  const Vector unit = prior.GermStandardDeviation();
  if (!prior.correlated()) return unit.asDiagonal();
  return Inverse(prior.factor()) * unit.asDiagonal();
}

// Returns the scores of windows in the coordinates s from those of all rows up to the end of each,
// in local coordinates η; `by_scaled` is ∂η/∂s.
std::vector<WindowScore> Differences(const std::vector<WindowScore>& totals,
                                     const Matrix& by_scaled) {
  std::vector<WindowScore> windows;
  Vector score_before = Vector::Zero(by_scaled.rows());
  Matrix information_before = Matrix::Zero(by_scaled.rows(), by_scaled.rows());
  for (const WindowScore& total : totals) {
    WindowScore window = total;
    window.score = by_scaled.transpose() * (total.score - score_before);
    window.information =
        by_scaled.transpose() * (total.information - information_before) * by_scaled;
    score_before = total.score;
    information_before = total.information;
    if (!windows.empty() && 2 * window.span.rows < windows.back().span.rows) {
      Append(window, windows.back());
    } else {
      windows.push_back(std::move(window));
    }
  }
  return windows;
}

}  // namespace

std::vector<WindowScore> ScoresByWindow(const RegionalExpansion& expansion, const Prior& prior,
                                        const Vector& eta) {
  const ExpansionDesign& design = expansion.design();
  const ScoreOfTotals scores(expansion.windows(), expansion.sums(), *design.basis, design.reference,
                             eta);
  std::vector<WindowScore> totals;
  for (int w = 0; w < expansion.windows().count(); ++w) totals.push_back(scores.At(w));
  return Differences(totals, Inverse(design.region.axes()) * GermByScaled(prior));
}

std::vector<WindowScore> ScoresByEndedRuns(const ResolvedProblem& problem, const Vector& xi) {
  const EndedRuns& ended = *problem.ended_runs();
  const std::vector<int> shared = problem.SharedParameters();
  const Vector eta = ended.region.ToLocal(xi(shared));
  const std::vector<ChannelSums> sums = SumsWithRemainder(problem.problem().measured, ended);
  const Vector centre = Vector::Zero(eta.size());
  const ScoreOfTotals scores(ended.windows, sums, *ended.basis, centre, eta);
  Vector phi(ended.basis->size());
  Matrix phi_gradient(ended.basis->size(), eta.size());
  ended.basis->EvaluateWithGradient(eta, phi, phi_gradient);
  std::vector<WindowScore> totals;
  const int64_t rows_of_run = std::max<int64_t>(1, ended.rows / std::ssize(ended.run));
  for (int w = 0; w < ended.windows.count(); ++w) {
    totals.push_back(scores.At(w));
    totals.back().span.rows *= rows_of_run;
    // ∂²E/∂η², which is what the prior of the runs' own parameters leaves of their information.
    const Vector remainder = -ended.windows.TotalsAt(w, sums).back().b;
    totals.back().information += ended.basis->WeightedHessian(eta, phi, phi_gradient, remainder);
  }
  Matrix by_germ = Matrix::Zero(eta.size(), problem.dimension());
  by_germ(Eigen::all, shared) = Inverse(ended.region.axes());
  return Differences(totals, by_germ * GermByScaled(problem.prior()));
}

std::vector<WindowScore> MergePairs(const std::vector<WindowScore>& windows) {
  std::vector<WindowScore> merged;
  for (size_t i = 0; i < windows.size(); i += 2) {
    if (i + 1 < windows.size()) {
      merged.push_back(windows[i]);
      Append(windows[i + 1], merged.back());
    } else if (!merged.empty() && 2 * windows[i].span.rows < merged.back().span.rows) {
      Append(windows[i], merged.back());
    } else {
      merged.push_back(windows[i]);
    }
  }
  return merged;
}

WindowScore SumOf(const std::vector<WindowScore>& windows) {
  POLYEST_CHECK(!windows.empty());
  WindowScore sum = windows.front();
  for (size_t i = 1; i < windows.size(); ++i) Append(windows[i], sum);
  return sum;
}

Matrix PriorPrecision(const Prior& prior) {
  const Eigen::Index n = prior.dimension();
  if (!prior.correlated()) return Matrix::Identity(n, n);
  const Vector unit = prior.GermStandardDeviation();
  // s = D⁻¹ z, z = F ξ, cov(ξ) = D²: the covariance of s is D⁻¹ F D (D⁻¹ F D)ᵀ.
  const Matrix root = unit.cwiseInverse().asDiagonal() * Matrix(prior.factor() * unit.asDiagonal());
  return Inverse(root * root.transpose());
}

}  // namespace polyest::internal
