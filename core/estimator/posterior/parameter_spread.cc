#include "core/estimator/posterior/parameter_spread.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/curvature.h"
#include "core/bayes/identifiability.h"
#include "core/bayes/weighted_samples.h"

namespace polyest::internal {
namespace {

// Returns the ratio of posterior to prior standard deviation of the scores that is due to the
// data. It is the larger of two values. The first comes from the curvature with the prior at its
// own weight, whatever α² is: a heavy prior narrows the posterior, but that is not information.
// The second comes from
//   (H_mismatch + Σ_prior⁻¹)⁻¹,
// in which the sharp mode of a skewed prior does not count as information either.
Vector ContractionByData(const MinimumCurvature& minimum, const Prior& prior) {
  Matrix curved = minimum.information;
  curved.diagonal() += prior.Curvature(minimum.xi);
  Matrix spread = minimum.information;
  spread.diagonal() += prior.GermStandardDeviation().cwiseAbs2().cwiseInverse();
  return CovarianceFromCurvature(curved, prior, minimum.xi)
      .contraction.cwiseMax(CovarianceFromCurvature(spread, prior, minimum.xi).contraction);
}

// Replaces standard deviations and contractions that contradict the draws. The cost may be flat at
// its minimum, where the data tell a limit and no more, or so uneven that the curvature there means
// nothing. Without curvature a parameter is not called identified.
void GoByDraws(const PosteriorDraws& draws, const Prior& prior, ParameterSpread& spread) {
  spread.drawn_to_curvature = Vector::Zero(prior.dimension());
  const Vector prior_deviation = prior.StandardDeviation();
  for (int i = 0; i < prior.dimension(); ++i) {
    const double drawn = std::min(
        WeightedStandardDeviation(draws.Parameter(prior, i), draws.weights), prior_deviation[i]);
    const double ratio = drawn / spread.deviation[i];
    if (!Contradicts(ratio)) continue;
    const double contraction =
        std::min(1.0, WeightedStandardDeviation(draws.scores.col(i), draws.weights) /
                          prior.GermStandardDeviation()[i]);
    const bool flat = VerdictOfContraction(spread.informed[i]) == Verdict::kNotIdentified;
    const double least = flat ? std::nextafter(kIdentifiedContraction, 1) : 0;
    spread.informed[i] = std::max(contraction, least);
    spread.drawn_to_curvature[i] = ratio;
    spread.deviation[i] = drawn;
  }
}

}  // namespace

ParameterSpread SpreadOfParameters(const MinimumCurvature& minimum, const Prior& prior,
                                   const SpreadWidening& widening, const PosteriorDraws* draws) {
  const Curvature curvature = CovarianceFromCurvature(minimum.hessian, prior, minimum.xi);
  const Vector prior_deviation = prior.StandardDeviation();
  ParameterSpread spread;
  spread.contraction = curvature.contraction;
  spread.informed = widening.all.cwiseProduct(ContractionByData(minimum, prior)).cwiseMin(1);
  spread.deviation =
      widening.all.cwiseProduct(curvature.standard_deviation).cwiseMin(prior_deviation);
  if (draws != nullptr) GoByDraws(*draws, prior, spread);
  for (int i = 0; i < prior.dimension(); ++i) {
    const bool identified = VerdictOfContraction(spread.informed[i]) != Verdict::kNotIdentified;
    if (prior.IsCurved(i) && !identified) spread.deviation[i] = prior_deviation[i];
  }
  const Vector factor = spread.deviation.cwiseQuotient(curvature.standard_deviation);
  spread.covariance = factor.asDiagonal() * curvature.covariance * factor.asDiagonal();
  spread.robust_deviation = Vector::Zero(prior.dimension());
  if (widening.robust_ratio.size() > 0) {
    spread.robust_deviation =
        (widening.shift * widening.robust_ratio.cwiseProduct(curvature.standard_deviation))
            .cwiseMin(prior_deviation);
  }
  return spread;
}

void WidenContradicted(const Vector& factors, const Vector& contraction, const Prior& prior,
                       PosteriorDraws& draws) {
  Vector wider = factors;
  for (int i = 0; i < prior.dimension(); ++i) {
    const double present = WeightedStandardDeviation(draws.scores.col(i), draws.weights);
    if (!(present > 0) || !(factors[i] > 1)) continue;
    const double most = prior.GermStandardDeviation()[i] / present;
    const double curved = contraction[i] * most;
    wider[i] = std::min(factors[i] * std::max(1.0, curved), std::max(1.0, most));
  }
  Widen(wider, prior, draws);
}

}  // namespace polyest::internal
