// Compares posteriors in several pieces with e^{−J} on a fine grid over each piece, J from the
// closed form of the model.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/posterior/mixture_cases.h"

namespace polyest::internal::mixture {
namespace {

using ::testing::SizeIs;

struct Piece {
  double log_mass = 0;
  Vector mean, std_dev;
};

// Integrates by the midpoint rule with 100 cells an axis over ±6 standard deviations about the
// piece's map. The error is of the order of (0.12)²/24 of a standard deviation.
Piece ByQuadrature(const ComponentEstimate& about,
                   const std::function<double(const Vector&)>& cost) {
  constexpr int kCells = 100;
  const auto n = static_cast<Eigen::Index>(about.parameters.size());
  Vector map(n), width(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    map[i] = about.parameters[static_cast<size_t>(i)].map;
    width[i] = 12 * about.parameters[static_cast<size_t>(i)].std_dev / kCells;
  }
  const double least = cost(map);
  double mass = 0;
  Piece piece{0, Vector::Zero(n), Vector::Zero(n)};
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < (n == 2 ? kCells : 1); ++j) {
      Vector offset(n);
      offset[0] = (i + 0.5 - kCells / 2) * width[0];
      if (n == 2) offset[1] = (j + 0.5 - kCells / 2) * width[1];
      const double density = std::exp(least - cost(map + offset));
      mass += density;
      piece.mean += density * offset;
      piece.std_dev += density * offset.cwiseAbs2();
    }
  }
  piece.mean /= mass;
  piece.std_dev = (piece.std_dev / mass - piece.mean.cwiseAbs2()).cwiseSqrt();
  piece.mean += map;
  piece.log_mass = std::log(mass * width.prod()) - least;
  return piece;
}

// Makes a problem with aliases. When sampled once a second, w is the same as 6π − w with the phase
// of the other sign; only the prior of the phase tells which it is.
Case OfAnAlias() {
  return {"alias",
          TextProblem("cos(w * t + p)",
                      {UncertainParameter::Normal("w", 9.5, 0.6).value(),
                       UncertainParameter::Normal("p", 0.02, 0.1).value()},
                      6),
          Record([](double t) { return std::cos(10.4 * t + 0.05); }, 1, 60, 5),
          [](const Vector& theta, double t) { return std::cos(theta[0] * t + theta[1]); },
          [](const Vector& theta) {
            return LogNormal(theta[0], 9.5, 0.6) + LogNormal(theta[1], 0.02, 0.1);
          }};
}

class MixtureAccuracy : public ::testing::TestWithParam<Case> {};

// The bound covers the weights. Bridge sampling with 8,192 draws beside as many has a relative
// error of about 10⁻², and the errors of the expansions add as much.
TEST_P(MixtureAccuracy, IsThatOfQuadratureOnTheModel) {
  constexpr double kMaxError = 0.03;
  const Case& one = GetParam();
  const Estimate estimate = EstimateOf(one.problem, one.samples);
  ASSERT_THAT(estimate.components, SizeIs(2));
  std::vector<Piece> pieces;
  double all = 0;
  for (const ComponentEstimate& component : estimate.components) {
    pieces.push_back(ByQuadrature(component, [&](const Vector& theta) {
      return ExactCost(one.samples, one.output, one.log_prior, theta);
    }));
    all += std::exp(pieces.back().log_mass - pieces.front().log_mass);
  }
  std::vector<double> weights;
  for (size_t k = 0; k < 2; ++k) {
    const ComponentEstimate& component = estimate.components[k];
    weights.push_back(std::exp(pieces[k].log_mass - pieces.front().log_mass) / all);
    EXPECT_NEAR(component.weight, weights[k], 0.02 * weights[k]);
    for (size_t i = 0; i < component.parameters.size(); ++i) {
      const ParameterEstimate& parameter = component.parameters[i];
      const double std_dev = pieces[k].std_dev[static_cast<Eigen::Index>(i)];
      EXPECT_NEAR(parameter.mean, pieces[k].mean[static_cast<Eigen::Index>(i)],
                  kMaxError * std_dev);
      EXPECT_NEAR(parameter.posterior_std_dev, std_dev, kMaxError * std_dev);
    }
  }
  for (size_t i = 0; i < estimate.parameters.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double mean = weights[0] * pieces[0].mean[at] + weights[1] * pieces[1].mean[at];
    double variance = 0;
    for (size_t k = 0; k < 2; ++k) {
      variance += weights[k] *
                  (std::pow(pieces[k].std_dev[at], 2) + std::pow(pieces[k].mean[at] - mean, 2));
    }
    const ParameterEstimate& parameter = estimate.parameters[i];
    EXPECT_NEAR(parameter.mean, mean, kMaxError * std::sqrt(variance));
    EXPECT_NEAR(parameter.posterior_std_dev, std::sqrt(variance), kMaxError * std::sqrt(variance));
    EXPECT_EQ(parameter.map, estimate.components[0].parameters[i].map);
    EXPECT_EQ(parameter.std_dev, estimate.components[0].parameters[i].std_dev);
  }
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kExpansionInaccurate));
}

INSTANTIATE_TEST_SUITE_P(Pieces, MixtureAccuracy,
                         ::testing::Values(OfASign("equal", 0, 400), OfASign("unequal", 0.15, 100),
                                           OfASign("long", 0.3, 2000), OfASignBesideADamping(),
                                           OfAnAlias()));

}  // namespace
}  // namespace polyest::internal::mixture
