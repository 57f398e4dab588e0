#include "core/estimator/posterior/assessment.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/cost_minima.h"
#include "core/bayes/identifiability.h"
#include "core/bayes/regularization_bias.h"
#include "core/bayes/weighted_samples.h"
#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/control_trajectories.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/expansion/model_agreement.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/believed_minimum.h"
#include "core/estimator/posterior/channel_description.h"
#include "core/estimator/posterior/diagnosis.h"
#include "core/estimator/posterior/marginal_description.h"
#include "core/estimator/posterior/misfit.h"
#include "core/estimator/posterior/model_correction.h"
#include "core/estimator/posterior/model_evidence.h"
#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/posterior/noise_marginal.h"
#include "core/estimator/posterior/other_minima.h"
#include "core/estimator/posterior/parameter_spread.h"
#include "core/estimator/posterior/population_shift.h"
#include "core/estimator/posterior/prior_conflict.h"
#include "core/estimator/posterior/regularization_choice.h"
#include "core/estimator/posterior/trade_off.h"

namespace polyest::internal {
namespace {

constexpr int kDrawsForEdges = 2'000;
// Fraction of the posterior at an edge of the region from which on its being cut there matters.
constexpr double kOverEdge = 0.03;

class Assessment {
 public:
  explicit Assessment(const AssessmentRequest& request)
      : problem_(*request.problem),
        prior_(problem_.prior()),
        request_(request),
        design_(request.expansion->design()) {}

  absl::StatusOr<Assessed> Run(const Stop& stop) {
    POLYEST_RETURN_IF_ERROR(SetRegularization(stop));
    const Cost cost = TemperedCost(stop);
    POLYEST_ASSIGN_OR_RETURN(
        posterior_, DrawPosterior(cost, design_, *request_.guesses, request_.effort, stop));
    BeginWithBelieved(cost, design_, posterior_);
    MixtureShare share;
    findings_.not_mixed = WhyNotMixed(posterior_);
    NoteLeaning();
    if (request_.weigh) share = ShareOf(*request_.expansion, cost, posterior_);
    const Vector eta = MinimumAsStated(cost, stop);
    std::optional<double> log_evidence;
    if (request_.effort.evidence) {
      log_evidence = LogModelEvidence(problem_, *request_.expansion, cost, posterior_, eta);
    }
    NoteMinimum(posterior_.minima.front(), eta);
    findings_.other_minima = OtherMinima(cost, design_, prior_, posterior_.minima, stop);
    Summarize(cost, eta);
    POLYEST_ASSIGN_OR_RETURN(
        noise_widening_, MarginalizeNoise(problem_, *request_.expansion, cost, *request_.guesses,
                                          request_.effort, stop, posterior_));
    Correct(cost);
    filtered_ = DrawFiltered(problem_, *request_.expansion, posterior_);
    findings_.population_shift = PopulationShift(problem_, posterior_);
    findings_.conflict = FindPriorConflict(problem_, posterior_, regularization_);
    findings_.shift =
        std::hypot(findings_.shift, findings_.integration_shift, findings_.population_shift);
    POLYEST_RETURN_IF_ERROR(FindInformation(cost, eta));
    // The noise is judged by the draws before they are widened: farther out, the residuals are
    // those of the expansion.
    estimate_.channels = DescribeChannels(request_, cost, eta, posterior_, fitted_);
    WidenForShift();
    findings_.degrees = DegreesOfFreedom(request_, estimate_.channels, fitted_);
    DescribeWindows(cost, eta);
    DescribeParameters(cost, eta);
    POLYEST_RETURN_IF_ERROR(CheckFinite(estimate_.parameters));
    DescribeBias(cost, eta, stop);
    POLYEST_RETURN_IF_ERROR(stop.Check());
    DescribeFilters();
    POLYEST_ASSIGN_OR_RETURN(estimate_.diagnostics, Diagnose(findings_, estimate_, stop));
    return Assessed{std::move(estimate_), std::move(posterior_), std::move(findings_), share,
                    std::move(filtered_), log_evidence};
  }

