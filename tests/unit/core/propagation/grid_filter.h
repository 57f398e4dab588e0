#pragma once

// A filter of an Ornstein–Uhlenbeck process dx = (u − a x) dt + √q dβ on a grid of its values,
// which is exact but for the grid's step, whatever function of x is measured.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

struct OrnsteinUhlenbeck {
  double rate = 1;       // a
  double drive = 0;      // u
  double diffusion = 1;  // q
  double start = 0;      // x at t = 0

  double MeanAfter(double x, double step_s) const {
    const double left = std::exp(-rate * step_s);
    return x * left + drive / rate * (1 - left);
  }
  double VarianceAfter(double step_s) const {
    return diffusion * -std::expm1(-2 * rate * step_s) / (2 * rate);
  }
};

struct OrnsteinUhlenbeckRecord {
  double step_s = 0;
  std::vector<double> times_s, values;
};

// Returns samples h(x) + σ e after each step.
inline OrnsteinUhlenbeckRecord MakeRecord(const OrnsteinUhlenbeck& process, double (*h)(double),
                                          double step_s, int count, double sigma, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  OrnsteinUhlenbeckRecord record{step_s, {}, {}};
  double x = process.start;
  for (int k = 1; k <= count; ++k) {
    x = process.MeanAfter(x, step_s) + std::sqrt(process.VarianceAfter(step_s)) * normal(random);
    record.times_s.push_back(k * step_s);
    record.values.push_back(h(x) + sigma * normal(random));
  }
  return record;
}

struct GridFiltered {
  double log_likelihood = 0;       // Σ log p(z_k)/p_0, p_0 the noise's density at 0
  double mean = 0, deviation = 0;  // of x after the last sample
};

class GridFilter {
 public:
  GridFilter(const OrnsteinUhlenbeck& process, double (*h)(double), double step_s, double sigma)
      : x_(Vector::LinSpaced(600, -4, 5)),
        step_(x_[1] - x_[0]),
        sigma_(sigma),
        outputs_(x_.unaryExpr(h)),
        density_(Density(process, process.start, step_s)),
        kernel_(x_.size(), x_.size()) {
    for (Eigen::Index j = 0; j < x_.size(); ++j) {
      kernel_.col(j) = step_ * Density(process, x_[j], step_s);
    }
  }

  Vector Likelihood(double z) const {
    return (-0.5 * ((z - outputs_.array()) / sigma_).square()).exp();
  }
  void Step() { density_ = kernel_ * density_; }
  // Returns log p(z)/p_0.
  double Take(double z) {
    density_ = density_.cwiseProduct(Likelihood(z));
    const double sum = step_ * density_.sum();
    density_ /= sum;
    return std::log(sum);
  }
  // Multiplies the density by what later samples say, given that of the last one first.
  void TakeLater(const Vector& factor) {
    density_ = density_.cwiseProduct(factor);
    density_ /= step_ * density_.sum();
  }
  // Returns what the density of x one step later says of x.
  Vector Back(const Vector& factor) const { return kernel_.transpose() * factor; }
  double Mean() const { return step_ * density_.dot(x_); }
  double Deviation() const {
    return std::sqrt(step_ * density_.dot((x_.array() - Mean()).square().matrix()));
  }

 private:
  Vector Density(const OrnsteinUhlenbeck& process, double from, double step_s) const {
    const double variance = process.VarianceAfter(step_s);
    return (-0.5 * (x_.array() - process.MeanAfter(from, step_s)).square() / variance).exp() /
           std::sqrt(2 * std::numbers::pi * variance);
  }

  Vector x_;
  double step_, sigma_;
  Vector outputs_, density_;
  Matrix kernel_;
};

inline GridFiltered FilterOnGrid(const OrnsteinUhlenbeck& process, double (*h)(double),
                                 const OrnsteinUhlenbeckRecord& record, double sigma) {
  GridFilter filter(process, h, record.step_s, sigma);
  GridFiltered filtered;
  for (size_t k = 0; k < record.values.size(); ++k) {
    if (k > 0) filter.Step();
    filtered.log_likelihood += filter.Take(record.values[k]);
  }
  filtered.mean = filter.Mean();
  filtered.deviation = filter.Deviation();
  return filtered;
}

// Returns mean and standard deviation of x at sample `at` as all samples tell them.
inline GridFiltered SmoothOnGrid(const OrnsteinUhlenbeck& process, double (*h)(double),
                                 const OrnsteinUhlenbeckRecord& record, double sigma, size_t at) {
  GridFilter filter(process, h, record.step_s, sigma);
  for (size_t k = 0; k <= at; ++k) {
    if (k > 0) filter.Step();
    filter.Take(record.values[k]);
  }
  Vector later = Vector::Ones(filter.Likelihood(0).size());
  for (size_t k = record.values.size() - 1; k > at; --k) {
    later = filter.Back(filter.Likelihood(record.values[k]).cwiseProduct(later));
    later /= later.maxCoeff();
  }
  filter.TakeLater(later);
  return {0, filter.Mean(), filter.Deviation()};
}

}  // namespace polyest::internal
