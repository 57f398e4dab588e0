#include "core/estimator/regularization_sweep.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/bayes/curvature.h"
#include "core/bayes/l_curve.h"
#include "core/common/check.h"
#include "core/common/status.h"
#include "core/estimator/noise_learning.h"
#include "core/estimator/search_domain.h"

namespace polyest {
namespace {

constexpr double kLeast = 1e-8, kMost = 1e8;
constexpr double kAtEdge = 1e-6;  // of the box's width

// The minima on one expansion, each looked for from the one before and from the expansion's
// reference.
class Minima {
 public:
  Minima(const RegionalExpansion& expansion, const Stop& stop)
      : expansion_(expansion), stop_(stop), starts_(2, expansion.design().reference.size()) {
    starts_.rowwise() = expansion.design().reference.transpose();
  }

  std::optional<RegularizedMinimum> At(double regularization) {
    if (!stop_.Check().ok()) return std::nullopt;  // and the caller will see to it
    const Cost cost = expansion_.MakeCost(regularization);
    const MinimizationProblem search = SearchOf(cost, expansion_.design());
    const Minimum best = FindMinima(search, starts_, MinimizerOptions(), stop_).front();
    starts_.row(0) = best.point.transpose();
    if (!std::isfinite(best.value) || HeldByEdge(search, best.point)) return std::nullopt;
    std::optional<RegularizedMinimum> minimum = DescribeMinimum(cost, best.point);
    if (minimum) minimum->converged = best.converged;
    return minimum;
  }

  MinimumAt Function() {
    return [this](double regularization) { return At(regularization); };
  }

 private:
  // At the edge of the box in which the expansion is trusted, which is not one of Ω.
  bool HeldByEdge(const MinimizationProblem& search, const Vector& eta) const {
    const ExpansionDesign& design = expansion_.design();
    Vector lower, upper;
    SamplingBox(design, lower, upper);
    for (Eigen::Index i = 0; i < eta.size(); ++i) {
      const double near = kAtEdge * (upper[i] - lower[i]);
      // Ω's own bound has moved the search's.
      if (search.lower[i] == lower[i] && eta[i] - lower[i] < near) return true;
      if (search.upper[i] == upper[i] && upper[i] - eta[i] < near) return true;
    }
    return false;
  }

  const RegionalExpansion& expansion_;
  const Stop& stop_;
  Matrix starts_;
};

bool AllUniform(const Prior& prior) {
  return std::ranges::all_of(
      prior.germs(), [](const Germ& germ) { return germ.family() == GermFamily::kUniform; });
}

// What the rules choose, from one sweep over their range.
class Rules {
 public:
  Rules(const ResolvedProblem& problem, const RegionalExpansion& expansion, const Stop& stop)
      : problem_(problem), expansion_(expansion), minima_(expansion, stop) {
    if (AllUniform(problem.prior())) {
      no_effect_ = "every prior is uniform, and α² has no effect on those";
    } else {
      points_ = SweepRegularization(RangeOfChoice(), minima_.Function());
    }
  }

  RegularizationChoice Choose(RegularizationMode mode) {
    switch (mode) {
      case RegularizationMode::kFixed:
        return {true, problem_.problem().regularization, ""};
      case RegularizationMode::kLCurve:
        return no_effect_.empty() ? ChooseByLCurve(points_, problem_.prior()) : None(no_effect_);
      case RegularizationMode::kDiscrepancy:
        return no_effect_.empty() ? Discrepancy() : None(no_effect_);
      case RegularizationMode::kEvidence:
        return no_effect_.empty() ? ChooseByEvidence(points_, minima_.Function())
                                  : None(no_effect_);
    }
    POLYEST_CHECK(false);
  }

 private:
  static RegularizationChoice None(std::string reason) { return {false, 1, std::move(reason)}; }

  RegularizationChoice Discrepancy() {
    for (const MeasuredOutput& measured : problem_.problem().measured) {
      if (!measured.noise.unknown) continue;
      return None(absl::StrFormat("the noise of output %s is of unknown size", measured.output));
    }
    double degrees = 0;
    for (const ChannelSums& sums : expansion_.sums()) degrees += sums.Degrees();
    return ChooseByDiscrepancy(points_, minima_.Function(), degrees);
  }

