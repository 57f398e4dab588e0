#pragma once

// The oracle for oscillators: closed forms of m ẍ + c ẋ + k x = u.

#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

namespace polyest::internal {

struct Oscillator {
  double m = 1;
  double c = 0;
  double k = 1;
  double x0 = 0;
  double v0 = 0;

  // Returns the free motion, under- or overdamped.
  double Free(double t) const {
    const double d = c / (2 * m);
    const double square = k / m - d * d;
    if (square > 0) {
      const double w = std::sqrt(square);
      return std::exp(-d * t) * (x0 * std::cos(w * t) + (v0 + d * x0) / w * std::sin(w * t));
    }
    // The motion is x = A e^{s1 t} + B e^{s2 t}. The slow root comes from s1 s2 = k/m, without
    // cancellation.
    const double s2 = -d - std::sqrt(-square);
    const double s1 = k / m / s2;
    const double b = (v0 - s1 * x0) / (s2 - s1);
    return (x0 - b) * std::exp(s1 * t) + b * std::exp(s2 * t);
  }

  // Returns the state after τ under u = u0 + rate · τ, without damping (c = 0):
  //   x = u/k + C cos ωτ + D sin ωτ.
  std::pair<double, double> UnderRamp(double x, double v, double u0, double rate,
                                      double tau) const {
    const double w = std::sqrt(k / m);
    const double big_c = x - u0 / k;
    const double big_d = (v - rate / k) / w;
    return {(u0 + rate * tau) / k + big_c * std::cos(w * tau) + big_d * std::sin(w * tau),
            rate / k + w * (big_d * std::cos(w * tau) - big_c * std::sin(w * tau))};
  }

  // Returns x at the knots' times, under an input that is held or linear between these knots.
  std::vector<double> ThroughKnots(const std::vector<double>& time_s,
                                   const std::vector<double>& value, bool hold) const {
    std::vector<double> displacement{x0};
    double x = x0;
    double v = v0;
    for (size_t i = 1; i < time_s.size(); ++i) {
      const double tau = time_s[i] - time_s[i - 1];
      const double rate = hold ? 0 : (value[i] - value[i - 1]) / tau;
      std::tie(x, v) = UnderRamp(x, v, value[i - 1], rate, tau);
      displacement.push_back(x);
    }
    return displacement;
  }
};

}  // namespace polyest::internal
