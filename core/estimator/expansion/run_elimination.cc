#include "core/estimator/expansion/run_elimination.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "core/bayes/domain_cover.h"
#include "core/chaos/collocation_points.h"
#include "core/common/infeasible.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/expansion/population_of_runs.h"
#include "core/estimator/expansion/replay.h"
#include "core/estimator/expansion/run_marginal.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {
namespace {

constexpr double kHalfWidth = 4;  // of the region of a run's own germs, standard deviations
constexpr int kMaxEliminations = 5;
constexpr int kPointsPerTerm = 3;  // of the shared germs
constexpr double kWithinDomain = 1 - 1e-9;
// What a population is told of a run that is expanded over all that its own data leave open: the
// expansion's error squared, in units of the noise, from which on its order is raised.
constexpr double kMaxOwnError = 1e-4;
// Ratio of a score's standard deviation to that for which the region was chosen.
constexpr double kMinScoreRatio = 0.6, kMaxScoreRatio = 1.25;

// One run, expanded about a path.
class Elimination {
 public:
  Elimination(const ResolvedProblem& problem, const LearnedNoise& noise, const EndedRuns& ended)
      : problem_(problem),
        noise_(noise),
        ended_(ended),
        shared_(problem.SharedParameters()),
        own_(problem.OwnParameters(problem.runs() - 1)),
        n_shared_(std::ssize(shared_)),
        n_own_(std::ssize(own_)),
        truncation_(FirstTruncation(problem.problem().expansion, problem.dimension())) {}

  absl::Status Expand(const RunPath& path, const SampleStore& store, const RunRows& rows,
                      int threads, const Stop& stop);
  // Raises the order of the next expansion if the present one is not accurate enough.
  bool RaiseOrder();
  absl::Status FindMinima();
  bool IsWithinRegion() const;
  RunPath PathFound() const;
  // Adds the run, whose path is the one found.
  absl::Status AddTo(const RunPath& path, const Stop& stop, EndedRuns& ended) const;
  int64_t propagated() const { return expansion_->propagated_rows(); }

 private:
  Region JointRegion(const RunPath& path) const;
  LearnedNoise NoiseAbout(const Vector& centre) const;
  Matrix SharedPoints() const;
  Cost OwnCost() const;
  Matrix OwnDirections() const;
  Vector Origin(const ConstVectorRef& eta_shared) const;
  bool IsScoreWithinRegion() const;
  double SharedPrior(const Vector& xi) const;
  Vector StartAt(const ConstVectorRef& eta_shared) const;
  Vector SpentDegrees() const;
  Matrix BoxOfOwn() const;
  Matrix AlongPath(CollocationMatrix& matrix) const;
  std::vector<ChannelSums> AddSumsTo(EndedRuns& ended, const Matrix& transfer) const;
  Vector Remainder(const Cost& cost, const RunMarginal& marginal,
                   const std::vector<ChannelSums>& sums, const Matrix& terms) const;

  const ResolvedProblem& problem_;
  const LearnedNoise& noise_;
  const EndedRuns& ended_;
  std::vector<int> shared_, own_;
  Eigen::Index n_shared_, n_own_;
  Truncation truncation_;
  std::unique_ptr<RegionalExpansion> expansion_;
  RunPath path_;
  Matrix points_;                           // of the shared germs, local coordinates
  std::vector<ConditionalMinimum> minima_;  // at the points, then at the centre
  std::optional<ScoreLikelihood> score_;    // at the centre, of a run in a population
};

Region Elimination::JointRegion(const RunPath& path) const {
  Vector centre(n_shared_ + n_own_);
  centre(shared_) = ended_.region.centre();
  centre(own_) = path.centre;
  Matrix axes = Matrix::Zero(n_shared_ + n_own_, n_shared_ + n_own_);
  axes(shared_, Eigen::seqN(0, n_shared_)) = ended_.region.axes();
  axes(own_, Eigen::seqN(0, n_shared_)) = path.slope * ended_.region.axes();
  axes(own_, Eigen::seqN(n_shared_, n_own_)) = kHalfWidth * path.spread;
  return Region(std::move(centre), std::move(axes));
}

// Outliers are judged, and relative noise is predicted, at the centre of the path.
LearnedNoise Elimination::NoiseAbout(const Vector& centre) const {
  LearnedNoise noise = noise_;
  noise.misfit = noise.misfit_of_weights = 1;
  for (Eigen::Index c = 0; c < ended_.noise_scale.size(); ++c) {
    ChannelNoise& channel = noise.channels[static_cast<size_t>(c)];
    channel.scale = ended_.noise_scale[c];
    channel.time_constant_s = ended_.noise_time_constant_s[c];
    channel.white_share = ended_.noise_white_share[c];
    channel.grid = {};
  }
  noise.centre = centre;
  if (noise.posterior.centre.size() == 0) return noise;
  noise.posterior.centre = centre;
  noise.posterior.factor = Matrix::Zero(centre.size(), centre.size());
  noise.posterior.factor(shared_, Eigen::seqN(0, n_shared_)) = ended_.factor;
  noise.posterior.factor(own_, Eigen::seqN(0, n_shared_)) = path_.slope * ended_.factor;
  noise.posterior.factor(own_, Eigen::seqN(n_shared_, n_own_)) = path_.spread;
  return noise;
}

absl::Status Elimination::Expand(const RunPath& path, const SampleStore& store, const RunRows& rows,
                                 int threads, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckFinite(path, rows.run));
  path_ = path;
  const Region region = JointRegion(path);
  const Vector centre = NearestInside(problem_.prior(), region.centre());
  ExpansionDesign design =
      DesignForRegion(problem_, truncation_, region, MiddleInside(problem_.prior(), region));
  POLYEST_ASSIGN_OR_RETURN(expansion_, RegionalExpansion::Make(problem_, &store, std::move(design),
                                                               NoiseAbout(centre), threads, stop));
  expansion_->BeginAt(rows.first);
  POLYEST_RETURN_IF_ERROR(TakeRows(store, rows.end, stop, *expansion_));
  expansion_->EndRun();
  return absl::OkStatus();
}