 private:
  void NoteMinimum(const Minimum& minimum, const Vector& eta) {
    findings_.problem = &problem_;
    findings_.postponed = request_.postponed;
    findings_.expansion = request_.expansion;
    findings_.record = request_.record;
    findings_.map_xi = design_.region.ToGerm(eta);
    findings_.converged = minimum.converged;
    findings_.minimizer_reason = minimum.reason;
  }

  absl::Status SetRegularization(const Stop& stop) {
    regularization_ = problem_.problem().regularization;
    if (request_.regularization) {
      regularization_ = *request_.regularization;
    } else if (problem_.problem().regularization_mode != RegularizationMode::kFixed) {
      POLYEST_ASSIGN_OR_RETURN(const RegularizationChoice choice,
                               ChooseRegularization(problem_, *request_.expansion, stop));
      regularization_ = choice.regularization;
      findings_.regularization_not_determined = choice.reason;
    }
    return absl::OkStatus();
  }

  // Returns the cost, with the power of the likelihood that misfit and expansion allow.
  Cost TemperedCost(const Stop& stop) {
    Cost cost = request_.expansion->MakeCost(regularization_);
    if (!problem_.problem().expansion.adaptive) return cost;
    const MisfitFound misfit = FindMisfit(problem_, *request_.expansion, stop);
    findings_.leans = misfit.at_edge;
    cost.set_power(request_.power ? *request_.power : 1 / misfit.ratio);
    const double power = LikelihoodPower(*request_.expansion, cost);
    findings_.power = power / cost.power();
    cost.set_power(power);
    return cost;
  }

  // Returns the minimum of the cost as stated, whatever the likelihood's power.
  Vector MinimumAsStated(const Cost& cost, const Stop& stop) const {
    const std::vector<Minimum>& minima = posterior_.minima;
    if (cost.power() == 1 && !prior_.has_exponential_germs()) return minima.front().point;
    const Cost stated = cost.AsStated();
    Matrix starts(static_cast<Eigen::Index>(minima.size()), cost.dimension());
    for (size_t i = 0; i < minima.size(); ++i) {
      starts.row(static_cast<Eigen::Index>(i)) = minima[i].point.transpose();
    }
    return FindMinimaOf(stated, SearchOf(stated, design_), starts, stop).front().point;
  }

  void NoteLeaning() {
    const Matrix xis =
        posterior_.Germs(prior_)(EquallyWeighted(posterior_.weights, kDrawsForEdges), Eigen::all);
    findings_.leans =
        findings_.leans || PressesOnDropped(xis) ||
        !LeaningAxes(design_, prior_, design_.element, design_.region.ManyToLocal(xis), kOverEdge)
             .empty();
  }

  // Whether the posterior presses on a bound of its element beyond which all has been dropped: that
  // was too early.
  bool PressesOnDropped(const Matrix& xis) const {
    if (!request_.others) return false;
    const Element& element = design_.element;
    return element.Freed(*request_.others, xis).bounds().size() < element.bounds().size();
  }

  void Summarize(const Cost& cost, const Vector& eta) {
    const RecordSummary& record = *request_.record;
    const Agreement agreement = AgreementWithModel(*request_.expansion, cost);
    findings_.integration_shift = IntegrationShift(*request_.expansion, cost);
    findings_.shift = agreement.shift;
    findings_.carried_shift = std::sqrt(cost.power() * request_.expansion->CarriedError());
    ExpansionSummary& expansion = estimate_.expansion;
    expansion.order = design_.basis->order();
    expansion.terms = design_.basis->size();
    expansion.points = request_.expansion->points();
    expansion.residual_to_noise = agreement.residual_to_noise;
    expansion.reexpansions = request_.reexpansions;
    if (record.rows() > 0) {
      expansion.trajectories = (request_.propagated_rows + record.rows() / 2) / record.rows();
    }
    estimate_.time_s = record.time_s();
    estimate_.samples = record.samples();
    estimate_.regularization = regularization_;
    estimate_.cost = cost.AsStated().Evaluate(eta);
    const bool more_prior = problem_.ended_runs() != nullptr || problem_.population().has_value();
    if (!more_prior || !(regularization_ > 0)) return;
    // What the parameters of ended runs add when they are integrated out, and what a population
    // does, counts with the prior.
    estimate_.cost.prior = (estimate_.cost.total - estimate_.cost.mismatch) / regularization_;
  }

