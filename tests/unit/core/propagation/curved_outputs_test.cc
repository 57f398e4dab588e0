// Filters whose outputs are curved over the width of what is known of the states. The oracle is a
// filter on a grid of an Ornstein–Uhlenbeck process (tests/unit/core/propagation/grid_filter.h),
// which is exact.

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "core/propagation/filter_bank.h"
#include "polyest/equation_model.h"
#include "tests/unit/core/propagation/ensemble.h"
#include "tests/unit/core/propagation/grid_filter.h"

namespace polyest::internal::curved_outputs_test {
namespace {

constexpr double kDiffusion = 0.3, kSigma = 0.05;
const std::vector<double> kRates = {0.6, 0.9, 1.3, 1.8};

Ensemble Relaxations(const char* output, std::vector<const char*> read = {"y"}) {
  Ensemble ensemble(MakeEquationModel({.states = {{"x", "0.6 - a*x"}},
                                       .outputs = {{"y", output}, {"z", "x"}},
                                       .parameters = {{"a", 1}}})
                        .value(),
                    static_cast<int>(kRates.size()), std::move(read));
  for (size_t i = 0; i < kRates.size(); ++i) ensemble.Set("a", static_cast<int>(i), kRates[i]);
  ensemble.specification.process_noise.setConstant(ensemble.points(), 1, kDiffusion);
  return ensemble;
}

// The same x as the sum of two states that share its noise.
Ensemble HalvedRelaxations(const char* output) {
  Ensemble ensemble(MakeEquationModel({.states = {{"u", "0.2 - a*u"}, {"v", "0.4 - a*v"}},
                                       .outputs = {{"y", output}},
                                       .parameters = {{"a", 1}}})
                        .value(),
                    static_cast<int>(kRates.size()), {"y"});
  for (size_t i = 0; i < kRates.size(); ++i) ensemble.Set("a", static_cast<int>(i), kRates[i]);
  ensemble.specification.process_noise.resize(ensemble.points(), 2);
  ensemble.specification.process_noise.col(0).setConstant(0.25 * kDiffusion);
  ensemble.specification.process_noise.col(1).setConstant(0.75 * kDiffusion);
  return ensemble;
}

struct Filtered {
  Vector deviances;  // Σ (w² + log S/σ²)
  Matrix mean, deviation;
};

Filtered Filter(const Ensemble& ensemble, const OrnsteinUhlenbeckRecord& record) {
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const Matrix values = Eigen::Map<const Vector>(record.values.data(), std::ssize(record.values));
  const Matrix row = values.transpose(), noise = Matrix::Constant(1, row.cols(), kSigma);
  Matrix innovations(bank.members(), row.cols()), log_variances = innovations;
  const FilterSamples samples{record.times_s, row, noise};
  EXPECT_TRUE(bank.Advance(samples, innovations, log_variances, Stop()).ok());
  Filtered filtered{innovations.rowwise().squaredNorm() + log_variances.rowwise().sum(), {}, {}};
  bank.ReadStates(filtered.mean, filtered.deviation);
  return filtered;
}

double Saturating(double x) { return std::tanh(2 * x); }
double Growing(double x) { return std::exp(x); }

OrnsteinUhlenbeck ProcessOf(double rate) { return {rate, 0.6, kDiffusion, 0}; }

// What remains is that the states' density is not normal: some tenths of a nat in 60 samples. With
// the filter's own N(z; ẑ, S) the likelihoods are off by ten nats and more.
void ExpectAsOnGrid(const char* output, double (*h)(double)) {
  const OrnsteinUhlenbeckRecord record = MakeRecord(ProcessOf(1.3), h, 0.3, 60, kSigma, 3);
  const Filtered filtered = Filter(Relaxations(output), record);
  for (size_t i = 0; i < kRates.size(); ++i) {
    const GridFiltered exact = FilterOnGrid(ProcessOf(kRates[i]), h, record, kSigma);
    const auto member = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(0.5 * filtered.deviances[member], -exact.log_likelihood, 0.5) << i;
    EXPECT_NEAR(filtered.mean(member, 0), exact.mean, 0.1 * exact.deviation) << i;
    EXPECT_NEAR(filtered.deviation(member, 0), exact.deviation, 0.1 * exact.deviation) << i;
  }
}

TEST(CurvedOutputs, HaveTheLikelihoodOfAFilterOnAGridWhereTheySaturate) {
  ExpectAsOnGrid("tanh(2*x)", Saturating);
}

TEST(CurvedOutputs, HaveTheLikelihoodOfAFilterOnAGridWhereTheyGrow) {
  ExpectAsOnGrid("exp(x)", Growing);
}

// A function of a sum of states is one of a single combination of them; the integrator's tolerance
// is 1e-10, and rotations of the factors round.
TEST(CurvedOutputs, OfACombinationOfStatesAreThoseOfOneState) {
  const OrnsteinUhlenbeckRecord record = MakeRecord(ProcessOf(1.3), Saturating, 0.3, 60, kSigma, 3);
  const Filtered one = Filter(Relaxations("tanh(2*x)"), record);
  const Filtered two = Filter(HalvedRelaxations("tanh(2*(u + v))"), record);
  for (Eigen::Index i = 0; i < one.deviances.size(); ++i) {
    EXPECT_NEAR(two.deviances[i], one.deviances[i], 1e-5 * std::abs(one.deviances[i]) + 1e-4) << i;
    EXPECT_NEAR(two.mean.row(i).sum(), one.mean(i, 0), 1e-5) << i;
  }
}

struct Smoothed {
  Matrix means, deviations;  // members × (y, x)
};

// Returns what all samples tell of y and x before the sample in the middle. x is not measured.
Smoothed Smooth(const char* output, const OrnsteinUhlenbeckRecord& record) {
  const size_t marked = record.times_s.size() / 2;
  const Ensemble ensemble = Relaxations(output, {"y", "z"});
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  bank.StartBackward();
  Matrix innovations(bank.members(), 2), log_variances = innovations;
  for (size_t k = 0; k < record.times_s.size(); ++k) {
    if (k == marked) {
      EXPECT_TRUE(bank.Mark(record.times_s[k], Stop()).ok());
    }
    const Matrix z{{record.values[k]}, {0}}, noise{{kSigma}, {0}};
    const FilterSamples sample{{&record.times_s[k], 1}, z, noise};
    EXPECT_TRUE(bank.Advance(sample, innovations, log_variances, Stop()).ok());
  }
  bank.FinishBackward();
  Smoothed smoothed{Matrix(bank.members(), 2), Matrix(bank.members(), 2)};
  EXPECT_TRUE(bank.ReadMarked(0, record.times_s[marked], smoothed.means, smoothed.deviations).ok());
  return smoothed;
}

// An output that is curved enough to be integrated, and so little that all is as with a linear one:
// the difference of 0.002 x² is at most a tenth of the noise, and that of the slopes 1 %.
TEST(CurvedOutputs, AreSmoothedAsLinearOnesAre) {
  const OrnsteinUhlenbeckRecord record = MakeRecord(
      ProcessOf(1.3), [](double x) { return x; }, 0.3, 60, kSigma, 3);
  const Smoothed linear = Smooth("x", record), curved = Smooth("x + 0.002*x^2", record);
  for (Eigen::Index i = 0; i < linear.means.rows(); ++i) {
    const double deviation = linear.deviations(i, 1);
    EXPECT_NEAR(curved.means(i, 1), linear.means(i, 1), 0.1 * deviation) << i;
    EXPECT_NE(curved.means(i, 1), linear.means(i, 1)) << i;
    EXPECT_NEAR(curved.deviations(i, 1), deviation, 0.01 * deviation) << i;
  }
}

// Against the grid's forward and backward passes. The smoother takes states at different times for
// jointly normal, which they are less than those at one time: it is too wide here by up to a third.
TEST(CurvedOutputs, AreSmoothedWhereTheySaturate) {
  const OrnsteinUhlenbeckRecord record = MakeRecord(ProcessOf(1.3), Saturating, 0.3, 60, kSigma, 3);
  const Smoothed smoothed = Smooth("tanh(2*x)", record);
  for (size_t i = 0; i < kRates.size(); ++i) {
    const GridFiltered exact =
        SmoothOnGrid(ProcessOf(kRates[i]), Saturating, record, kSigma, record.times_s.size() / 2);
    const auto member = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(smoothed.means(member, 1), exact.mean, 0.3 * exact.deviation) << i;
    EXPECT_GT(smoothed.deviations(member, 1), 0.9 * exact.deviation) << i;
    EXPECT_LT(smoothed.deviations(member, 1), 1.4 * exact.deviation) << i;
  }
}

}  // namespace
}  // namespace polyest::internal::curved_outputs_test
