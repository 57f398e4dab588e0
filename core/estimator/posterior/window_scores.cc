#include "core/estimator/posterior/window_scores.h"

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

// Returns by how much the residuals of each group of channels are to be weighed more: N/χ² for a
// channel with a learned scale, 1 for all others.
std::vector<double> GroupWeights(const std::vector<ChannelSums>& sums, const Vector& difference) {
  std::vector<double> weights;
  bool any_known = false;
  for (const ChannelSums& channel : sums) {
    if (!channel.scale_unknown) {
      any_known = true;
      continue;
    }
    const double chi_squared = channel.samples.ChiSquared(difference);
    weights.push_back(chi_squared > 0 ? channel.Degrees() / chi_squared : 1);
  }
  if (any_known) weights.insert(weights.begin(), 1.0);
  return weights;
}

// Computes the score and information of all rows up to the end of a window, in local coordinates.
class ScoreOfTotals {
 public:
  ScoreOfTotals(const RegionalExpansion& expansion, const Vector& eta) : expansion_(expansion) {
    const ExpansionDesign& design = expansion.design();
    const int terms = design.basis->size();
    Vector phi(terms), reference_phi(terms);
    gradient_.resize(terms, eta.size());
    design.basis->EvaluateWithGradient(eta, phi, gradient_);
    design.basis->Evaluate(design.reference, reference_phi);
    difference_ = phi - reference_phi;
    weights_ = GroupWeights(expansion.sums(), difference_);
  }

  WindowScore At(int window) const {
    const Eigen::Index n = gradient_.cols();
    WindowScore score{expansion_.windows().span(window), Vector::Zero(n), Matrix::Zero(n, n)};
    const auto totals = expansion_.windows().TotalsAt(window, expansion_.sums());
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
  const RegionalExpansion& expansion_;
  Matrix gradient_;    // ∂φ/∂η, S × n
  Vector difference_;  // φ(η) − φ_0
  std::vector<double> weights_;
};

// Returns ∂η/∂s.
Matrix LocalByScaled(const Region& region, const Prior& prior) {
  const Vector unit = prior.GermStandardDeviation();
  const Matrix by_germ = Inverse(region.axes());
  if (!prior.correlated()) return by_germ * unit.asDiagonal();
  return by_germ * Inverse(prior.factor()) * unit.asDiagonal();
}

}  // namespace

std::vector<WindowScore> ScoresByWindow(const RegionalExpansion& expansion, const Prior& prior,
                                        const Vector& eta) {
  const ScoreOfTotals totals(expansion, eta);
  const Matrix to_local = LocalByScaled(expansion.design().region, prior);
  std::vector<WindowScore> windows;
  Vector score_before = Vector::Zero(eta.size());
  Matrix information_before = Matrix::Zero(eta.size(), eta.size());
  for (int w = 0; w < expansion.windows().count(); ++w) {
    WindowScore window = totals.At(w);
    std::swap(score_before, window.score);
    std::swap(information_before, window.information);
    window.score = to_local.transpose() * (score_before - window.score);
    window.information =
        to_local.transpose() * (information_before - window.information) * to_local;
    if (!windows.empty() && 2 * window.span.rows < windows.back().span.rows) {
      Append(window, windows.back());
    } else {
      windows.push_back(std::move(window));
    }
  }
  return windows;
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