  // Reweights the draws by the model itself.
  void Correct(const Cost& cost) {
    if (!design_.checks_are_draws) return;
    const Matrix etas = design_.region.ManyToLocal(posterior_.Germs(prior_));
    const ModelCorrection correction =
        CorrectByModel(DifferencesAtChecks(*request_.expansion, cost), etas, posterior_.weights,
                       LargestShift(*request_.expansion, /*power=*/1));
    estimate_.expansion.pareto_shape = correction.pareto_shape;
    if (correction.degree == 0) return;
    findings_.shift = std::min(findings_.shift, correction.shift + findings_.carried_shift);
    Reweigh(correction.log_factors, posterior_);
  }

  // Sets what the data tell at the minimum, and how many parameters they fit.
  absl::Status FindInformation(const Cost& cost, const Vector& eta) {
    fitted_ = FittedParameters(design_.region.HessianToGerm(cost.MismatchHessian(eta)), prior_);
    spent_ = fitted_ + 2;
    information_ = design_.region.HessianToGerm(cost.InformationHessian(eta, spent_));
    if (information_.allFinite()) return absl::OkStatus();
    return InfeasibleError("the curvature of the cost at its minimum is not finite");
  }

  void DescribeParameters(const Cost& cost, const Vector& eta) {
    const ParameterSpread spread = FindSpread(cost, eta);
    findings_.drawn_to_curvature = spread.drawn_to_curvature;
    estimate_.covariance = spread.covariance;
    estimate_.directions = Directions(information_, prior_);
    const Vector map = prior_.ToParameters(findings_.map_xi);
    const Vector prior_mean = prior_.Mean();
    const Vector prior_deviation = prior_.StandardDeviation();
    for (int i = 0; i < prior_.dimension(); ++i) {
      ParameterEstimate parameter;
      parameter.name = prior_.parameters()[static_cast<size_t>(i)].name;
      parameter.unit = problem_.units()[static_cast<size_t>(i)];
      parameter.map = map[i];
      parameter.std_dev = spread.deviation[i];
      parameter.robust_std_dev = spread.robust_deviation[i];
      parameter.prior_mean = prior_mean[i];
      parameter.prior_std_dev = prior_deviation[i];
      parameter.contraction = spread.deviation[i] / prior_deviation[i];
      parameter.verdict = VerdictOfContraction(spread.informed[i]);
      if (parameter.verdict == Verdict::kIdentified && findings_.IsDoubtful(i)) {
        parameter.verdict = Verdict::kWeak;
      }
      DescribeMarginal(posterior_, prior_, i, parameter);
      if (!findings_.other_minima.empty()) DoubtIfPiecesSpread(parameter);
      estimate_.parameters.push_back(std::move(parameter));
    }
    GoByPriorIfInaccurate(findings_, prior_, estimate_);
    if (findings_.UsesData()) DescribeTradeOffs();
  }

  // Whether nothing speaks against the draws, so that they count where the curvature contradicts
  // them. Draws from a prior of another weight than its own say nothing about the data, and where
  // there are several minima the curvature is that of one of them.
  bool DrawsAreRight() const {
    return findings_.power == 1 && findings_.shift <= kInaccurateShift &&
           !findings_.windows.contradicted && regularization_ == 1 &&
           findings_.other_minima.empty();
  }