  const ResolvedProblem& problem_;
  const RegionalExpansion& expansion_;
  Minima minima_;
  std::string no_effect_;  // why, or empty
  std::vector<RegularizedMinimum> points_;
};

RegularizationPoint Describe(const RegularizedMinimum& minimum, const RegionalExpansion& expansion,
                             const Prior& prior) {
  const Cost cost = expansion.MakeCost(minimum.regularization);
  const Matrix inverse = cost.region().axes().inverse();
  const auto to_germ = [&](const Matrix& hessian) -> Matrix {
    return inverse.transpose() * hessian * inverse;
  };
  const Vector xi = cost.region().ToGerm(minimum.point);
  // As in an estimate.
  const double spent = FittedParameters(to_germ(cost.MismatchHessian(minimum.point)), prior) + 2;
  RegularizationPoint point;
  point.regularization = minimum.regularization;
  point.cost = minimum.cost;
  point.effective_parameters = minimum.effective_parameters;
  point.log_evidence = minimum.log_evidence;
  point.map = prior.ToParameters(xi);
  point.std_dev = CovarianceFromCurvature(to_germ(cost.Hessian(minimum.point, spent)), prior, xi)
                      .standard_deviation.cwiseMin(prior.StandardDeviation());
  point.converged = minimum.converged;
  return point;
}

absl::Status CheckWeight(const char* field, double value) {
  if (value >= kLeast && value <= kMost) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("%s: %g must be from %g to %g", field, value, kLeast, kMost));
}

}  // namespace

absl::Status RegularizationOptions::Validate() const {
  POLYEST_RETURN_IF_ERROR(CheckWeight("lowest", lowest));
  POLYEST_RETURN_IF_ERROR(CheckWeight("highest", highest));
  if (!(lowest < highest)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("lowest: %g must be below highest, %g", lowest, highest));
  }
  if (points < 2 || points > kMostRegularizations) {
    return absl::InvalidArgumentError(
        absl::StrFormat("points: %d must be from 2 to %d", points, kMostRegularizations));
  }
  return absl::OkStatus();
}

absl::StatusOr<RegularizationChoice> ChooseRegularization(const ResolvedProblem& problem,
                                                          const RegionalExpansion& expansion,
                                                          const Stop& stop) {
  RegularizationChoice choice =
      Rules(problem, expansion, stop).Choose(problem.problem().regularization_mode);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  return choice;
}

absl::StatusOr<RegularizationSweep> SweepRegularization(const ResolvedProblem& problem,
                                                        const RegionalExpansion& expansion,
                                                        const Assessed& assessed,
                                                        const RegularizationOptions& options,
                                                        const Stop& stop) {
  RegularizationSweep sweep;
  for (const ParameterEstimate& parameter : assessed.estimate.parameters) {
    sweep.parameters.push_back(parameter.name);
    sweep.units.push_back(parameter.unit);
  }
  Minima minima(expansion, stop);
  double greatest = -std::numeric_limits<double>::infinity();
  for (const RegularizedMinimum& minimum : SweepRegularization(
           LogarithmicRange(options.lowest, options.highest, options.points), minima.Function())) {
    sweep.points.push_back(Describe(minimum, expansion, problem.prior()));
    greatest = std::max(greatest, minimum.log_evidence);
  }
  for (RegularizationPoint& point : sweep.points) point.log_evidence -= greatest;
  POLYEST_RETURN_IF_ERROR(stop.Check());
  Rules rules(problem, expansion, stop);
  sweep.l_curve = rules.Choose(RegularizationMode::kLCurve);
  sweep.discrepancy = rules.Choose(RegularizationMode::kDiscrepancy);
  sweep.evidence = rules.Choose(RegularizationMode::kEvidence);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  sweep.regularization = assessed.estimate.regularization;
  sweep.diagnostics = assessed.estimate.diagnostics;
  return sweep;
}

}  // namespace polyest
