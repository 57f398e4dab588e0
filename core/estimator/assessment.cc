#include "core/estimator/assessment.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/bayes/curvature.h"
#include "core/bayes/l_curve.h"
#include "core/bayes/minimizer.h"
#include "core/chaos/expansion.h"
#include "core/common/status.h"
#include "core/estimator/diagnosis.h"
#include "core/estimator/reexpansion.h"

namespace polyest {
namespace {

constexpr int kParticles = 2000;
constexpr int kSweeps = 6;         // after each tempering step
constexpr int kTotalSweeps = 120;  // so that an estimate takes the same time after any record
constexpr uint64_t kSeed = 20'071'121;
constexpr int kStarts = 6;
// Other minima count when their density is not below this part of the best one's: e^−7 ≈ 10⁻³.
constexpr double kComparableCost = 7;
// Kept from a bound of Ω, of its width: a density that vanishes at the bound has no finite cost.
constexpr double kOffBound = 1e-9;
// An isolated minimum has all its curvatures above the prior's; a valley's floor has not.
constexpr double kIsolatedCurvature = 1;

// Ω in local coordinates as rows a with aᵀη ≤ bound, and the box of the search.
MinimizationProblem SearchDomain(const ExpansionDesign& design, const Prior& prior) {
  MinimizationProblem search;
  SamplingBox(design, search.lower, search.upper);
  const int n = prior.dimension();
  search.constraint.resize(0, n);
  search.bound.resize(0);
  for (int i = 0; i < n; ++i) {
    const bool finite = std::isfinite(prior.lower()[i]) && std::isfinite(prior.upper()[i]);
    const double off = kOffBound * (finite ? prior.upper()[i] - prior.lower()[i] : 1);
    for (const double sign : {1.0, -1.0}) {
      const double bound = sign > 0 ? prior.upper()[i] : -prior.lower()[i];
      if (!std::isfinite(bound)) continue;
      if (design.whole_prior) {
        if (sign > 0) search.upper[i] = std::min(search.upper[i], bound - off);
        if (sign < 0) search.lower[i] = std::max(search.lower[i], -(bound - off));
        continue;
      }
      search.constraint.conservativeResize(search.constraint.rows() + 1, n);
      search.bound.conservativeResize(search.bound.size() + 1);
      search.constraint.bottomRows(1) = sign * design.region.axes().row(i);
      search.bound.tail(1)[0] = bound - off - sign * design.region.centre()[i];
    }
  }
  return search;
}

// The particle of least cost, then each time the one farthest from those chosen, in standard
// deviations of the particles.
Matrix Starts(const Particles& particles) {
  const Eigen::Index count = particles.etas.rows();
  const Vector mean = particles.etas.colwise().mean().transpose();
  const Matrix centred = particles.etas.rowwise() - mean.transpose();
  const Vector scale =
      (centred.colwise().squaredNorm() / static_cast<double>(count)).cwiseSqrt().transpose();
  Matrix starts(kStarts, particles.etas.cols());
  Eigen::Index chosen;
  particles.costs.minCoeff(&chosen);
  Vector distance = Vector::Constant(count, std::numeric_limits<double>::infinity());
  for (int i = 0; i < kStarts; ++i) {
    starts.row(i) = particles.etas.row(chosen);
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto difference = (particles.etas.row(k) - starts.row(i)).transpose().array() /
                              scale.array().max(std::numeric_limits<double>::min());
      distance[k] = std::min(distance[k], difference.square().sum());
    }
    distance.maxCoeff(&chosen);
  }
  return starts;
}

class Assessment {
 public:
  explicit Assessment(const AssessmentRequest& request)
      : problem_(*request.problem),
        prior_(problem_.prior()),
        request_(request),
        design_(request.expansion->design()) {}

  absl::StatusOr<Estimate> Run(const Stop& stop) {
    regularization_ = problem_.problem().regularization;
    if (problem_.problem().regularization_mode == RegularizationMode::kLCurve) {
      POLYEST_RETURN_IF_ERROR(ChooseRegularization(stop));
    }
    const Cost cost = request_.expansion->MakeCost(regularization_);
    POLYEST_RETURN_IF_ERROR(SamplePosteriorOf(cost, stop));
    const std::vector<Minimum> minima =
        FindMinima(MinimizationOf(cost), Starts(particles_), MinimizerOptions(), stop);
    POLYEST_RETURN_IF_ERROR(stop.Check());
    const Vector eta = minima.front().point;
    findings_.problem = &problem_;
    findings_.expansion = request_.expansion;
    findings_.record = request_.record;
    findings_.map_xi = design_.region.ToGerm(eta);
    findings_.converged = minima.front().converged;
    findings_.minimizer_reason = minima.front().reason;
    NoteOtherMinima(cost, minima);
    Summarize(cost, eta);
    DescribeParameters(cost, eta);
    DescribeChannels(cost, eta);
    estimate_.diagnostics = Diagnose(findings_, estimate_);
    return std::move(estimate_);
  }

