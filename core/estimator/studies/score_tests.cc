#include "core/estimator/studies/score_tests.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "core/bayes/mismatch.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/studies/fixed_quantities.h"
#include "core/estimator/studies/residual_pass.h"
#include "core/estimator/studies/residual_scatter.h"
#include "core/propagation/trajectory_block.h"

namespace polyest::internal {
namespace {

constexpr int64_t kMaxRows = 65'536;
constexpr int64_t kFirstRows = 256;  // from which steps and the sampling interval are found
// A difference of trajectories should be about as large as the noise, in the norm over the record:
// far above the rounding and far below what is not linear.
constexpr double kMinNorm = 0.03, kMaxNorm = 30;
constexpr int kMaxPasses = 4;
// Largest distance of an estimate from the minimum of the cost, in standard deviations. It is not 0
// where the noise's correlation is unknown, since the estimate averages over that.
constexpr double kMaxFromMinimum = 2;
// A quantity is not tested if the uncertain parameters can do all that it does, but for this part
// of |g|².
constexpr double kMinOwn = 1e-6;

bool HasPlainLikelihood(const MeasuredOutput& output) {
  return output.noise.outliers == OutlierHandling::kNone && output.noise.relative == 0;
}

bool AreDefinedFor(const ResolvedProblem& problem) {
  return !problem.uses_filters() && !problem.per_run() && problem.channels() > 0 &&
         dynamic_cast<const StateSpaceModel*>(problem.model().get()) != nullptr &&
         std::ranges::all_of(problem.problem().measured, HasPlainLikelihood);
}

Vector MapOf(const Estimate& estimate) {
  Vector theta(std::ssize(estimate.parameters));
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    theta[i] = estimate.parameters[static_cast<size_t>(i)].map;
  }
  return theta;
}

// Returns the noise with each unknown size set to the root mean square of the estimate's residuals.
// The size with which the record is weighed may differ from that by a quarter, since the cost is
// integrated over it.
absl::StatusOr<std::vector<ChannelNoise>> NoiseOfResiduals(const ResolvedProblem& problem,
                                                           const SampleStore& store, int64_t rows,
                                                           std::vector<ChannelNoise> noise,
                                                           const Estimate& estimate,
                                                           const Stop& stop) {
  const std::vector<MeasuredOutput>& measured = problem.problem().measured;
  const auto is_unknown = [](const MeasuredOutput& output) { return output.noise.unknown; };
  if (std::ranges::none_of(measured, is_unknown)) return noise;
  ResidualScatter scatter(problem.channels());
  const auto add = [&scatter](const Matrix& values, bool begins_run) {
    scatter.Add(values.row(0).transpose(), begins_run);
  };
  POLYEST_RETURN_IF_ERROR(
      ResidualPass(problem, store, noise).Run(MapOf(estimate).transpose(), rows, 0, add, stop));
  for (size_t c = 0; c < measured.size(); ++c) {
    const double mean_square = scatter.MeanSquare(static_cast<Eigen::Index>(c));
    if (!measured[c].noise.unknown || !std::isfinite(mean_square)) continue;
    noise[c].scale *= std::sqrt(std::max(kMinMeanSquare, mean_square));
  }
  return noise;
}

// Returns the Gram matrix of residuals and differences (ResidualPass). A trajectory that fails has
// NaN in its row and column.
absl::StatusOr<Matrix> GramOf(const ResidualPass& pass, const Matrix& thetas, int64_t rows,
                              double late_s, const Stop& stop) {
  Matrix gram;
  const auto add = [&gram](const Matrix& values, bool) {
    if (gram.size() == 0) gram.setZero(values.rows(), values.rows());
    gram.noalias() += values * values.transpose();
  };
  POLYEST_RETURN_IF_ERROR(pass.Run(thetas, rows, late_s, add, stop));
  return gram;
}

// Returns the mean interval of the first rows.
absl::StatusOr<double> MeanInterval(const SampleStore& store, int64_t rows) {
  RowBlock block;
  POLYEST_RETURN_IF_ERROR(store.Read(0, std::min(kFirstRows, rows), block));
  const auto same = std::ranges::count(block.rows, block.rows.front().run, &SampleRow::run);
  if (same < 2) return 0;
  const double last_s = block.rows[static_cast<size_t>(same - 1)].time_s;
  return (last_s - block.rows.front().time_s) / static_cast<double>(same - 1);
}

// Trajectories about the estimate, each with one quantity changed by a step.
class Neighbours {
 public:
  Neighbours(const Prior& prior, const Estimate& estimate, std::vector<FixedQuantity> quantities)
      : prior_(prior), quantities_(std::move(quantities)) {
    xi_ = prior.ToGerm(MapOf(estimate));
    Vector contraction(xi_.size());
    for (Eigen::Index i = 0; i < xi_.size(); ++i) {
      contraction[i] = estimate.parameters[static_cast<size_t>(i)].contraction;
    }
    steps_ = kOfDeviation * contraction.cwiseMax(kMinFactor).cwiseProduct(Deviations());
    TurnInward();
  }

