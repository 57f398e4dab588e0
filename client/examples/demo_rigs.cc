// Rigs on which something is shaken.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "client/examples/demo_records.h"

namespace demo {

using std::numbers::pi;

namespace {

// The command of a rig's actuator; the actuator follows later.
double Command(double t) {
  return t < 0 ? 0
               : 0.012 * std::sin(2 * pi * 1.3 * t) + 0.008 * std::sin(2 * pi * 3.7 * t) -
                     0.003 * std::sin(2 * pi * 6.1 * t);
}

// A damper's force over its speed as its maker gives it, straight between the points.
double DamperCurve(double speed) {
  constexpr std::array<double, 7> v = {-1, -0.3, -0.1, 0, 0.1, 0.3, 1};
  constexpr std::array<double, 7> force_n = {-900, -480, -240, 0, 300, 610, 1200};
  const auto next = std::upper_bound(v.begin() + 1, v.end() - 1, speed) - v.begin();
  const auto i = static_cast<size_t>(next);
  return std::lerp(force_n[i - 1], force_n[i], (speed - v[i - 1]) / (v[i] - v[i - 1]));
}

}  // namespace

// A mass between a damper and two springs to the actuator.
void WriteDamperRig() {
  // The truth, which damper_rig.json does not know.
  constexpr double mass_kg = 42.5, springs_n_per_m = 2 * 11300, damper_share = 1.17;
  constexpr double delay_s = 0.0073, offset_n = 21;
  constexpr double acceleration_noise_m_per_s2 = 0.1, force_noise_n = 5;
  constexpr int samples_per_second = 200;
  constexpr int seconds = 4;
  const auto springs = [](double t, double x) {
    return springs_n_per_m * (Command(t - delay_s) - x);
  };
  const auto rates = [&](double t, const std::array<double, 2>& x) -> std::array<double, 2> {
    return {x[1], (springs(t, x[0]) - damper_share * DamperCurve(x[1])) / mass_kg};
  };
  std::array<double, 2> x{};
  std::mt19937_64 generator(20'061'137);
  std::puts("t,y,accel,force");
  for (int i = 0; i <= seconds * samples_per_second; ++i) {
    const double t = static_cast<double>(i) / samples_per_second;
    if (i > 0) Advance(x, t - 1.0 / samples_per_second, 1.0 / samples_per_second, rates);
    const double accel = rates(t, x)[1] + acceleration_noise_m_per_s2 * StandardNormal(generator);
    const double force = springs(t, x[0]) + offset_n + force_noise_n * StandardNormal(generator);
    std::printf("%.3f,%.6f,%.3f,%.2f\n", t, Command(t), accel, force);
  }
}

// Four masses in a row on springs and dampers between a wall and a shaker, whose force sweeps
// through all four modes.
void WriteChain() {
  // The truth, which chain.json does not know.
  constexpr std::array<double, 4> mass_kg = {0.91, 1.12, 1.05, 0.88};
  constexpr std::array<double, 4> k_n_per_m = {112, 87, 104, 95};
  constexpr std::array<double, 4> c_n_s_per_m = {0.6, 1.0, 0.7, 0.9};
  constexpr double noise_m = 0.002;
  constexpr double force_n = 5, start_hz = 0.3, end_hz = 5;
  constexpr int samples_per_second = 20, seconds = 20;
  const auto rates = [&](double t, const std::array<double, 8>& x) {
    const double cycles = (start_hz + 0.5 * (end_hz - start_hz) / seconds * t) * t;
    std::array<double, 8> rate{};
    double pull = t <= seconds ? force_n * std::sin(2 * pi * cycles) : 0;  // on the mass from above
    for (size_t i = 4; i-- > 0;) {
      const double stretch = x[i] - (i > 0 ? x[i - 1] : 0);
      const double speed = x[4 + i] - (i > 0 ? x[3 + i] : 0);
      const double link = k_n_per_m[i] * stretch + c_n_s_per_m[i] * speed;
      rate[i] = x[4 + i];
      rate[4 + i] = (pull - link) / mass_kg[i];
      pull = link;
    }
    return rate;
  };
  std::array<double, 8> x{};
  std::mt19937_64 generator(20'061'151);
  std::puts("t,x1,x2,x3,x4");
  for (int i = 1; i <= seconds * samples_per_second; ++i) {
    const double t = static_cast<double>(i) / samples_per_second;
    Advance(x, t - 1.0 / samples_per_second, 1.0 / samples_per_second, rates);
    std::printf("%.2f", t);
    for (size_t j = 0; j < 4; ++j) {
      std::printf(",%.5f", x[j] + noise_m * StandardNormal(generator));
    }
    std::puts("");
  }
}

}  // namespace demo