 private:
  MinimizationProblem MinimizationOf(const Cost& cost) const {
    MinimizationProblem search = SearchDomain(design_, prior_);
    search.function = [&cost](const Vector& eta, Vector* gradient) {
      if (gradient == nullptr) return cost.Evaluate(eta).total;
      return cost.EvaluateWithGradient(eta, *gradient).total;
    };
    return search;
  }

  // α² at the corner of the L-curve, each point of which is a minimum of its own.
  absl::Status ChooseRegularization(const Stop& stop) {
    Matrix starts = design_.reference.transpose();
    const auto minimum = [&](double regularization) {
      const Cost cost = request_.expansion->MakeCost(regularization);
      const Minimum best =
          FindMinima(MinimizationOf(cost), starts, MinimizerOptions(), stop).front();
      starts = best.point.transpose();
      return cost.Evaluate(best.point);
    };
    regularization_ = ChooseByLCurve(minimum, prior_).regularization;
    return stop.Check();
  }

  absl::Status SamplePosteriorOf(const Cost& cost, const Stop& stop) {
    Vector lower, upper;
    SamplingBox(design_, lower, upper);
    SamplerOptions options;
    options.particles = kParticles;
    options.seed = kSeed;
    options.sweeps = kSweeps;
    options.total_sweeps = kTotalSweeps;
    POLYEST_ASSIGN_OR_RETURN(
        particles_, SamplePosterior(cost, lower, upper,
                                    design_.region.ManyToLocal(*request_.guesses), options, stop));
    return absl::OkStatus();
  }

  // J's Hessian with respect to the germ: H_ξ = axes⁻ᵀ H_η axes⁻¹.
  Matrix ToGermHessian(const Matrix& hessian) const {
    const Matrix inverse = design_.region.axes().inverse();
    return inverse.transpose() * hessian * inverse;
  }

  bool Isolated(const Cost& cost, const Vector& eta) const {
    const Vector unit = prior_.GermStandardDeviation();
    const Matrix scaled = unit.asDiagonal() * ToGermHessian(cost.Hessian(eta)) * unit.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<Matrix>(scaled).eigenvalues().minCoeff() >
           kIsolatedCurvature;
  }

  void NoteOtherMinima(const Cost& cost, const std::vector<Minimum>& minima) {
    for (size_t i = 1; i < minima.size(); ++i) {
      if (minima[i].value - minima[0].value > kComparableCost) continue;
      if (!minima[i].converged || !Isolated(cost, minima[i].point)) continue;
      findings_.other_minima.push_back(prior_.ToParameters(design_.region.ToGerm(minima[i].point)));
    }
  }

  void Summarize(const Cost& cost, const Vector& eta) {
    const RecordSummary& record = *request_.record;
    const Agreement agreement = AgreementWithModel(*request_.expansion, cost);
    findings_.shift = agreement.shift;
    estimate_.expansion = {design_.basis->order(),       design_.basis->size(),
                           request_.expansion->points(), agreement.residual_to_noise,
                           request_.reexpansions,        0};
    if (record.rows() > 0) {
      estimate_.expansion.trajectories =
          (request_.propagated_rows + record.rows() / 2) / record.rows();
    }
    estimate_.time_s = record.time_s();
    estimate_.samples = record.samples();
    estimate_.regularization = regularization_;
    estimate_.cost = cost.Evaluate(eta);
  }

  void DescribeParameters(const Cost& cost, const Vector& eta) {
    const Vector informed = ContractionByData(cost, eta);
    const double widening =
        findings_.shift > kInaccurateShift ? std::sqrt(1 + findings_.shift * findings_.shift) : 1;
    DescribeSpread(cost, eta, informed, widening);
    estimate_.directions = Directions(ToGermHessian(cost.MismatchHessian(eta)), prior_);
    const Vector map = prior_.ToParameters(findings_.map_xi);
    const Vector prior_mean = prior_.Mean();
    const Vector prior_deviation = prior_.StandardDeviation();
    Matrix scores = design_.region.ManyToGerm(particles_.etas);
    if (prior_.correlated()) scores *= prior_.factor().transpose();
    for (int i = 0; i < prior_.dimension(); ++i) {
      ParameterEstimate parameter;
      parameter.name = prior_.parameters()[static_cast<size_t>(i)].name;
      parameter.unit = problem_.units()[static_cast<size_t>(i)];
      parameter.map = map[i];
      parameter.std_dev = deviation_[i];
      parameter.prior_mean = prior_mean[i];
      parameter.prior_std_dev = prior_deviation[i];
      parameter.contraction = deviation_[i] / prior_deviation[i];
      parameter.verdict = VerdictOfContraction(std::min(1.0, widening * informed[i]));
      DescribePosterior(scores.col(i), i, widening, parameter);
      estimate_.parameters.push_back(std::move(parameter));
    }
  }

