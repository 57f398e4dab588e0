#include "core/estimator/posterior/noise_marginal.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/bayes/factored_sums.h"
#include "core/bayes/mismatch.h"
#include "core/bayes/pareto_tail.h"
#include "core/bayes/weighted_samples.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Prior probabilities of white noise and of noise without a white share; the rest is white in part.
constexpr double kOfWhite = 1.0 / 6;
constexpr double kOfCorrelated = 4.0 / 6;
// Members that have less than e^−9 of the best one's probability do not matter.
constexpr double kNegligibleMember = 9;
// Share of the effective number of draws that the factors must leave, and the shape of the weights'
// tail up to which their variance is finite (pareto_tail.h). The number alone would not tell: where
// draws are too narrow, it is large until one falls far out.
constexpr double kEnough = 0.5;
constexpr double kMaxShape = 0.5;
// Least power of the likelihood from which is drawn.
constexpr double kWidestPower = 1.0 / 16;
// If the expansion's own error makes up more than this share of χ², the noise is not known.
constexpr double kMaxOwnError = 0.8;
// Draws whose matrices are computed together.
constexpr Eigen::Index kBlock = 128;

double LogOdds(double share) { return std::log(share / (1 - share)); }

// Whether the neighbours of the present noise stand for another: the alike ones' time constants are
// in the ratio 2.
bool IsOnRidge(const NoiseShape& noise, const NoiseShape& present) {
  const double x = std::log(noise.time_constant_s / present.time_constant_s);
  const double y = LogOdds(noise.white_share) - LogOdds(present.white_share);
  return std::abs(x) < 2.5 * std::log(2) && std::abs(x + y) < 1.5 * kStepOfShare;
}

// Adds the trapezoidal rule for noise without a white share: the grid and the present noise.
void AddCorrelated(const CorrelationProfile& profile, const TimeConstantGrid& grid,
                   Vector& probabilities) {
  struct Node {
    double position;
    size_t member;
  };
  std::vector<Node> nodes;
  for (int step = 0; step < TimeConstantGrid::kSteps; ++step) {
    nodes.push_back(
        {std::log(grid.At(step)), CorrelationProfile::kFirstOfGrid + static_cast<size_t>(step)});
  }
  const double lowest = nodes.front().position, highest = nodes.back().position;
  const NoiseShape& present = profile.shapes()[CorrelationProfile::kPresent];
  if (present.time_constant_s > 0 && present.white_share == 0) {
    const double position = std::clamp(std::log(present.time_constant_s), lowest, highest);
    nodes.push_back({position, CorrelationProfile::kPresent});
  }
  std::ranges::sort(nodes, {}, &Node::position);
  for (size_t i = 0; i < nodes.size(); ++i) {
    const double below = nodes[i > 0 ? i - 1 : i].position;
    const double above = nodes[std::min(i + 1, nodes.size() - 1)].position;
    probabilities[static_cast<Eigen::Index>(nodes[i].member)] =
        kOfCorrelated * 0.5 * (above - below) / (highest - lowest);
  }
}

// Adds noise that is white in part: the cells of the grid, but near the present noise, if that is
// white in part, its neighbours of other shares and of those alike over short times. The likelihood
// often is a narrow ridge along the latter, which the grid misses.
void AddMixed(const CorrelationProfile& profile, const TimeConstantGrid& grid,
              Vector& probabilities) {
  const NoiseShape& present = profile.shapes()[CorrelationProfile::kPresent];
  constexpr int kTimeConstants = TimeConstantGrid::kSteps / TimeConstantGrid::kStride;
  constexpr double kCell =
      (1 - kOfWhite - kOfCorrelated) / (kTimeConstants * TimeConstantGrid::kShares);
  for (size_t i = CorrelationProfile::kFirstMixed; i < CorrelationProfile::kFirstNeighbour; ++i) {
    if (profile.HasNeighbours() && IsOnRidge(profile.shapes()[i], present)) continue;
    probabilities[static_cast<Eigen::Index>(i)] = kCell;
  }
  if (!profile.HasNeighbours()) return;
  const double tau = present.time_constant_s;
  const double width = TimeConstantGrid::kStride * std::log(grid.At(1) / grid.At(0));
  const double height = LogOdds(grid.ShareAt(tau, 1)) - LogOdds(grid.ShareAt(tau, 0));
  const double cell = kCell * std::log(2) * kStepOfShare / (width * height);
  const size_t first = CorrelationProfile::kFirstNeighbour;
  for (size_t i = first; i < profile.shapes().size(); ++i) {
    const bool other_share = i < first + 9 && (i - first) / 3 == 1;
    const bool alike = i >= first + 9 && profile.shapes()[i].time_constant_s <= grid.longest_s;
    if (other_share || alike) probabilities[static_cast<Eigen::Index>(i)] = cell;
  }
}

