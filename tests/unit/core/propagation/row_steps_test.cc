#include "core/propagation/row_steps.h"

#include <gtest/gtest.h>

#include <cmath>

namespace polyest::internal {
namespace {

// ẋ = (1 + n) tⁿ for row n, so that x = t^{n+1}.
class Powers final : public RowSystem {
 public:
  void Rates(const Eigen::ArrayXd& times_s, const Eigen::ArrayXXd& states,
             Eigen::ArrayXXd& rates) override {
    for (Eigen::Index n = 0; n < states.rows(); ++n) {
      rates(n, 0) = static_cast<double>(1 + n) * std::pow(times_s(n), n);
    }
  }
};

// ẋ = −x.
class Decay final : public RowSystem {
 public:
  void Rates(const Eigen::ArrayXd&, const Eigen::ArrayXXd& states,
             Eigen::ArrayXXd& rates) override {
    rates = -states;
  }
};

TEST(RowSteps, AreExactUpToTheirOrderWithTimesAndLengthsOfTheirOwn) {
  constexpr Eigen::Index kRows = 8;
  RowSteps steps(kRows, 1);
  Powers powers;
  Eigen::ArrayXd times_s(kRows), lengths_s(kRows);
  Eigen::ArrayXXd states(kRows, 1);
  for (Eigen::Index n = 0; n < kRows; ++n) {
    times_s(n) = 0.1 * static_cast<double>(n);
    lengths_s(n) = 0.5 + 0.2 * static_cast<double>(n);
    states(n, 0) = std::pow(times_s(n), n + 1);
  }
  powers.Rates(times_s, states, steps.first_stage());
  steps.Take(powers, times_s, lengths_s, states);
  const std::array<double, RowSteps::kStages> weights = RowSteps::Weights(0.3);
  for (Eigen::Index n = 0; n < kRows; ++n) {
    const auto exact = [&](double theta) {
      return std::pow(times_s(n) + theta * lengths_s(n), n + 1);
    };
    if (n <= 4) {
      EXPECT_NEAR(steps.ends()(n, 0), exact(1), 1e-14 * exact(1)) << n;
    } else {
      EXPECT_GT(std::abs(steps.ends()(n, 0) - exact(1)), 1e-6);
    }
    if (n <= 3) {
      EXPECT_NEAR(steps.Error(n, 0, lengths_s(n)), 0, 1e-14) << n;
      double inside = states(n, 0);
      for (size_t i = 0; i < weights.size(); ++i) {
        inside += lengths_s(n) * weights[i] * steps.stages()[i](n, 0);
      }
      EXPECT_NEAR(inside, exact(0.3), 1e-14) << n;
    }
  }
}

TEST(RowSteps, AreOfOrderFiveAndEstimateAnErrorOfOrderFour) {
  RowSteps steps(8, 1);
  Decay decay;
  const Eigen::ArrayXXd states = Eigen::ArrayXXd::Ones(8, 1);
  Eigen::ArrayXd lengths_s(8);
  lengths_s << 0.2, 0.1, 0.05, 0.2, 0.2, 0.2, 0.2, 0.2;
  decay.Rates({}, states, steps.first_stage());
  steps.Take(decay, Eigen::ArrayXd::Zero(8), lengths_s, states);
  const auto error = [&](Eigen::Index row) {
    return std::abs(steps.ends()(row, 0) - std::exp(-lengths_s(row)));
  };
  // A step's error falls by 2⁶, and its estimate by 2⁵.
  EXPECT_NEAR(std::log2(error(0) / error(1)), 6, 0.2);
  EXPECT_NEAR(std::log2(error(1) / error(2)), 6, 0.2);
  EXPECT_NEAR(std::log2(steps.Error(1, 0, 0.1) / steps.Error(2, 0, 0.05)), 5, 0.2);
  EXPECT_GT(std::abs(steps.Error(0, 0, 0.2)), error(0));
}

}  // namespace
}  // namespace polyest::internal
