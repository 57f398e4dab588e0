#include "core/estimator/studies/regularization_sweep.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/bayes/curvature.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/posterior/regularization_choice.h"

namespace polyest::internal {
namespace {

constexpr double kMin = 1e-8, kMax = 1e8;

RegularizationPoint Describe(const RegularizedMinimum& minimum, const RegionalExpansion& expansion,
                             const Prior& prior) {
  const Cost cost = expansion.MakeCost(minimum.regularization);
  const Region& region = cost.region();
  const Vector xi = region.ToGerm(minimum.point);
  // An estimate uses these degrees of freedom too.
  const double spent =
      FittedParameters(region.HessianToGerm(cost.MismatchHessian(minimum.point)), prior) + 2;
  RegularizationPoint point;
  point.regularization = minimum.regularization;
  point.cost = minimum.cost;
  point.effective_parameters = minimum.effective_parameters;
  point.log_evidence = minimum.log_evidence;
  point.map = prior.ToParameters(xi);
  const Matrix hessian = region.HessianToGerm(cost.Hessian(minimum.point, spent));
  point.std_dev = CovarianceFromCurvature(hessian, prior, xi)
                      .standard_deviation.cwiseMin(prior.StandardDeviation());
  point.converged = minimum.converged;
  return point;
}

absl::Status CheckWeight(const char* field, double value) {
  if (value >= kMin && value <= kMax) return absl::OkStatus();
  return InvalidField(field, absl::StrFormat("%g must be from %g to %g", value, kMin, kMax));
}

}  // namespace

}  // namespace polyest::internal

namespace polyest {

using namespace internal;

absl::Status RegularizationOptions::Validate() const {
  POLYEST_RETURN_IF_ERROR(CheckWeight("lowest", lowest));
  POLYEST_RETURN_IF_ERROR(CheckWeight("highest", highest));
  if (!(lowest < highest)) {
    return InvalidField("lowest", absl::StrFormat("%g must be below highest, %g", lowest, highest));
  }
  return CheckRange("points", points, 2, kMaxRegularizations);
}

}  // namespace polyest

namespace polyest::internal {

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
  RegularizedMinima minima(expansion, stop);
  double greatest = -std::numeric_limits<double>::infinity();
  for (const RegularizedMinimum& minimum : SweepRegularization(
           LogarithmicRange(options.lowest, options.highest, options.points), minima.Function())) {
    sweep.points.push_back(Describe(minimum, expansion, problem.prior()));
    greatest = std::max(greatest, minimum.log_evidence);
  }
  for (RegularizationPoint& point : sweep.points) point.log_evidence -= greatest;
  POLYEST_RETURN_IF_ERROR(stop.Check());
  RegularizationRules rules(problem, expansion, stop);
  sweep.l_curve = rules.Choose(RegularizationMode::kLCurve);
  sweep.discrepancy = rules.Choose(RegularizationMode::kDiscrepancy);
  sweep.evidence = rules.Choose(RegularizationMode::kEvidence);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  sweep.regularization = assessed.estimate.regularization;
  sweep.diagnostics = assessed.estimate.diagnostics;
  return sweep;
}

}  // namespace polyest::internal
