#include "core/estimator/posterior/regularization_choice.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/bayes/cost_minima.h"
#include "core/bayes/l_curve.h"
#include "core/common/check.h"
#include "core/common/status.h"
#include "core/estimator/expansion/search_domain.h"

namespace polyest::internal {
namespace {

constexpr double kAtEdge = 1e-6;  // fraction of the box's width

bool AllUniform(const Prior& prior) {
  return std::ranges::all_of(
      prior.germs(), [](const Germ& germ) { return germ.family() == GermFamily::kUniform; });
}

RegularizationChoice None(std::string reason) { return {false, 1, std::move(reason)}; }

}  // namespace

RegularizedMinima::RegularizedMinima(const RegionalExpansion& expansion, const Stop& stop)
    : expansion_(expansion), stop_(stop), starts_(2, expansion.design().reference.size()) {
  starts_.rowwise() = expansion.design().reference.transpose();
}

std::optional<RegularizedMinimum> RegularizedMinima::At(double regularization) {
  if (!stop_.Check().ok()) return std::nullopt;  // the caller reports the stop
  const Cost cost = expansion_.MakeCost(regularization);
  const MinimizationProblem search = SearchOf(cost, expansion_.design());
  const Minimum best = FindMinimaOf(cost, search, starts_, stop_).front();
  starts_.row(0) = best.point.transpose();
  if (!std::isfinite(best.value) || HeldByEdge(search, best.point)) return std::nullopt;
  std::optional<RegularizedMinimum> minimum = DescribeMinimum(cost, best.point);
  if (minimum) minimum->converged = best.converged;
  return minimum;
}

MinimumAt RegularizedMinima::Function() {
  return [this](double regularization) { return At(regularization); };
}

bool RegularizedMinima::HeldByEdge(const MinimizationProblem& search, const Vector& eta) const {
  const ExpansionDesign& design = expansion_.design();
  Vector lower, upper;
  SamplingBox(design, lower, upper);
  for (Eigen::Index i = 0; i < eta.size(); ++i) {
    const double near = kAtEdge * (upper[i] - lower[i]);
    // A bound of Ω inside the box has moved the search's bound; it does not count.
    if (search.lower[i] == lower[i] && eta[i] - lower[i] < near) return true;
    if (search.upper[i] == upper[i] && upper[i] - eta[i] < near) return true;
  }
  return false;
}

RegularizationRules::RegularizationRules(const ResolvedProblem& problem,
                                         const RegionalExpansion& expansion, const Stop& stop)
    : problem_(problem), expansion_(expansion), minima_(expansion, stop) {
  if (AllUniform(problem.prior())) {
    no_effect_ = "every prior is uniform, and α² has no effect on those";
  } else {
    points_ = SweepRegularization(RangeOfChoice(), minima_.Function());
  }
}

RegularizationChoice RegularizationRules::Choose(RegularizationMode mode) {
  if (mode == RegularizationMode::kFixed) {
    return {true, problem_.problem().regularization, ""};
  }
  if (!no_effect_.empty()) return None(no_effect_);
  switch (mode) {
    case RegularizationMode::kLCurve:
      return ChooseByLCurve(points_, problem_.prior());
    case RegularizationMode::kDiscrepancy:
      return Discrepancy();
    case RegularizationMode::kEvidence:
      return ChooseByEvidence(points_, minima_.Function());
    case RegularizationMode::kFixed:
      break;
  }
  POLYEST_CHECK(false);
}

RegularizationChoice RegularizationRules::Discrepancy() {
  for (const MeasuredOutput& measured : problem_.problem().measured) {
    if (!measured.noise.unknown) continue;
    return None(absl::StrFormat("the noise of output %s is of unknown size", measured.output));
  }
  double degrees = 0;
  for (const ChannelSums& sums : expansion_.sums()) degrees += sums.Degrees();
  return ChooseByDiscrepancy(points_, minima_.Function(), degrees);
}

absl::StatusOr<RegularizationChoice> ChooseRegularization(const ResolvedProblem& problem,
                                                          const RegionalExpansion& expansion,
                                                          const Stop& stop) {
  RegularizationChoice choice =
      RegularizationRules(problem, expansion, stop).Choose(problem.problem().regularization_mode);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  return choice;
}

}  // namespace polyest::internal
