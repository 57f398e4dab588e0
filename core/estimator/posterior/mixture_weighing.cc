#include "core/estimator/posterior/mixture_weighing.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "core/bayes/cost_minima.h"
#include "core/bayes/weighted_samples.h"
#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/connected_elements.h"
#include "core/estimator/posterior/max_log_evidence.h"

namespace polyest::internal {
namespace {

// Effort for weights that only decide which components to continue with.
constexpr PosteriorEffort kWeighingEffort = {
    .importance_points = 4'096, .chain_effective_size = 2'000, .max_sweeps = 64};

constexpr int kParticlesKept = 1'000;
// Up to this many components are all weighed by draws.
constexpr size_t kFew = 4;
// Starts of the search for the least cost of an element, beside particles of its posterior.
constexpr int kStartsInElement = 3;

// The posterior of one component, as far as its weight needs it.
struct Weighed {
  double log_evidence = -kInfinity;
  Matrix particles;
};

class Weighing {
 public:
  Weighing(const std::vector<AssessmentRequest>& requests, size_t max_kept)
      : requests_(requests),
        max_kept_(max_kept),
        power_(CommonPower(requests)),
        weighed_(requests.size()) {}

  absl::StatusOr<MixtureWeighing> Run(const Stop& stop) {
    POLYEST_RETURN_IF_ERROR(WeighHeaviest(stop));
    MixtureWeighing weighing;
    std::vector<double> evidences;
    for (const Weighed& one : weighed_) evidences.push_back(one.log_evidence);
    const std::vector<double> weights = WeightsOf(evidences);
    std::vector<size_t> order = HeaviestFirst(weights);
    if (order.size() > max_kept_) {
      weighing.left_out = weights[order[max_kept_]];
      order.resize(max_kept_);
    }
    std::ranges::sort(order);
    for (const size_t k : order) {
      weighing.kept.push_back(k);
      weighing.weights.push_back(weights[k]);
      weighing.particles.push_back(std::move(weighed_[k].particles));
    }
    const double all = std::accumulate(weighing.weights.begin(), weighing.weights.end(), 0.0);
    for (double& weight : weighing.weights) weight /= all;
    return weighing;
  }

 private:
  // Returns the components that have at least the least weight; of equal ones, the first first.
  static std::vector<size_t> HeaviestFirst(const std::vector<double>& weights) {
    std::vector<size_t> order;
    for (size_t k = 0; k < weights.size(); ++k) {
      if (weights[k] >= kMinWeight) order.push_back(k);
    }
    std::ranges::stable_sort(order, std::greater(), [&](size_t k) { return weights[k]; });
    return order;
  }

  // Draws from the components in the order of the most that their evidence can be, until the rest
  // can no longer matter.
  absl::Status WeighHeaviest(const Stop& stop) {
    std::vector<double> bounds;
    for (const AssessmentRequest& request : requests_) {
      POLYEST_RETURN_IF_ERROR(stop.Check());
      const Cost cost = CostOf(request);
      bounds.push_back(requests_.size() > kFew
                           ? MaxLogEvidence(*request.expansion, cost, *request.guesses)
                           : kInfinity);
    }
    std::vector<size_t> order(requests_.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::ranges::stable_sort(order, [&](size_t a, size_t b) { return bounds[a] > bounds[b]; });
    double heaviest = -kInfinity;
    for (const size_t k : order) {
      if (bounds[k] < heaviest + std::log(kMinWeight)) break;
      POLYEST_RETURN_IF_ERROR(Weigh(k, stop));
      heaviest = std::max(heaviest, weighed_[k].log_evidence);
    }
    return absl::OkStatus();
  }

  // The cost with the power of the component that the residuals contradict least: the others'
  // residuals speak against them.
  Cost CostOf(const AssessmentRequest& request) const {
    Cost cost = request.expansion->MakeCost(request.problem->problem().regularization);
    cost.set_power(power_);
    return cost;
  }

  absl::Status Weigh(size_t k, const Stop& stop) {
    const AssessmentRequest& request = requests_[k];
    const Cost cost = CostOf(request);
    absl::StatusOr<PosteriorDraws> draws =
        DrawPosterior(cost, request.expansion->design(), *request.guesses, kWeighingEffort, stop);
    if (IsInfeasible(draws.status())) return absl::OkStatus();  // a cost of +∞
    if (!draws.ok()) return draws.status();
    weighed_[k].log_evidence = ShareOf(*request.expansion, cost, *draws).log_evidence;
    weighed_[k].particles =
        draws->Germs(cost.prior())(EquallyWeighted(draws->weights, kParticlesKept), Eigen::all);
    return absl::OkStatus();
  }

  const std::vector<AssessmentRequest>& requests_;
  const size_t max_kept_;
  const double power_;
  std::vector<Weighed> weighed_;
};

// Returns the index of each component's piece of the posterior.
std::vector<size_t> PieceOfEach(const std::vector<AssessmentRequest>& requests,
                                const std::vector<Matrix>& particles, const Stop& stop) {
  std::vector<Cost> costs;
  for (const AssessmentRequest& request : requests) {
    costs.push_back(request.expansion->MakeCost(request.problem->problem().regularization));
    costs.back().set_power(CommonPower(requests));
  }
  std::vector<ElementCost> elements;
  for (size_t k = 0; k < requests.size(); ++k) {
    const ExpansionDesign& design = requests[k].expansion->design();
    Matrix starts = design.reference.transpose();
    if (particles[k].rows() > 0) {
      const Matrix etas = design.region.ManyToLocal(particles[k]);
      Vector totals;
      costs[k].EvaluateMany(etas, totals);
      starts = SpreadStarts(etas, totals, kStartsInElement);
    }
    elements.push_back({&design, &costs[k], HeightOf(*requests[k].expansion, costs[k]),
                        FindMinimaOf(costs[k], SearchOf(costs[k], design), starts, stop).front()});
  }
  return ConnectedPieces(elements);
}

}  // namespace

double CommonPower(const std::vector<AssessmentRequest>& requests) {
  double misfit = kInfinity;
  for (const AssessmentRequest& request : requests) {
    misfit = std::min(misfit, request.expansion->noise().misfit);
  }
  return 1 / misfit;
}

std::vector<std::vector<size_t>> GroupsWithoutLastRun(
    const std::vector<AssessmentRequest>& requests, const std::vector<Matrix>& particles,
    const Stop& stop) {
  const std::vector<size_t> pieces = PieceOfEach(requests, particles, stop);
  const std::vector<int> shared = requests.front().problem->SharedParameters();
  std::vector<Element> along;
  for (const AssessmentRequest& request : requests) {
    along.push_back(request.expansion->design().element.AlongGerms(shared));
  }
  std::vector<std::vector<size_t>> groups;
  for (size_t k = 0; k < requests.size(); ++k) {
    const auto group = std::ranges::find_if(groups, [&](const std::vector<size_t>& one) {
      return pieces[one.front()] == pieces[k] && along[one.front()].HasBoundsOf(along[k]);
    });
    if (group == groups.end()) {
      groups.push_back({k});
    } else {
      group->push_back(k);
    }
  }
  return groups;
}

absl::StatusOr<MixtureWeighing> WeighMixture(const std::vector<AssessmentRequest>& requests,
                                             size_t max_kept, const Stop& stop) {
  return Weighing(requests, max_kept).Run(stop);
}

}  // namespace polyest::internal