// Returns, for each row δ, the products of any two elements of v = (δ, −1), of which χ² is a linear
// function: v_i v_j, i ≤ j, at ½ j (j + 1) + i.
Matrix Monomials(const ConstMatrixRef& deltas) {
  const Eigen::Index n = deltas.cols();
  Matrix extended(deltas.rows(), n + 1);
  extended << deltas, Vector::Constant(deltas.rows(), -1);
  Matrix monomials(deltas.rows(), (n + 1) * (n + 2) / 2);
  for (Eigen::Index j = 0, pair = 0; j <= n; ++j) {
    for (Eigen::Index i = 0; i <= j; ++i, ++pair) {
      monomials.col(pair) = extended.col(i).cwiseProduct(extended.col(j));
    }
  }
  return monomials;
}

// Returns the coefficients of χ² as a function of the monomials. `gram` is its upper triangle.
Vector OfMonomials(const Matrix& gram) {
  const Eigen::Index n = gram.rows() - 1;
  Vector coefficients((n + 1) * (n + 2) / 2);
  for (Eigen::Index j = 0, pair = 0; j <= n; ++j) {
    for (Eigen::Index i = 0; i <= j; ++i, ++pair) {
      coefficients[pair] = (i == j ? 1 : 2) * gram(i, j);
    }
  }
  return coefficients;
}

// Returns the width of the central 95 %. Unlike the standard deviation it does not depend on long
// time constants that are hardly probable.
double IntervalWidth(const ConstVectorRef& draws, const Vector& weights) {
  const WeightedQuantiles quantile(draws, weights);
  return quantile(0.975) - quantile(0.025);
}

}  // namespace

Vector NoiseProbabilities(const CorrelationProfile& profile, const TimeConstantGrid& grid) {
  Vector probabilities = Vector::Zero(static_cast<Eigen::Index>(profile.shapes().size()));
  probabilities[CorrelationProfile::kWhite] = kOfWhite;
  AddCorrelated(profile, grid, probabilities);
  AddMixed(profile, grid, probabilities);
  return probabilities / probabilities.sum();
}

NoiseMarginal::NoiseMarginal(const ResolvedProblem& problem, const RegionalExpansion& expansion)
    : expansion_(expansion) {
  // A profile has nothing of runs that have been eliminated, and the likelihood has.
  if (problem.ended_runs() != nullptr) return;
  const Matrix unit = Inverse(expansion.design().region.axes()) *
                      problem.prior().GermStandardDeviation().asDiagonal();
  for (int c = 0; c < problem.channels(); ++c) {
    const auto channel = static_cast<size_t>(c);
    const ChannelNoise& noise = expansion.noise().channels[channel];
    const ChannelSums& sums = expansion.sums()[channel];
    const CorrelationProfile& profile = expansion.Profile(c);
    if (!noise.learned || profile.empty() || sums.samples.count() == 0) continue;
    if (expansion.Discount(c) > kMaxOwnError * sums.Degrees()) continue;
    Add(sums, profile, noise.grid, unit);
  }
}

void NoiseMarginal::Add(const ChannelSums& sums, const CorrelationProfile& profile,
                        const TimeConstantGrid& grid, const Matrix& unit) {
  const Vector probabilities = NoiseProbabilities(profile, grid);
  const std::vector<CorrelationProfile::Member> members = profile.Members();
  const auto samples = static_cast<double>(sums.samples.count());
  Vector heights = Vector::Constant(probabilities.size(), kInfinity);
  for (Eigen::Index i = 0; i < heights.size(); ++i) {
    if (!(probabilities[i] > 0)) continue;
    const ProfileValue value =
        EvaluateMember(members[static_cast<size_t>(i)], samples, unit, sums.scale_unknown);
    heights[i] = value.negative_log_likelihood - std::log(probabilities[i]);
  }
  const double best = heights.minCoeff();
  if (!std::isfinite(best)) return;
  // The minimum of χ² and of the prior, so that it exists.
  const Matrix present = members[CorrelationProfile::kPresent].gram.selfadjointView<Eigen::Upper>();
  const Eigen::Index n = unit.rows();
  const CholeskyFactor factor(Matrix::Identity(n, n) +
                              unit.transpose() * present.topLeftCorner(n, n) * unit);
  if (!factor.positive_definite()) return;
  Channel channel{&sums,
                  OfMonomials(present),
                  unit * factor.Solve(unit.transpose() * present.col(n).head(n)),
                  {},
                  {}};
  const auto count = (heights.array() < best + kNegligibleMember).count();
  channel.heights.resize(count);
  channel.grams.resize(channel.present.size(), count);
  for (Eigen::Index i = 0, column = 0; i < heights.size(); ++i) {
    if (!(heights[i] < best + kNegligibleMember)) continue;
    const CorrelationProfile::Member& member = members[static_cast<size_t>(i)];
    channel.heights[column] = member.log_determinant - std::log(probabilities[i]);
    channel.grams.col(column++) = OfMonomials(member.gram);
  }
  channels_.push_back(std::move(channel));
}

