#include "core/estimator/posterior/mixture_share.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/differential_evolution.h"
#include "core/bayes/evidence.h"

namespace polyest::internal {

double HeightOf(const RegionalExpansion& expansion, const Cost& cost) {
  const Agreement agreement = AgreementWithModel(expansion, cost);
  if (!agreement.mean_difference)
    return expansion.absorbed().LogNormalization(/*with_own_error=*/true);
  return *agreement.mean_difference +
         expansion.absorbed().LogNormalization(/*with_own_error=*/false);
}

MixtureShare ShareOf(const RegionalExpansion& expansion, const Cost& cost,
                     const PosteriorDraws& draws) {
  const ExpansionDesign& design = expansion.design();
  MixtureShare share;
  share.height = HeightOf(expansion, cost);
  share.log_evidence = -kInfinity;
  if (draws.weights.size() == 0) return share;
  Vector lower, upper;
  SamplingBox(design, lower, upper);
  const DifferentialEvolution box(cost, lower, upper, 0);
  const auto density = [&](const Matrix& etas, Vector& values) {
    box.Evaluate(etas, values);
    values = -values;
  };
  // ∫ e^{−J} dξ = |det axes| ∫ e^{−J} dη
  share.log_evidence =
      LogEvidence(density, design.region.ManyToLocal(draws.Germs(cost.prior())), draws.weights) +
      design.region.LogVolume() - share.height;
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
