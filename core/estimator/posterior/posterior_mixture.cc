#include "core/estimator/posterior/posterior_mixture.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/posterior/component_of_estimate.h"
#include "core/estimator/posterior/connected_elements.h"
#include "core/estimator/posterior/marginal_description.h"
#include "core/estimator/posterior/mixture_weighing.h"
#include "core/estimator/posterior/model_evidence.h"
#include "core/estimator/posterior/parameter_spread.h"

namespace polyest::internal {
namespace {

// What a lighter component says has no noticeable effect.
constexpr double kMinWeightToWarn = 0.01;

using Places = std::vector<size_t>;

// Returns the draws of the components at these places, in proportion to their weights.
PosteriorDraws Mix(const std::vector<Assessed>& components, const std::vector<double>& weights,
                   const Places& places) {
  PosteriorDraws mixture;
  Eigen::Index count = 0;
  double all = 0;
  for (const size_t k : places) {
    count += components[k].posterior.weights.size();
    all += weights[k];
  }
  const Eigen::Index n = components.front().posterior.scores.cols();
  mixture.scores.resize(count, n);
  mixture.weights.resize(count);
  const bool chains = std::ranges::all_of(
      places, [&](size_t k) { return components[k].posterior.chain.size() > 0; });
  if (chains) mixture.chain.resize(count);
  mixture.method = PosteriorMethod::kImportanceSampling;
  mixture.minima = components[places.front()].posterior.minima;
  Vector inverse = Vector::Zero(n);
  Eigen::Index row = 0;
  for (const size_t k : places) {
    const PosteriorDraws& draws = components[k].posterior;
    const double weight = weights[k] / all;
    mixture.scores.middleRows(row, draws.weights.size()) = draws.scores;
    if (chains) mixture.chain.segment(row, draws.weights.size()) = draws.chain;
    mixture.weights.segment(row, draws.weights.size()) = weight * draws.weights;
    row += draws.weights.size();
    // Var(Σ w_k m_k) = Σ w_k² s²/N_k
    inverse += weight * weight * draws.effective_size.cwiseInverse();
    if (draws.method == PosteriorMethod::kMarkovChains) mixture.method = draws.method;
    if (draws.r_hat.size() == 0) continue;
    mixture.r_hat =
        mixture.r_hat.size() == 0 ? draws.r_hat : Vector(mixture.r_hat.cwiseMax(draws.r_hat));
  }
  mixture.effective_size = inverse.cwiseInverse();
  return mixture;
}

// Returns what filters know at the draws of all components, in the order of Mix; nothing if one of
// them knows nothing.
FilteredDraws MixFiltered(const std::vector<Assessed>& components) {
  FilteredDraws all;
  for (const Assessed& component : components) {
    const Matrix& mean = component.filtered.mean;
    if (mean.cols() == 0) return {};
    const Eigen::Index rows = all.mean.rows();
    all.mean.conservativeResize(rows + mean.rows(), mean.cols());
    all.deviation.conservativeResize(rows + mean.rows(), mean.cols());
    all.mean.bottomRows(mean.rows()) = mean;
    all.deviation.bottomRows(mean.rows()) = component.filtered.deviation;
  }
  return all;
}

void DescribeWhole(const Prior& prior, const PosteriorDraws& posterior, const Findings& findings,
                   Estimate& estimate) {
  for (int i = 0; i < prior.dimension(); ++i) {
    ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    DescribeMarginal(posterior, prior, i, parameter);
    DoubtIfPiecesSpread(parameter);
  }
  if (!findings.UsesData()) GoByPriorIfInaccurate(findings, prior, estimate);
}

// The curvature at the minimum is that of one component. Where it contradicts the draws of several
// that are one piece of the posterior, the draws count. Where something speaks against them, the
// wider of both counts.
void ReplaceByMixtureDraws(Findings& findings, Estimate& estimate) {
  const bool doubtful = findings.power < 1 || findings.shift > kInaccurateShift ||
                        findings.windows.contradicted || estimate.regularization != 1;
  findings.drawn_to_curvature = Vector::Zero(std::ssize(estimate.parameters));
  for (Eigen::Index i = 0; i < findings.drawn_to_curvature.size(); ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    const double drawn = std::min(parameter.posterior_std_dev, parameter.prior_std_dev);
    const double ratio = drawn / parameter.std_dev;
    if (doubtful ? ratio <= 1 : !Contradicts(ratio)) continue;
    findings.drawn_to_curvature[i] = ratio;
    ReplaceDeviation(static_cast<int>(i), drawn, estimate);
  }
}

// Returns the places of each piece's components, heaviest piece first.
std::vector<Places> PiecesOf(const std::vector<AssessmentRequest>& requests,
                             const std::vector<Assessed>& components,
                             const std::vector<double>& weights) {
  std::vector<Cost> costs;
  for (size_t k = 0; k < components.size(); ++k) {
    costs.push_back(requests[k].expansion->MakeCost(components[k].estimate.regularization));
    costs.back().set_power(CommonPower(requests));
  }
  std::vector<ElementCost> elements;
  for (size_t k = 0; k < components.size(); ++k) {
    elements.push_back({&requests[k].expansion->design(), &costs[k], components[k].share.height,
                        components[k].posterior.minima.front()});
  }
  const std::vector<size_t> numbers = ConnectedPieces(elements);
  std::vector<Places> pieces(std::ranges::max(numbers) + 1);
  for (size_t k = 0; k < numbers.size(); ++k) pieces[numbers[k]].push_back(k);
  const auto weight = [&](const Places& places) {
    return std::accumulate(places.begin(), places.end(), 0.0,
                           [&](double sum, size_t k) { return sum + weights[k]; });
  };
  std::ranges::stable_sort(pieces,
                           [&](const Places& a, const Places& b) { return weight(a) > weight(b); });
  return pieces;
}

// Returns the place of the component that the piece's estimate is of.
size_t BestOf(const std::vector<Assessed>& components, const std::vector<double>& weights,
              const Places& places) {
  std::vector<PieceComponent> candidates;
  for (const size_t k : places) {
    candidates.push_back({.cost = components[k].estimate.cost.total + components[k].share.height,
                          .shift = components[k].findings.shift,
                          .weight = weights[k]});
  }
  return places[ComponentOfEstimate(candidates)];
}

ComponentEstimate DescribePiece(const std::vector<Assessed>& components,
                                const std::vector<double>& weights, const Places& places,
                                const Prior& prior) {
  ComponentEstimate piece;
  for (const size_t k : places) piece.weight += weights[k];
  piece.parameters = components[BestOf(components, weights, places)].estimate.parameters;
  if (places.size() == 1) return piece;
  const PosteriorDraws draws = Mix(components, weights, places);
  for (int i = 0; i < prior.dimension(); ++i) {
    DescribeMarginal(draws, prior, i, piece.parameters[static_cast<size_t>(i)]);
  }
  return piece;
}

// Adds what is said of a component to what is said of the whole.
void Include(const Assessed& component, Assessed& whole) {
  const Findings& found = component.findings;
  Findings& findings = whole.findings;
  double& residual = whole.estimate.expansion.residual_to_noise;
  residual = std::max(residual, component.estimate.expansion.residual_to_noise);
  findings.shift = std::max(findings.shift, found.shift);
  findings.integration_shift = std::max(findings.integration_shift, found.integration_shift);
  findings.population_shift = std::max(findings.population_shift, found.population_shift);
  findings.carried_shift = std::max(findings.carried_shift, found.carried_shift);
  findings.power = std::min(findings.power, found.power);
  if (findings.not_mixed.empty()) findings.not_mixed = found.not_mixed;
  findings.leans = findings.leans || found.leans;
  findings.postponed.Include(found.postponed);
  if (!found.converged && findings.converged) {
    findings.converged = false;
    findings.minimizer_reason = found.minimizer_reason;
  }
}

Assessed Combine(const std::vector<Assessed>& components, const std::vector<double>& weights,
                 const std::vector<Places>& pieces, const ResolvedProblem& problem) {
  const Assessed& best = components[BestOf(components, weights, pieces.front())];
  Assessed whole;
  whole.estimate = best.estimate;
  whole.findings = best.findings;
  whole.findings.drawn_to_curvature = {};  // its draws are not those of the whole
  whole.findings.inaccurate_weight = 0;
  Places all;
  for (size_t k = 0; k < components.size(); ++k) {
    all.push_back(k);
    const double shift = components[k].findings.shift;
    if (shift > kInaccurateShift) whole.findings.inaccurate_weight += weights[k];
    if (weights[k] >= kMinWeightToWarn) Include(components[k], whole);
  }
  if (pieces.size() > 1 && whole.findings.UsesData()) {
    for (const Places& places : pieces) {
      whole.estimate.components.push_back(
          DescribePiece(components, weights, places, problem.prior()));
    }
  }
  std::vector<std::optional<double>> evidences;
  for (const Assessed& component : components) evidences.push_back(component.log_evidence);
  whole.log_evidence = LogSumOfExponentials(evidences);
  whole.posterior = Mix(components, weights, all);
  whole.findings.conflict =
      FindPriorConflict(problem, whole.posterior, whole.estimate.regularization);
  DescribeWhole(problem.prior(), whole.posterior, whole.findings, whole.estimate);
  if (pieces.size() == 1) ReplaceByMixtureDraws(whole.findings, whole.estimate);
  whole.filtered = MixFiltered(components);
  whole.estimate.filtered = DescribeFiltered(problem, whole.filtered, whole.posterior.weights);
  return whole;
}

// What a component has done counts for the next one.
void AddWork(const AssessmentRequest& component, AssessmentRequest& next) {
  next.reexpansions += component.reexpansions;
  next.propagated_rows += component.propagated_rows;
}

// Takes out of both lists the components in which no cost is finite, such as elements that the
// regions of their expansions hardly touch: they have no weight. Returns the first one's error if
// none has any.
absl::StatusOr<std::vector<Assessed>> AssessAll(std::vector<AssessmentRequest>& requests,
                                                std::vector<size_t>& places, const Stop& stop) {
  std::vector<Assessed> components;
  std::vector<AssessmentRequest> with_weight;
  const std::vector<size_t> all = std::exchange(places, {});
  absl::Status failed;
  const double power = CommonPower(requests);
  for (size_t k = 0; k < requests.size(); ++k) {
    requests[k].weigh = true;
    requests[k].power = power;
    // All components use the α² of the first.
    if (!components.empty()) {
      requests[k].regularization = components.front().estimate.regularization;
    }
    absl::StatusOr<Assessed> assessed = Assess(requests[k], stop);
    if (IsInfeasible(assessed.status())) {
      failed.Update(assessed.status());
      if (k + 1 < requests.size()) AddWork(requests[k], requests[k + 1]);
      continue;
    }
    if (!assessed.ok()) return assessed.status();
    if (!components.empty()) {
      assessed->findings.regularization_not_determined =
          components.front().findings.regularization_not_determined;
    }
    components.push_back(*std::move(assessed));
    with_weight.push_back(requests[k]);
    places.push_back(all[k]);
  }
  if (components.empty()) return failed;
  requests = std::move(with_weight);
  return components;
}

// Returns whether all have taken the same rows, which a stop may have prevented.
bool AreLevel(const std::vector<AssessmentRequest>& requests) {
  return std::ranges::all_of(requests, [&](const AssessmentRequest& one) {
    return one.record->rows() == requests.front().record->rows();
  });
}

std::vector<double> WeightsNow(const std::vector<AssessmentRequest>& requests,
                               const std::vector<Assessed>& components) {
  std::vector<double> evidences, last;
  for (size_t k = 0; k < requests.size(); ++k) {
    evidences.push_back(components[k].share.log_evidence);
    last.push_back(requests[k].last_weight);
  }
  return AreLevel(requests) ? WeightsOf(evidences) : last;
}

// Whether the draws go beyond what the component's cost says: they are of a tempered likelihood, or
// have been widened for what contradicts the expansion or the residuals. In an element where the
// data do not put the parameters, something always does.
bool IsWidened(const Findings& findings) {
  return findings.power < 1 || findings.WideningForShift() > 1 || findings.windows.contradicted;
}

// Returns the indices of the components that affect a result, heaviest first. Those that have been
// widened must not, as long as all of them that are left out have no noticeable weight: far from
// the others, their draws would give a mean and a standard deviation of their own.
std::vector<size_t> RelevantComponents(const std::vector<double>& weights,
                                       const std::vector<Assessed>& components) {
  std::vector<size_t> order(weights.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, [&](size_t a, size_t b) { return weights[a] > weights[b]; });
  double left_out = 0;
  std::vector<size_t> relevant;
  for (size_t place = order.size(); place-- > 0;) {
    const size_t k = order[place];
    const bool negligible = left_out + weights[k] < kMinWeightToWarn;
    if (weights[k] < kMinWeight || (negligible && IsWidened(components[k].findings))) {
      left_out += weights[k];
    } else {
      relevant.push_back(k);
    }
  }
  std::ranges::reverse(relevant);
  return relevant;
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

absl::StatusOr<AssessedMixture> AssessMixture(std::vector<AssessmentRequest> requests,
                                              double left_out, const Stop& stop) {
  AssessedMixture mixture;
  std::vector<size_t> places = KeepSameProblem(requests);
  if (requests.size() == 1) {
    mixture.order = places;
    POLYEST_ASSIGN_OR_RETURN(mixture.whole, Assess(requests.front(), stop));
    return mixture;
  }
  POLYEST_ASSIGN_OR_RETURN(std::vector<Assessed> assessed, AssessAll(requests, places, stop));
  const std::vector<double> weights = WeightsNow(requests, assessed);
  mixture.order = RelevantComponents(weights, assessed);
  int reexpansions = 0;
  int64_t trajectories = 0;
  for (const Assessed& one : assessed) {
    reexpansions += one.estimate.expansion.reexpansions;
    trajectories += one.estimate.expansion.trajectories;
  }
  double all = 0;
  for (const size_t k : mixture.order) all += weights[k];
  std::vector<double> in_order;
  std::vector<AssessmentRequest> requests_in_order;
  for (size_t& k : mixture.order) {
    in_order.push_back(weights[k] / all);
    requests_in_order.push_back(requests[k]);
    mixture.components.push_back(std::move(assessed[k]));
    k = places[k];
  }
  mixture.whole =
      Combine(mixture.components, in_order,
              PiecesOf(requests_in_order, mixture.components, in_order), *requests.front().problem);
  if (!AreLevel(requests)) mixture.whole.log_evidence.reset();
  mixture.whole.estimate.expansion.reexpansions = reexpansions;
  mixture.whole.estimate.expansion.trajectories = trajectories;
  mixture.whole.findings.left_out = left_out;
  POLYEST_ASSIGN_OR_RETURN(mixture.whole.estimate.diagnostics,
                           Diagnose(mixture.whole.findings, mixture.whole.estimate, stop));
  return mixture;
}

}  // namespace polyest::internal