// Adds the factors of draws whose δ are the rows of `deltas` and whose χ² and squared differences
// are those of the expansion.
void NoiseMarginal::AddFactors(const Channel& channel, Matrix deltas, const Vector& chi_squared,
                               const Vector& lags, VectorRef factors) const {
  const ChannelSums& sums = *channel.sums;
  const double least = (Monomials(channel.minimum.transpose()) * channel.present).value();
  const Vector linear = Monomials(deltas) * channel.present;
  for (Eigen::Index i = 0; i < factors.size(); ++i) {
    const double above = linear[i] - least;
    const double share = above > 0 ? std::clamp((chi_squared[i] - least) / above, 0.0, 1.0) : 1;
    deltas.row(i) = channel.minimum.transpose() +
                    std::sqrt(share) * (deltas.row(i) - channel.minimum.transpose());
    if (!sums.correlation_unknown) continue;
    // The cost has one lag integrated out, in place of which the profile stands.
    const auto likelihood = [&](bool correlated) {
      return NegativeLogLikelihood(sums.Degrees(), std::max(kMinMeanSquare, chi_squared[i]),
                                   lags[i], sums.scale_unknown, correlated);
    };
    factors[i] += likelihood(true) - likelihood(false);
  }
  const Matrix monomials = Monomials(deltas);
  Eigen::ArrayXXd logs = (monomials * channel.grams).array().max(kMinMeanSquare);
  Eigen::ArrayXd present = (monomials * channel.present).array().max(kMinMeanSquare);
  const double half = 0.5 * (sums.scale_unknown ? static_cast<double>(sums.samples.count()) : 1);
  if (sums.scale_unknown) {
    logs = logs.log();
    present = present.log();
  }
  logs = (-half * logs).rowwise() - channel.heights.transpose().array();
  const Eigen::ArrayXd most = logs.rowwise().maxCoeff();
  factors.array() += half * present + most + (logs.colwise() - most).exp().rowwise().sum().log();
}

Vector NoiseMarginal::LogFactors(const ConstMatrixRef& etas) const {
  const ExpansionDesign& design = expansion_.design();
  Vector reference(design.basis->size());
  design.basis->Evaluate(design.reference, reference);
  Vector factors = Vector::Zero(etas.rows());
  Matrix differences, product;
  for (const Channel& channel : channels_) {
    const FactoredSums samples(&channel.sums->samples, /*relative=*/true);
    const FactoredSums lags(&channel.sums->differences, /*relative=*/true);
    const bool lagged = channel.sums->correlation_unknown;
    for (Eigen::Index first = 0; first < etas.rows(); first += kBlock) {
      const Eigen::Index count = std::min(kBlock, etas.rows() - first);
      const Matrix block = etas.middleRows(first, count);
      design.basis->EvaluateMany(block, differences);
      differences.rowwise() -= reference.transpose();
      Vector chi_squared(count), lag = Vector::Zero(count);
      samples.ChiSquaredMany(differences, product, chi_squared);
      if (lagged) lags.ChiSquaredMany(differences, product, lag);
      AddFactors(channel, block.rowwise() - expansion_.LinearizedAt().transpose(), chi_squared, lag,
                 factors.segment(first, count));
    }
  }
  return factors;
}

absl::StatusOr<Vector> MarginalizeNoise(const ResolvedProblem& problem,
                                        const RegionalExpansion& expansion, const Cost& cost,
                                        const Matrix& guesses, const PosteriorEffort& effort,
                                        const Stop& stop, PosteriorDraws& draws) {
  Vector widening = Vector::Ones(cost.dimension());
  const NoiseMarginal marginal(problem, expansion);
  if (marginal.empty()) return widening;
  const ExpansionDesign& design = expansion.design();
  std::optional<PosteriorDraws> best;
  double least_shape = kInfinity, most = 0;  // of the best, and its number of independent draws
  for (double power = 1; power >= kWidestPower; power /= 2) {
    Cost wider = cost;
    wider.set_power(power * cost.power());
    PosteriorDraws drawn = draws;
    if (power < 1) {
      POLYEST_ASSIGN_OR_RETURN(drawn, DrawPosterior(wider, design, guesses, effort, stop));
    }
    const Matrix etas = design.region.ManyToLocal(drawn.Germs(cost.prior()));
    Vector present, tempered;
    cost.EvaluateMany(etas, present);
    wider.EvaluateMany(etas, tempered);
    const double before = EffectiveSizeOfWeights(drawn.weights);
    Reweigh(tempered - present, drawn);
    const Vector plain = drawn.weights;
    Reweigh(cost.power() * marginal.LogFactors(etas), drawn);
    const double count = EffectiveSizeOfWeights(drawn.weights);
    const double shape =
        std::max(kMaxShape, TailShape(drawn.weights.array().log()).value_or(kMaxShape));
    if (best && (shape > least_shape || (shape == least_shape && count <= most))) continue;
    for (Eigen::Index i = 0; i < widening.size(); ++i) {
      const double before_width = IntervalWidth(drawn.scores.col(i), plain);
      const double width = IntervalWidth(drawn.scores.col(i), drawn.weights);
      widening[i] = before_width > 0 ? width / before_width : 1;
    }
    best = std::move(drawn);
    least_shape = shape;
    most = count;
    if (shape == kMaxShape && count >= kEnough * before) break;
  }
  best->minima = std::move(draws.minima);
  draws = *std::move(best);
  return widening;
}

}  // namespace polyest::internal
