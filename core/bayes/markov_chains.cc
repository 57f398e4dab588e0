#include "core/bayes/markov_chains.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/convergence.h"
#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr int kMaxTimes = 64;      // times kept; when full every second is dropped
constexpr int kFirstInterval = 2;  // sweeps from one time kept to the next
constexpr int kFirstSweeps =
    64;  // sweeps before the first test of convergence, and the fewest added later
constexpr Eigen::Index kMinInGroup = 8;

class ChainRunner {
 public:
  ChainRunner(const Cost& cost, const Vector& lower, const Vector& upper,
              const Particles& particles, const Matrix& quantities, const ChainOptions& options)
      : quantities_(quantities),
        options_(options),
        in_group_(particles.etas.rows() / options.groups),
        chains_(in_group_ * options.groups),
        state_{particles.etas.topRows(chains_), particles.costs.head(chains_)},
        moves_(cost, lower, upper, options.seed),
        etas_(kMaxTimes * chains_, particles.etas.cols()),
        costs_(kMaxTimes * chains_) {
    POLYEST_CHECK(options.groups >= 2 && in_group_ >= kMinInGroup);
  }

  absl::StatusOr<Chains> Run(const Stop& stop) {
    int sweeps = std::min(kFirstSweeps, options_.max_sweeps);
    int done = 0;
    while (true) {
      for (; done < sweeps; ++done) {
        POLYEST_RETURN_IF_ERROR(stop.Check());
        for (int g = 0; g < options_.groups; ++g) {
          moves_.Sweep(1, g * in_group_, in_group_, state_);
        }
        if ((done + 1) % interval_ == 0) Keep();
      }
      Judge();
      const double effective = result_.effective_size.minCoeff();
      if (effective >= options_.effective_size || done >= options_.max_sweeps) break;
      // The number of sweeps rises in proportion to the missing effective size, and a little more.
      const double more = 1.1 * done * (options_.effective_size / effective - 1);
      const double left = options_.max_sweeps - done;
      sweeps = done + static_cast<int>(std::min(left, std::max<double>(more, kFirstSweeps)));
    }
    result_.etas = etas_.topRows(times_ * chains_);
    result_.costs = costs_.head(times_ * chains_);
    result_.group = Eigen::VectorXi::NullaryExpr(times_ * chains_, [this](Eigen::Index row) {
      return static_cast<int>(row % chains_ / in_group_);
    });
    return std::move(result_);
  }

 private:
  void Keep() {
    if (times_ == kMaxTimes) {
      for (int t = 1; 2 * t < kMaxTimes + 1; ++t) {
        Copy(2 * t - 1, t - 1);
      }
      times_ /= 2;
      interval_ *= 2;
      return;  // drops this time, too, which has an odd index
    }
    etas_.middleRows(times_ * chains_, chains_) = state_.etas;
    costs_.segment(times_ * chains_, chains_) = state_.costs;
    ++times_;
  }

  void Copy(int from, int to) {
    etas_.middleRows(to * chains_, chains_) = etas_.middleRows(from * chains_, chains_);
    costs_.segment(to * chains_, chains_) = costs_.segment(from * chains_, chains_);
  }

  void Judge() {
    const Eigen::Index count = quantities_.rows();
    result_.r_hat.resize(count);
    result_.effective_size.resize(count);
    for (Eigen::Index j = 0; j < count; ++j) {
      const Vector draws = etas_.topRows(times_ * chains_) * quantities_.row(j).transpose();
      const Matrix normalized = RankNormalized(draws.reshaped(chains_, times_).transpose());
      result_.r_hat[j] = SplitRHat(normalized, options_.groups);
      result_.effective_size[j] = EffectiveSize(normalized);
    }
  }

  const Matrix& quantities_;
  const ChainOptions& options_;
  Eigen::Index in_group_;
  Eigen::Index chains_;
  Particles state_;
  DifferentialEvolution moves_;
  Matrix etas_;
  Vector costs_;
  int times_ = 0;
  int interval_ = kFirstInterval;
  Chains result_;
};

}  // namespace

absl::StatusOr<Chains> RunChains(const Cost& cost, const Vector& lower, const Vector& upper,
                                 const Particles& particles, const Matrix& quantities,
                                 const ChainOptions& options, const Stop& stop) {
  return ChainRunner(cost, lower, upper, particles, quantities, options).Run(stop);
}

}  // namespace polyest::internal
