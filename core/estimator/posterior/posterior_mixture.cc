#include "core/estimator/posterior/posterior_mixture.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/bayes/identifiability.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Effort for weights that only decide which components to continue with.
constexpr PosteriorEffort kWeighingEffort = {
    .importance_points = 4'096, .chain_effective_size = 2'000, .max_sweeps = 64};

// The expansion of a lighter component has no noticeable effect.
constexpr double kMinWeightToWarn = 0.01;

MixturePartition PartitionOf(const std::vector<AssessmentRequest>& requests,
                             const std::vector<size_t>& kept) {
  std::vector<const ExpansionDesign*> designs;
  for (const size_t k : kept) designs.push_back(&requests[k].expansion->design());
  return MixturePartition(designs);
}

// Draws from all components, and computes their shares among any subset of them.
class Weighing {
 public:
  explicit Weighing(const std::vector<AssessmentRequest>& requests) : requests_(requests) {}

  absl::StatusOr<MixtureWeighing> Run(const Stop& stop) {
    for (const AssessmentRequest& request : requests_) {
      costs_.push_back(request.expansion->MakeCost(request.problem->problem().regularization));
      POLYEST_ASSIGN_OR_RETURN(PosteriorDraws draws,
                               DrawPosterior(costs_.back(), request.expansion->design(),
                                             *request.guesses, kWeighingEffort, stop));
      draws_.push_back(std::move(draws));
    }
    weighing_.kept.resize(requests_.size());
    std::iota(weighing_.kept.begin(), weighing_.kept.end(), size_t{0});
    Share();
    while (DropMet()) Share();
    weighing_.weights = WeightsOf(Evidences());
    DropLight();
    DropPastRoom();
    const double all = std::accumulate(weighing_.weights.begin(), weighing_.weights.end(), 0.0);
    for (double& weight : weighing_.weights) weight /= all;
    return std::move(weighing_);
  }

 private:
  void Share() {
    const MixturePartition partition = PartitionOf(requests_, weighing_.kept);
    shares_.clear();
    for (size_t i = 0; i < weighing_.kept.size(); ++i) {
      const size_t k = weighing_.kept[i];
      PosteriorDraws draws = draws_[k];
      shares_.push_back(TakeShare(partition, i, *requests_[k].expansion, costs_[k], draws));
    }
  }

  // Drops the component that owns the smallest share of its draws, if that share is too small.
  // Returns whether one was dropped.
  bool DropMet() {
    const auto least = std::ranges::min_element(shares_, {}, &MixtureShare::owned);
    if (shares_.size() == 1 || least->owned >= kMinOwned) return false;
    weighing_.kept.erase(weighing_.kept.begin() + (least - shares_.begin()));
    return true;
  }

  std::vector<double> Evidences() const {
    std::vector<double> evidences;
    for (const MixtureShare& share : shares_) evidences.push_back(share.log_evidence);
    return evidences;
  }

  void Drop(size_t i) {
    weighing_.kept.erase(weighing_.kept.begin() + static_cast<std::ptrdiff_t>(i));
    weighing_.weights.erase(weighing_.weights.begin() + static_cast<std::ptrdiff_t>(i));
  }

  void DropLight() {
    for (size_t i = weighing_.weights.size(); i-- > 0;) {
      if (weighing_.weights[i] < kMinWeight) Drop(i);
    }
  }

  void DropPastRoom() {
    while (weighing_.kept.size() > kMaxComponents) {
      const auto lightest = std::ranges::min_element(weighing_.weights);
      weighing_.left_out += *lightest;
      Drop(static_cast<size_t>(lightest - weighing_.weights.begin()));
    }
  }

  const std::vector<AssessmentRequest>& requests_;
  std::vector<Cost> costs_;
  std::vector<PosteriorDraws> draws_;
  std::vector<MixtureShare> shares_;  // of the components kept
  MixtureWeighing weighing_;
};

// Returns the draws of all components in their order, heaviest first.
PosteriorDraws Mix(const std::vector<Assessed>& components, const std::vector<double>& weights) {
  PosteriorDraws mixture;
  Eigen::Index count = 0;
  for (const Assessed& one : components) count += one.posterior.weights.size();
  const Eigen::Index n = components.front().posterior.scores.cols();
  mixture.scores.resize(count, n);
  mixture.weights.resize(count);
  mixture.method = PosteriorMethod::kImportanceSampling;
  mixture.minima = components.front().posterior.minima;
  Vector inverse = Vector::Zero(n);
  Eigen::Index row = 0;
  for (size_t k = 0; k < components.size(); ++k) {
    const PosteriorDraws& draws = components[k].posterior;
    mixture.scores.middleRows(row, draws.weights.size()) = draws.scores;
    mixture.weights.segment(row, draws.weights.size()) = weights[k] * draws.weights;
    row += draws.weights.size();
    // Var(Σ w_k m_k) = Σ w_k² s²/N_k
    inverse += weights[k] * weights[k] * draws.effective_size.cwiseInverse();
    if (draws.method == PosteriorMethod::kMarkovChains) mixture.method = draws.method;
    if (draws.r_hat.size() == 0) continue;
    mixture.r_hat =
        mixture.r_hat.size() == 0 ? draws.r_hat : Vector(mixture.r_hat.cwiseMax(draws.r_hat));
  }
  mixture.effective_size = inverse.cwiseInverse();
  return mixture;
}