  const Vector& xi() const { return xi_; }
  const Vector& steps() const { return steps_; }  // of ξ
  const std::vector<FixedQuantity>& quantities() const { return quantities_; }

  // Returns the values of the uncertain parameters, then of the quantities, by trajectory.
  Matrix Thetas() const {
    const Eigen::Index n = xi_.size(), count = n + std::ssize(quantities_);
    Vector base(count);
    base.head(n) = prior_.ToParameters(xi_);
    for (Eigen::Index k = n; k < count; ++k) base[k] = Quantity(k).value;
    Matrix thetas = base.transpose().replicate(1 + count, 1);
    for (Eigen::Index i = 0; i < n; ++i) {
      thetas.row(1 + i).head(n) = prior_.ToParameters(Moved(i)).transpose();
    }
    for (Eigen::Index k = n; k < count; ++k) thetas(1 + k, k) += Quantity(k).step;
    return thetas;
  }

  // Changes the steps whose differences are too small or too large. Returns whether there are any.
  bool Adapt(const Vector& norms) {
    bool changed = false;
    for (Eigen::Index i = 0; i < norms.size(); ++i) {
      const bool is_parameter = i < xi_.size();
      double& step = is_parameter ? steps_[i] : Quantity(i).step;
      const double max_step = is_parameter ? kOfDeviation * Deviations()[i] : Quantity(i).max_step;
      const double next = Adapted(step, norms[i], max_step);
      changed = changed || next != step;
      step = next;
    }
    TurnInward();
    return changed;
  }

 private:
  static constexpr double kOfDeviation = 0.3;
  static constexpr double kMinFactor = 1e-6;

  static double Adapted(double step, double norm, double max_step) {
    if (!std::isfinite(norm) || (norm >= kMinNorm && norm <= kMaxNorm)) return step;
    const double factor = std::clamp(1 / norm, kMinFactor, 1 / kMinFactor);
    return std::copysign(std::min(factor * std::abs(step), max_step), step);
  }

  Vector Deviations() const { return prior_.GermStandardDeviation(); }
  const FixedQuantity& Quantity(Eigen::Index column) const {
    return quantities_[static_cast<size_t>(column - xi_.size())];
  }
  FixedQuantity& Quantity(Eigen::Index column) {
    return quantities_[static_cast<size_t>(column - xi_.size())];
  }

  Vector Moved(Eigen::Index i) const {
    Vector xi = xi_;
    xi[i] += steps_[i];
    return xi;
  }

  // Lets the steps stay within Ω.
  void TurnInward() {
    for (Eigen::Index i = 0; i < xi_.size(); ++i) {
      if (!prior_.Contains(Moved(i))) steps_[i] = -steps_[i];
    }
  }

  const Prior& prior_;
  Vector xi_, steps_;
  std::vector<FixedQuantity> quantities_;
};

// The linear problem about the estimate, from the Gram matrix. Its unknowns are the parameters in
// units of their steps.
class LinearTests {
 public:
  LinearTests(const Matrix& gram, const Prior& prior, double regularization, const Neighbours& at)
      : gram_(gram),
        prior_(prior),
        at_(at),
        n_(at.xi().size()),
        factor_(Curvature(gram, prior, regularization, at)) {
    if (!factor_.positive_definite()) return;
    const Vector slope = gram.col(0).segment(1, n_) -
                         regularization * prior.Gradient(at.xi()).cwiseProduct(at.steps());
    to_minimum_ = factor_.Solve(slope);
    is_minimum_ = slope.dot(to_minimum_) <= kMaxFromMinimum * kMaxFromMinimum;
    jacobian_ = prior.Jacobian(at.xi()) * at.steps().asDiagonal();
    deviations_.resize(n_);
    for (Eigen::Index i = 0; i < n_; ++i) {
      deviations_[i] = factor_.SolveLower(jacobian_.row(i).transpose()).norm();
    }
  }