bool Elimination::RaiseOrder() {
  if (!problem_.population() || !(expansion_->absorbed().OwnError() > kMaxOwnError)) return false;
  const auto next = NextTruncation(problem_.problem().expansion, problem_.dimension(), truncation_);
  if (!next) return false;
  truncation_ = *next;
  return true;
}

// The noise counts as known: one run alone tells little of it.
Cost Elimination::OwnCost() const {
  std::vector<ChannelSums> sums = expansion_->sums();
  for (ChannelSums& channel : sums) channel.scale_unknown = channel.correlation_unknown = false;
  const ExpansionDesign& design = expansion_->design();
  return Cost(design.basis, design.region, design.reference, Mismatch(sums), problem_.prior(),
              problem_.problem().regularization);
}

Matrix Elimination::OwnDirections() const {
  return Matrix::Identity(n_shared_ + n_own_, n_shared_ + n_own_).rightCols(n_own_);
}

Vector Elimination::Origin(const ConstVectorRef& eta_shared) const {
  Vector eta = Vector::Zero(n_shared_ + n_own_);
  eta.head(n_shared_) = eta_shared;
  return eta;
}

// Returns collocation points of the shared germs; those outside Ω are moved inside.
Matrix Elimination::SharedPoints() const {
  const int count = kPointsPerTerm * ended_.basis->size();
  Matrix points =
      2 * UnitCubePoints(PointSet::kHalton, static_cast<int>(n_shared_), count).array() - 1;
  const Vector inside = MiddleInside(problem_.prior(), expansion_->design().region);
  for (Eigen::Index q = 0; q < count; ++q) {
    Vector xi = inside;
    xi(shared_) = ended_.region.ToGerm(points.row(q).transpose());
    const double fraction = FractionInDomain(problem_.prior(), xi, inside);
    if (!(fraction < 1)) continue;
    xi = inside + kWithinDomain * fraction * (xi - inside);
    points.row(q) = ended_.region.ToLocal(xi(shared_)).transpose();
  }
  return points;
}

// Returns η_φ of the path at η_θ, in Ω.
Vector Elimination::StartAt(const ConstVectorRef& eta_shared) const {
  const Region& region = expansion_->design().region;
  const Vector xi = region.ToGerm(Origin(eta_shared));
  return region.ToLocal(NearestInside(problem_.prior(), xi)).tail(n_own_);
}

absl::Status Elimination::FindMinima() {
  points_ = SharedPoints();
  const Cost cost = OwnCost();
  const RunMarginal marginal(cost, OwnDirections());
  minima_.clear();
  for (Eigen::Index q = 0; q < points_.rows(); ++q) {
    const Vector point = points_.row(q).transpose();
    minima_.push_back(marginal.Minimize(Origin(point), StartAt(point)));
  }
  const Vector middle = Vector::Zero(n_shared_);
  minima_.push_back(marginal.Minimize(Origin(middle), StartAt(middle)));
  for (const ConditionalMinimum& minimum : minima_) {
    if (std::isfinite(minimum.value) && minimum.own.allFinite()) continue;
    return InfeasibleError("the parameters of a run that has ended were not found");
  }
  if (problem_.population()) {
    score_ = ScoreLikelihoodOf(problem_, cost, middle, minima_.back());
  }
  return absl::OkStatus();
}