void DescribeWhole(const Prior& prior, const PosteriorDraws& posterior, Estimate& estimate) {
  for (int i = 0; i < prior.dimension(); ++i) {
    ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    DescribeMarginal(posterior, prior, i, parameter);
    const double contraction = std::min(1.0, parameter.posterior_std_dev / parameter.prior_std_dev);
    if (parameter.verdict == Verdict::kIdentified &&
        VerdictOfContraction(contraction) != Verdict::kIdentified) {
      parameter.verdict = Verdict::kWeak;
    }
  }
}

Assessed Combine(const std::vector<Assessed>& components, const std::vector<double>& weights,
                 const Prior& prior) {
  const Assessed& heaviest = components.front();
  Assessed whole;
  whole.estimate = heaviest.estimate;
  whole.findings = heaviest.findings;
  ExpansionSummary& expansion = whole.estimate.expansion;
  for (size_t k = 0; k < components.size(); ++k) {
    const Estimate& one = components[k].estimate;
    if (components.size() > 1) whole.estimate.components.push_back({weights[k], one.parameters});
    if (weights[k] < kMinWeightToWarn) continue;
    expansion.residual_to_noise =
        std::max(expansion.residual_to_noise, one.expansion.residual_to_noise);
    whole.findings.shift = std::max(whole.findings.shift, components[k].findings.shift);
  }
  whole.posterior = Mix(components, weights);
  DescribeWhole(prior, whole.posterior, whole.estimate);
  return whole;
}

// Assesses all components with a partition among them.
absl::StatusOr<std::vector<Assessed>> AssessAll(std::vector<AssessmentRequest>& requests,
                                                const MixturePartition& partition,
                                                const Stop& stop) {
  std::vector<Assessed> components;
  for (size_t k = 0; k < requests.size(); ++k) {
    requests[k].partition = &partition;
    requests[k].component = k;
    // All components use the α² of the first.
    if (k > 0) requests[k].regularization = components.front().estimate.regularization;
    POLYEST_ASSIGN_OR_RETURN(Assessed assessed, Assess(requests[k], stop));
    if (k > 0) {
      assessed.findings.regularization_not_determined =
          components.front().findings.regularization_not_determined;
    }
    components.push_back(std::move(assessed));
  }
  return components;
}

std::vector<double> WeightsNow(const std::vector<AssessmentRequest>& requests,
                               const std::vector<Assessed>& components) {
  std::vector<double> evidences, last;
  bool level = true;
  for (size_t k = 0; k < requests.size(); ++k) {
    level = level && requests[k].record->rows() == requests.front().record->rows();
    evidences.push_back(components[k].share.log_evidence);
    last.push_back(requests[k].last_weight);
  }
  return level ? WeightsOf(evidences) : last;
}

// A stop may have left some components before a run with its own parameters and others in it. Then
// only those with the fewest parameters are kept. Returns the indices of those kept.
std::vector<size_t> KeepSameProblem(std::vector<AssessmentRequest>& requests) {
  std::vector<size_t> places(requests.size());
  std::iota(places.begin(), places.end(), size_t{0});
  const auto dimension = [](const AssessmentRequest& request) {
    return request.problem->dimension();
  };
  const int least = dimension(std::ranges::min(requests, {}, dimension));
  std::erase_if(places, [&](size_t k) { return dimension(requests[k]) > least; });
  std::erase_if(requests, [&](const AssessmentRequest& one) { return dimension(one) > least; });
  return places;
}

}  // namespace

absl::StatusOr<MixtureWeighing> WeighMixture(const std::vector<AssessmentRequest>& requests,
                                             const Stop& stop) {
  return Weighing(requests).Run(stop);
}

absl::StatusOr<AssessedMixture> AssessMixture(std::vector<AssessmentRequest> requests,
                                              double left_out, const Stop& stop) {
  AssessedMixture mixture;
  const std::vector<size_t> places = KeepSameProblem(requests);
  if (requests.size() == 1) {
    mixture.order = places;
    POLYEST_ASSIGN_OR_RETURN(mixture.whole, Assess(requests.front(), stop));
    return mixture;
  }
  mixture.order.resize(requests.size());
  std::iota(mixture.order.begin(), mixture.order.end(), size_t{0});
  const MixturePartition partition = PartitionOf(requests, mixture.order);
  POLYEST_ASSIGN_OR_RETURN(std::vector<Assessed> assessed, AssessAll(requests, partition, stop));
  const std::vector<double> weights = WeightsNow(requests, assessed);
  std::ranges::stable_sort(mixture.order,
                           [&](size_t a, size_t b) { return weights[a] > weights[b]; });
  int reexpansions = 0;
  int64_t trajectories = 0;
  for (const Assessed& one : assessed) {
    reexpansions += one.estimate.expansion.reexpansions;
    trajectories += one.estimate.expansion.trajectories;
  }
  std::erase_if(mixture.order, [&](size_t k) { return weights[k] < kMinWeight; });
  std::vector<double> in_order;
  for (size_t& k : mixture.order) {
    in_order.push_back(weights[k]);
    mixture.components.push_back(std::move(assessed[k]));
    k = places[k];
  }
  mixture.whole = Combine(mixture.components, in_order, requests.front().problem->prior());
  mixture.whole.estimate.expansion.reexpansions = reexpansions;
  mixture.whole.estimate.expansion.trajectories = trajectories;
  mixture.whole.findings.left_out = left_out;
  mixture.whole.estimate.diagnostics = Diagnose(mixture.whole.findings, mixture.whole.estimate);
  return mixture;
}

}  // namespace polyest::internal