  // Whether the estimate is a minimum within kMaxFromMinimum.
  bool is_minimum() const { return is_minimum_; }

  // Returns the test of a quantity, with its place among the trajectories; nothing if the
  // parameters can do what it does.
  std::optional<ScoreTest> Of(const FixedQuantity& quantity, Eigen::Index place) const {
    const Vector mixed = gram_.col(place).segment(1, n_);
    const double v = gram_(place, place) - factor_.SolveLower(mixed).squaredNorm();
    if (!(v > kMinOwn * gram_(place, place))) return std::nullopt;
    ScoreTest test{.name = quantity.name, .unit = quantity.unit, .value = quantity.value};
    test.score = (gram_(place, 0) - mixed.dot(to_minimum_)) / std::sqrt(v);
    test.deviation = quantity.step / std::sqrt(v);
    test.change = test.score * test.deviation;
    const Vector shift = -test.score / std::sqrt(v) * factor_.Solve(mixed);
    test.shifts = (jacobian_ * shift).cwiseQuotient(deviations_);
    const Vector xi = at_.xi() + at_.steps().cwiseProduct(to_minimum_ + shift);
    test.parameters = prior_.ToParameters(xi.cwiseMax(prior_.lower()).cwiseMin(prior_.upper()));
    return test;
  }

 private:
  // Returns A. Where the prior is flat, it has the curvature of its variance, lest A be singular.
  static Matrix Curvature(const Matrix& gram, const Prior& prior, double regularization,
                          const Neighbours& at) {
    const Eigen::Index n = at.xi().size();
    const Vector least = prior.GermStandardDeviation().array().square().inverse();
    const Vector of_prior = (regularization * prior.Curvature(at.xi())).cwiseMax(least);
    Matrix a = gram.block(1, 1, n, n);
    a.diagonal() += at.steps().cwiseAbs2().cwiseProduct(of_prior);
    return a;
  }

