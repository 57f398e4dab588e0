#include "core/estimator/posterior/mixture_share.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/differential_evolution.h"
#include "core/bayes/evidence.h"

namespace polyest::internal {
namespace {

// Returns c_k.
double Height(const RegionalExpansion& expansion, const Cost& cost) {
  const Agreement agreement = AgreementWithModel(expansion, cost);
  if (!agreement.mean_difference) return expansion.LogNormalization(/*with_own_error=*/true);
  return *agreement.mean_difference + expansion.LogNormalization(/*with_own_error=*/false);
}

Matrix GermsOf(const PosteriorDraws& draws, const Prior& prior) {
  if (!prior.correlated()) return draws.scores;
  Matrix xis(draws.scores.rows(), draws.scores.cols());
  for (Eigen::Index i = 0; i < xis.rows(); ++i) {
    xis.row(i) = prior.OfScores(draws.scores.row(i).transpose()).transpose();
  }
  return xis;
}

void KeepOwned(const std::vector<bool>& owned, double share, PosteriorDraws& draws) {
  Eigen::Index kept = 0;
  for (size_t i = 0; i < owned.size(); ++i) {
    if (!owned[i]) continue;
    draws.scores.row(kept) = draws.scores.row(static_cast<Eigen::Index>(i)).eval();
    draws.weights[kept++] = draws.weights[static_cast<Eigen::Index>(i)];
  }
  draws.scores.conservativeResize(kept, draws.scores.cols());
  draws.weights.conservativeResize(kept);
  draws.weights /= draws.weights.sum();
  draws.effective_size *= share;
}

void KeepOwnMinima(const MixturePartition& partition, size_t component, const Region& region,
                   std::vector<Minimum>& minima) {
  Matrix points(static_cast<Eigen::Index>(minima.size()), region.dimension());
  for (size_t i = 0; i < minima.size(); ++i) {
    points.row(static_cast<Eigen::Index>(i)) = minima[i].point.transpose();
  }
  const std::vector<bool> owned = partition.Owned(component, region.ManyToGerm(points));
  if (std::ranges::count(owned, true) == 0) return;
  size_t i = 0;
  std::erase_if(minima, [&](const Minimum&) { return !owned[i++]; });
}

}  // namespace

MixturePartition::MixturePartition(const std::vector<const ExpansionDesign*>& designs) {
  for (const ExpansionDesign* design : designs) regions_.push_back(TrustedRegion(*design));
}

std::vector<bool> MixturePartition::Owned(size_t component, const Matrix& xis) const {
  const auto distance = [&](const Region& region) -> Vector {
    return region.ManyToLocal(xis).cwiseAbs().rowwise().maxCoeff();
  };
  const Vector own = distance(regions_[component]);
  std::vector<bool> owned(static_cast<size_t>(xis.rows()), true);
  for (size_t k = 0; k < regions_.size(); ++k) {
    if (k == component) continue;
    const Vector other = distance(regions_[k]);
    for (Eigen::Index i = 0; i < xis.rows(); ++i) {
      if (other[i] < own[i] || (k < component && other[i] == own[i])) {
        owned[static_cast<size_t>(i)] = false;
      }
    }
  }
  return owned;
}

MixtureShare TakeShare(const MixturePartition& partition, size_t component,
                       const RegionalExpansion& expansion, const Cost& cost,
                       PosteriorDraws& draws) {
  const ExpansionDesign& design = expansion.design();
  const Matrix xis = GermsOf(draws, cost.prior());
  const std::vector<bool> owned = partition.Owned(component, xis);
  MixtureShare share;
  share.owned = 0;
  Vector own_weights = draws.weights;
  for (size_t i = 0; i < owned.size(); ++i) {
    double& weight = own_weights[static_cast<Eigen::Index>(i)];
    if (!owned[i]) weight = 0;
    share.owned += weight;
  }
  share.height = Height(expansion, cost);
  share.log_evidence = -kInfinity;
  if (!(share.owned > 0)) return share;
  Vector lower, upper;
  SamplingBox(design, lower, upper);
  const DifferentialEvolution box(cost, lower, upper, 0);
  const auto density = [&](const Matrix& etas, Vector& values) {
    box.Evaluate(etas, values);
    values = -values;
    const std::vector<bool> mine = partition.Owned(component, design.region.ManyToGerm(etas));
    for (size_t i = 0; i < mine.size(); ++i) {
      if (!mine[i]) values[static_cast<Eigen::Index>(i)] = -kInfinity;
    }
  };
  // ∫ e^{−J} dξ = |det axes| ∫ e^{−J} dη
  share.log_evidence = LogEvidence(density, design.region.ManyToLocal(xis), own_weights) +
                       std::log(design.region.Volume()) - share.height;
  KeepOwned(owned, share.owned, draws);
  KeepOwnMinima(partition, component, design.region, draws.minima);
  return share;
}

std::vector<double> WeightsOf(const std::vector<double>& log_evidence) {
  const double heaviest = *std::ranges::max_element(log_evidence);
  std::vector<double> weights;
  double sum = 0;
  for (const double one : log_evidence) {
    weights.push_back(std::isfinite(heaviest) ? std::exp(one - heaviest) : 1);
    sum += weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

}  // namespace polyest::internal