  // Covariance and standard deviations: never above the prior's. Where the map of a parameter is
  // curved its slope at the estimate scales what is known of it: a parameter that the data do not
  // identify then has the prior's own standard deviation, wherever they drew it.
  void DescribeSpread(const Cost& cost, const Vector& eta, const Vector& informed,
                      double widening) {
    const Curvature curvature =
        CovarianceFromCurvature(ToGermHessian(cost.Hessian(eta)), prior_, findings_.map_xi);
    const Vector prior_deviation = prior_.StandardDeviation();
    deviation_ = (widening * curvature.standard_deviation).cwiseMin(prior_deviation);
    for (int i = 0; i < prior_.dimension(); ++i) {
      const Verdict verdict = VerdictOfContraction(std::min(1.0, widening * informed[i]));
      if (prior_.IsCurved(i) && verdict == Verdict::kNotIdentified) {
        deviation_[i] = prior_deviation[i];
      }
    }
    const Vector factor = deviation_.cwiseQuotient(curvature.standard_deviation);
    estimate_.covariance = factor.asDiagonal() * curvature.covariance * factor.asDiagonal();
  }

  // Posterior ÷ prior standard deviation of the scores as far as it is the data's doing: the larger
  // of what the curvature gives with the prior at its own weight, whatever α² is (a heavy prior
  // narrows the posterior, but that is not knowledge), and of
  //   (H_mismatch + Σ_prior⁻¹)⁻¹,
  // in which a skewed prior's sharp mode does not pass for information either.
  Vector ContractionByData(const Cost& cost, const Vector& eta) const {
    const Vector& xi = findings_.map_xi;
    const Matrix mismatch = ToGermHessian(cost.MismatchHessian(eta));
    Matrix curved = mismatch;
    curved.diagonal() += prior_.Curvature(xi);
    Matrix spread = mismatch;
    spread.diagonal() += prior_.GermStandardDeviation().cwiseAbs2().cwiseInverse();
    return CovarianceFromCurvature(curved, prior_, xi)
        .contraction.cwiseMax(CovarianceFromCurvature(spread, prior_, xi).contraction);
  }

  // Mean and quantiles of one parameter from its particles' scores, widened about their mean but
  // not past Ω.
  void DescribePosterior(const Vector& scores, int i, double widening,
                         ParameterEstimate& parameter) const {
    const double centre = scores.mean();
    const auto limit = [&](double probability) {
      const double z = centre + widening * (QuantileOfSamples(scores, probability) - centre);
      return prior_.OfScore(i, std::clamp(z, prior_.lower()[i], prior_.upper()[i]));
    };
    parameter.mean = prior_.IsCurved(i)
                         ? scores.unaryExpr([&](double z) { return prior_.OfScore(i, z); }).mean()
                         : prior_.OfScore(i, centre);
    parameter.lower95 = limit(0.025);
    parameter.upper95 = limit(0.975);
  }

  void DescribeChannels(const Cost& cost, const Vector& eta) {
    const Vector d = cost.BasisDifference(eta);
    for (int c = 0; c < problem_.channels(); ++c) {
      ChannelEstimate channel;
      channel.output = problem_.problem().measured[static_cast<size_t>(c)].output;
      channel.chi_squared = request_.expansion->ChannelSums(c).ChiSquared(d);
      if (!request_.record->channels().empty()) {
        const RecordSummary::Channel& summary = request_.record->channels()[static_cast<size_t>(c)];
        channel.samples = summary.samples;
        channel.noise_std_dev = summary.RootMeanSquareNoise();
      }
      estimate_.channels.push_back(std::move(channel));
    }
  }

  const ResolvedProblem& problem_;
  const Prior& prior_;
  const AssessmentRequest& request_;
  const ExpansionDesign& design_;
  double regularization_ = 1;
  Particles particles_;
  Vector deviation_;  // of the parameters
  Findings findings_;
  Estimate estimate_;
};

}  // namespace

absl::StatusOr<Estimate> Assess(const AssessmentRequest& request, const Stop& stop) {
  return Assessment(request).Run(stop);
}

}  // namespace polyest