  const Matrix& gram_;
  const Prior& prior_;
  const Neighbours& at_;
  const Eigen::Index n_;
  const CholeskyFactor factor_;
  bool is_minimum_ = false;
  Vector to_minimum_;
  Matrix jacobian_;    // ∂θ in the units of the unknowns
  Vector deviations_;  // of θ
};

// Returns the Gram matrix of differences that are large enough; the steps become those of it. They
// are found with the beginning of the record.
absl::StatusOr<Matrix> AdaptedGram(const ResidualPass& pass, int64_t rows, double late_s,
                                   Neighbours& neighbours, const Stop& stop) {
  Matrix gram;
  bool whole = rows <= kFirstRows;
  for (int number = 1;; ++number) {
    whole = whole || number == kMaxPasses;
    const Matrix thetas = neighbours.Thetas();
    POLYEST_ASSIGN_OR_RETURN(gram, GramOf(pass, thetas, whole ? rows : kFirstRows, late_s, stop));
    const Vector norms = gram.diagonal().segment(1, thetas.rows() - 1).cwiseSqrt();
    if (number >= kMaxPasses && whole) return gram;
    const bool changed = neighbours.Adapt(norms);
    if (!changed && whole) return gram;
    whole = whole || !changed;
  }
}

// Moves the delays of outputs, which need no trajectories of their own, out of the quantities.
std::vector<FixedQuantity> TakeOutputDelays(std::vector<FixedQuantity>& quantities) {
  const auto is_other = [](const FixedQuantity& quantity) {
    return quantity.delayed_channel == FixedQuantity::kNoChannel;
  };
  const auto late = std::stable_partition(quantities.begin(), quantities.end(), is_other);
  const std::vector<FixedQuantity> delays(late, quantities.end());
  quantities.erase(late, quantities.end());
  return delays;
}

// Returns the scores of all fixed quantities.
absl::StatusOr<std::vector<ScoreTest>> ScoresOf(const ResolvedProblem& problem,
                                                const SampleStore& store, int64_t rows,
                                                const std::vector<ChannelNoise>& noise,
                                                const Estimate& estimate, const Stop& stop) {
  std::vector<ScoreTest> scores;
  POLYEST_ASSIGN_OR_RETURN(const double interval_s, MeanInterval(store, rows));
  if (!(interval_s > 0)) return scores;
  std::vector<FixedQuantity> quantities = FixedQuantitiesOf(problem, interval_s);
  const std::vector<FixedQuantity> delays = TakeOutputDelays(quantities);
  // One block of trajectories shares its steps, so that errors of integration cancel.
  const int room = TrajectoryBlock::kPoints - 1 - problem.dimension();
  quantities.resize(std::min(quantities.size(), static_cast<size_t>(std::max(0, room))));
  const auto extended = WithUncertain(problem, quantities);
  if (!extended) return scores;
  Neighbours neighbours(problem.prior(), estimate, std::move(quantities));
  const double late_s = delays.empty() ? 0 : delays.front().step;
  POLYEST_ASSIGN_OR_RETURN(const Matrix gram, AdaptedGram(ResidualPass(*extended, store, noise),
                                                          rows, late_s, neighbours, stop));
  const LinearTests linear(gram, problem.prior(), estimate.regularization, neighbours);
  if (!linear.is_minimum()) return scores;
  const auto add = [&](const FixedQuantity& quantity, Eigen::Index place) {
    if (auto score = linear.Of(quantity, place)) scores.push_back(*std::move(score));
  };
  Eigen::Index place = 1 + problem.dimension();
  for (const FixedQuantity& quantity : neighbours.quantities()) add(quantity, place++);
  for (const FixedQuantity& delay : delays) add(delay, place + delay.delayed_channel);
  return scores;
}

// Runs the model as the residuals ask for, beside that of the estimate; nothing if it fails.
absl::StatusOr<std::optional<Correction>> Correct(const ResolvedProblem& problem,
                                                  const SampleStore& store, int64_t rows,
                                                  const std::vector<ChannelNoise>& noise,
                                                  const Estimate& estimate, const ScoreTest& score,
                                                  const Stop& stop) {
  FixedQuantity quantity{.name = score.name, .unit = score.unit, .value = score.value};
  quantity.other = score.value + score.change;
  const auto extended = WithUncertain(problem, {quantity});
  if (!extended) return std::nullopt;
  const Eigen::Index n = score.parameters.size();
  Matrix thetas(2, n + 1);
  thetas.row(0).head(n) = MapOf(estimate).transpose();
  thetas.row(1).head(n) = score.parameters.transpose();
  thetas(0, n) = quantity.value;
  thetas(1, n) = quantity.other;
  ResidualScatter before(problem.channels()), after(problem.channels());
  const auto add = [&](const Matrix& values, bool begins_run) {
    before.Add(values.row(0).transpose(), begins_run);
    after.Add((values.row(0) - values.row(1)).transpose(), begins_run);
  };
  POLYEST_RETURN_IF_ERROR(ResidualPass(*extended, store, noise).Run(thetas, rows, 0, add, stop));
  const Correction correction{before.ChiSquared(), after.ChiSquared(), after.Dispersion()};
  return std::isfinite(correction.chi_squared) ? std::optional(correction) : std::nullopt;
}

}  // namespace

absl::StatusOr<FixedValueTests> TestFixedQuantities(const ResolvedProblem& problem,
                                                    const SampleStore& store, int64_t rows,
                                                    const std::vector<ChannelNoise>& learned,
                                                    const Estimate& estimate, const Stop& stop) {
  FixedValueTests tests;
  rows = std::min(rows, kMaxRows);
  if (!AreDefinedFor(problem) || rows == 0) return tests;
  POLYEST_ASSIGN_OR_RETURN(const std::vector<ChannelNoise> noise,
                           NoiseOfResiduals(problem, store, rows, learned, estimate, stop));
  POLYEST_ASSIGN_OR_RETURN(tests.scores, ScoresOf(problem, store, rows, noise, estimate, stop));
  std::ranges::stable_sort(tests.scores, std::greater<>(),
                           [](const ScoreTest& score) { return std::abs(score.score); });
  if (tests.scores.empty() || std::abs(tests.scores.front().score) < kMinScore) return tests;
  POLYEST_ASSIGN_OR_RETURN(
      tests.correction, Correct(problem, store, rows, noise, estimate, tests.scores.front(), stop));
  return tests;
}

}  // namespace polyest::internal
