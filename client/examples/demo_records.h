#pragma once

// The demonstration records. Each function writes one to the standard output: closed forms, or the
// equations of motion written down again and integrated in small fixed steps, with noise; the same
// bytes every time.

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>

namespace demo {

void WriteOscillator();
void WriteDisturbed();
void WriteWarming();
void WriteRoughSensor();
void WriteReleases();
void WriteSpecimens();
void WriteRollPlane();
void WriteHalfCar();
void WriteQuarterCar();
void WriteBicycle();
void WriteDamperRig();
void WriteChain();

// Box–Muller: the standard library's normal distribution may differ from one library to another.
inline double StandardNormal(std::mt19937_64& generator) {
  const auto uniform = [&generator] {  // in (0, 1)
    return (static_cast<double>(generator() >> 11) + 0.5) * 0x1p-53;
  };
  const double radius = std::sqrt(-2 * std::log(uniform()));
  return radius * std::cos(2 * std::numbers::pi * uniform());
}

// The classical Runge–Kutta method of order 4 over one sample, in so small steps that its error is
// far below the last digit written.
template <std::size_t kStates, class Rates>
void Advance(std::array<double, kStates>& x, double t, double duration, const Rates& rates) {
  constexpr int steps = 100;
  const double h = duration / steps;
  const auto moved = [&x](double by, const std::array<double, kStates>& along) {
    std::array<double, kStates> y = x;
    for (std::size_t i = 0; i < kStates; ++i) y[i] += by * along[i];
    return y;
  };
  for (int step = 0; step < steps; ++step) {
    const double begin = t + step * h;
    const auto a = rates(begin, x);
    const auto b = rates(begin + h / 2, moved(h / 2, a));
    const auto c = rates(begin + h / 2, moved(h / 2, b));
    const auto d = rates(begin + h, moved(h, c));
    for (std::size_t i = 0; i < kStates; ++i) x[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
}

}  // namespace demo