// Whether the run was expanded where its own parameters are: the minimum within the region, at
// which the standard deviation is a quarter of the half width, to a factor of 2.
bool Elimination::IsWithinRegion() const {
  for (const ConditionalMinimum& minimum : minima_) {
    if (minimum.own.cwiseAbs().maxCoeff() > 1) return false;
  }
  if (score_ && (n_own_ == 1 || !IsScoreWithinRegion())) return IsScoreWithinRegion();
  const Vector deviation = Inverse(minima_.back().hessian).diagonal().cwiseSqrt() * kHalfWidth;
  return deviation.maxCoeff() < 2 && deviation.minCoeff() > 0.5;
}

// The score's posterior may be skewed, so that its mean and variance count.
bool Elimination::IsScoreWithinRegion() const {
  const Eigen::Index own = problem_.population()->own;
  const double spread = path_.spread.row(own).norm();
  const double ratio = std::sqrt(score_->posterior().variance) / spread;
  return ratio > kMinScoreRatio && ratio < kMaxScoreRatio &&
         std::abs(score_->posterior().mean - path_.centre[own]) < spread;
}

// Returns 4 spread, the axes of the own germs.
Matrix Elimination::BoxOfOwn() const {
  return expansion_->design().region.axes()(own_, Eigen::seqN(n_shared_, n_own_));
}

// dη̂_φ/dη_θ = −H_φφ⁻¹ H_φθ
RunPath Elimination::PathFound() const {
  const ConditionalMinimum& minimum = minima_.back();
  Vector eta = Vector::Zero(n_shared_ + n_own_);
  eta.tail(n_own_) = minimum.own;
  const Matrix hessian = OwnCost().Hessian(eta);
  const Matrix inverse = Inverse(minimum.hessian);
  const Matrix follows = -(inverse * hessian.bottomLeftCorner(n_own_, n_shared_));
  const Matrix box = BoxOfOwn();
  RunPath path;
  path.centre = expansion_->design().region.ToGerm(eta)(own_);
  path.slope = path_.slope + box * follows * Inverse(ended_.region.axes());
  FreeOfPopulation(problem_, path.slope);
  const Vector unit = problem_.prior().GermStandardDeviation()(own_);
  // Where it is wider than the prior, the integrand is not a Gaussian.
  path.spread = SpreadOf(NoWiderThan(unit, box * inverse * box.transpose()), unit);
  if (score_) SetScore(problem_, score_->posterior(), path);
  return path;
}

double Elimination::SharedPrior(const Vector& xi) const {
  double prior = 0;
  for (const int j : shared_) {
    prior -= problem_.prior().germs()[static_cast<size_t>(j)].LogDensity(xi[j]);
  }
  return problem_.problem().regularization * prior;
}

// Returns E at the points: −log of the integral over the own germs without the prior of the shared
// ones, less what the sums of the shared terms give there.
Vector Elimination::Remainder(const Cost& cost, const RunMarginal& marginal,
                              const std::vector<ChannelSums>& sums, const Matrix& terms) const {
  const Vector at_centre = TermsAtCentre(ended_);
  const double volume = LuFactors(BoxOfOwn()).LogAbsDeterminant();
  Vector remainder(points_.rows());
  for (Eigen::Index q = 0; q < points_.rows(); ++q) {
    const Vector eta = Origin(points_.row(q).transpose());
    const Vector d = terms.row(q).transpose() - at_centre;
    double mismatch = 0;
    for (const ChannelSums& channel : sums) mismatch += 0.5 * channel.samples.ChiSquared(d);
    remainder[q] = marginal.NegativeLogIntegral(eta, minima_[static_cast<size_t>(q)]) - volume -
                   SharedPrior(cost.region().ToGerm(eta)) - mismatch;
  }
  return remainder;
}

// Returns tr(H_φφ⁻¹ ∂_φᵀ G_c ∂_φ) at the centre for each channel.
Vector Elimination::SpentDegrees() const {
  const ExpansionDesign& design = expansion_->design();
  Vector eta = Vector::Zero(n_shared_ + n_own_);
  eta.tail(n_own_) = minima_.back().own;
  Vector phi(design.basis->size());
  Matrix gradient(design.basis->size(), eta.size());
  design.basis->EvaluateWithGradient(eta, phi, gradient);
  const Matrix by_own = gradient.rightCols(n_own_);
  const Matrix inverse = Inverse(minima_.back().hessian);
  Vector spent(problem_.channels());
  for (int c = 0; c < problem_.channels(); ++c) {
    const Matrix& g = expansion_->sums()[static_cast<size_t>(c)].samples.G();
    const double share = (inverse * (by_own.transpose() * g * by_own)).trace();
    spent[c] = std::clamp(share, 0.0, static_cast<double>(n_own_));
  }
  return spent;
}