  // Sets the standard deviations, and widens the draws where residuals or windows ask for it.
  ParameterSpread FindSpread(const Cost& cost, const Vector& eta) {
    const Vector& widening = findings_.windows.widening;
    ParameterSpread spread =
        SpreadOfParameters({.xi = findings_.map_xi,
                            .hessian = design_.region.HessianToGerm(cost.Hessian(eta, spent_)),
                            .information = information_},
                           prior_,
                           {.shift = shift_widening_,
                            .all = shift_widening_ * noise_widening_.cwiseProduct(widening),
                            .robust_ratio = findings_.windows.robust.ratio},
                           DrawsAreRight() ? &posterior_ : nullptr);
    if (findings_.windows.contradicted) {
      WidenContradicted(widening, shift_widening_ * spread.contraction, prior_, posterior_);
    }
    return spread;
  }

  void WidenForShift() {
    shift_widening_ = findings_.WideningForShift();
    Widen(Vector::Constant(prior_.dimension(), shift_widening_), prior_, posterior_);
  }

  // The windows' ratios are relative to the standard deviations at the stated noise. Those of a
  // likelihood to a power have been widened already.
  void DescribeWindows(const Cost& cost, const Vector& eta) {
    findings_.windows = AssessWindows(*request_.expansion, problem_, *request_.record,
                                      estimate_.channels, findings_.degrees, eta, regularization_);
    const double narrower = std::sqrt(cost.power());
    findings_.windows.widening = (narrower * findings_.windows.widening).cwiseMax(1);
    findings_.windows.robust.ratio *= narrower;
    estimate_.disagreement = findings_.windows.robust.disagreement;
    estimate_.windows = findings_.windows.estimates;
  }

  // What the filters know is as doubtful as the most doubtful parameter.
  void DescribeFilters() {
    filtered_.deviation *= shift_widening_ * findings_.windows.widening.maxCoeff();
    estimate_.filtered = DescribeFiltered(problem_, filtered_, posterior_.weights);
  }

  void DescribeBias(const Cost& cost, const Vector& eta, const Stop& stop) {
    const Vector bias = RegularizationBias(cost, eta, stop);
    for (int i = 0; i < prior_.dimension(); ++i) {
      estimate_.parameters[static_cast<size_t>(i)].bias = bias[i];
    }
  }

  void DescribeTradeOffs() {
    std::vector<std::string> names;
    std::vector<Verdict> verdicts;
    Matrix thetas(posterior_.scores.rows(), prior_.dimension());
    for (int i = 0; i < prior_.dimension(); ++i) {
      const ParameterEstimate& parameter = estimate_.parameters[static_cast<size_t>(i)];
      names.push_back(parameter.name);
      verdicts.push_back(parameter.verdict);
    }
    if (std::ranges::count(verdicts, Verdict::kIdentified) == prior_.dimension()) return;
    for (int i = 0; i < prior_.dimension(); ++i) thetas.col(i) = posterior_.Parameter(prior_, i);
    estimate_.trade_offs =
        FindTradeOffs(thetas, posterior_.weights, names, problem_.units(), verdicts);
  }

  const ResolvedProblem& problem_;
  const Prior& prior_;
  const AssessmentRequest& request_;
  const ExpansionDesign& design_;
  double regularization_ = 1;
  double fitted_ = 0;   // number of parameters fitted by the data
  double spent_ = 0;    // degrees of freedom used up, see Cost::MismatchHessian
  Matrix information_;  // of the data on the germ at the minimum, n × n
  PosteriorDraws posterior_;
  FilteredDraws filtered_;     // at these draws
  double shift_widening_ = 1;  // factor of the uncertainty for the expansion's own error
  Vector noise_widening_;      // factors of it for the noise's correlation, by parameter
  Findings findings_;
  Estimate estimate_;
};

}  // namespace

absl::StatusOr<Assessed> Assess(const AssessmentRequest& request, const Stop& stop) {
  return Assessment(request).Run(stop);
}

}  // namespace polyest::internal