// Returns the points on the polynomial that fits the minima best: at a bound of Ω these have a
// kink, which no terms would follow.
Matrix Elimination::AlongPath(CollocationMatrix& matrix) const {
  Matrix minima(points_.rows(), n_own_), path(matrix.terms(), n_own_);
  for (Eigen::Index q = 0; q < points_.rows(); ++q) {
    minima.row(q) = minima_[static_cast<size_t>(q)].own.transpose();
  }
  Vector kinks(n_own_);
  matrix.Solve(minima, path, kinks);
  Matrix along(points_.rows(), n_shared_ + n_own_);
  along << points_, matrix.matrix() * path;
  return along;
}

// Adds the run's sums in the terms of the shared germs and returns them.
std::vector<ChannelSums> Elimination::AddSumsTo(EndedRuns& ended, const Matrix& transfer) const {
  const ExpansionDesign& design = expansion_->design();
  Vector reference(design.basis->size());
  design.basis->Evaluate(design.reference, reference);
  const Vector shift = transfer.transpose() * TermsAtCentre(ended) - reference;
  std::vector<ChannelSums> sums = expansion_->sums();
  const Vector spent = SpentDegrees();
  for (size_t c = 0; c < sums.size(); ++c) {
    sums[c].samples = sums[c].samples.Substituted(transfer, shift);
    sums[c].differences = sums[c].differences.Substituted(transfer, shift);
    ended.sums[c].samples.Add(sums[c].samples);
    ended.sums[c].differences.Add(sums[c].differences);
    ended.sums[c].surplus += sums[c].surplus;
    ended.sums[c].spent += spent[static_cast<Eigen::Index>(c)];
  }
  return sums;
}

absl::Status Elimination::AddTo(const RunPath& path, const Stop& stop, EndedRuns& ended) const {
  const ExpansionDesign& design = expansion_->design();
  POLYEST_ASSIGN_OR_RETURN(CollocationMatrix matrix,
                           CollocationMatrix::Factor(*ended.basis, points_, stop));
  Matrix phi;
  design.basis->EvaluateMany(AlongPath(matrix), phi);
  Matrix transfer(ended.basis->size(), phi.cols());
  Vector residual(phi.cols());
  matrix.Solve(phi, transfer, residual);
  const std::vector<ChannelSums> sums = AddSumsTo(ended, transfer);
  const Cost cost = OwnCost();
  const RunMarginal marginal(cost, OwnDirections());
  const Matrix values = Remainder(cost, marginal, sums, matrix.matrix());
  if (!values.allFinite()) {
    return InfeasibleError("the likelihood of a run that has ended vanishes");
  }
  Matrix coefficients(ended.basis->size(), 1);
  Vector ignored(1);
  matrix.Solve(values, coefficients, ignored);
  ended.remainder += coefficients.col(0);
  expansion_->AddCountsTo(ended);
  if (!score_) {
    const WindowSums& windows = expansion_->windows();
    const WindowSpan &first = windows.span(0), &last = windows.span(windows.count() - 1);
    ended.windows.EndRow(SumsWithRemainder(problem_.problem().measured, ended), first.first_run,
                         first.start_s, last.end_s);
  } else {
    TellPopulation(problem_, cost, path, *score_, ended);
    const double own_error = expansion_->absorbed().OwnError();
    if (own_error > kMaxOwnError) ended.unresolved += own_error;
    if (!IsScoreWithinRegion()) ended.unresolved += 1;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<int64_t> EliminateRun(const EliminationRequest& request, const RunRows& rows,
                                     const RunPath& path, const Stop& stop, EndedRuns& ended) {
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem problem, request.problem->OfRun(rows.run));
  Elimination elimination(problem, request.noise, ended);
  RunPath present = path;
  int64_t propagated = 0;
  for (int attempt = 1;; ++attempt) {
    POLYEST_RETURN_IF_ERROR(
        elimination.Expand(present, *request.store, rows, request.threads, stop));
    propagated += elimination.propagated();
    if (elimination.RaiseOrder()) {
      --attempt;
      continue;
    }
    POLYEST_RETURN_IF_ERROR(elimination.FindMinima());
    present = elimination.PathFound();
    if (elimination.IsWithinRegion() || attempt == kMaxEliminations) break;
  }
  POLYEST_RETURN_IF_ERROR(elimination.AddTo(present, stop, ended));
  ended.Append(rows.run, rows.first, rows.end, present);
  return propagated;
}

}  // namespace polyest::internal
