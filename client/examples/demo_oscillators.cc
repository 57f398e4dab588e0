// One mass on a spring and a damper, in closed forms or small steps of them.

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "client/examples/demo_records.h"

namespace demo {

using std::numbers::pi;

// m ẍ + c ẋ + k x = 0 from rest at x₀, with δ = c/2m and ω = √(k/m − δ²):
//   x(t) = x₀ e^(−δt) (cos ωt + δ/ω sin ωt)
void WriteOscillator() {
  // The truth, which oscillator.json does not know; neither k nor c is at its prior's centre.
  constexpr double m_kg = 1.0;
  constexpr double k_n_per_m = 41.3;
  constexpr double c_n_s_per_m = 0.23;
  constexpr double x0_m = 1.0;
  constexpr double noise_m = 0.01;
  constexpr int samples_per_second = 20;
  constexpr int seconds = 50;

  const double delta = c_n_s_per_m / (2 * m_kg);
  const double omega = std::sqrt(k_n_per_m / m_kg - delta * delta);
  std::mt19937_64 generator(20'061'109);
  std::puts("t,x");
  for (int i = 1; i <= seconds * samples_per_second; ++i) {
    const double t = static_cast<double>(i) / samples_per_second;
    const double x =
        x0_m * std::exp(-delta * t) * (std::cos(omega * t) + delta / omega * std::sin(omega * t));
    std::printf("%.2f,%.5f\n", t, x + noise_m * StandardNormal(generator));
  }
}

// The oscillator again, k = 41.3 N/m and c = 0.23 N s/m, pushed by a random force: white noise of
// 0.02 (m/s)²/s on the velocity, here a push each millisecond.
void WriteDisturbed() {
  constexpr double k = 41.3;
  constexpr double delta = 0.23 / 2;
  constexpr double spectral_density = 0.02;
  constexpr double noise_m = 0.005;
  constexpr double step_s = 0.001;
  constexpr int steps_per_sample = 50;
  const double omega = std::sqrt(k - delta * delta);
  const double decay = std::exp(-delta * step_s);
  const double cosine = std::cos(omega * step_s), sine = std::sin(omega * step_s) / omega;
  std::mt19937_64 generator(20'061'117);
  double x = 1, v = 0;
  std::puts("t,x");
  for (int i = 1; i <= 1000; ++i) {
    for (int step = 0; step < steps_per_sample; ++step) {
      const double next = decay * ((cosine + delta * sine) * x + sine * v);
      v = decay * ((cosine - delta * sine) * v - k * sine * x) +
          std::sqrt(spectral_density * step_s) * StandardNormal(generator);
      x = next;
    }
    std::printf("%.2f,%.5f\n", i * steps_per_sample * step_s,
                x + noise_m * StandardNormal(generator));
  }
}

// The oscillator again, k = 41.3 N/m, shaken by a force of 2 N at 1 Hz, with a damper that warms
// up: c falls from 1.2 to 0.8 N s/m, with a time constant of 20 s.
void WriteWarming() {
  constexpr double k = 41.3;
  constexpr double noise_m = 0.005;
  constexpr double step_s = 0.001;
  constexpr int steps_per_sample = 50;
  std::mt19937_64 generator(20'061'118);
  double x = 0, v = 0;
  std::puts("t,x");
  for (int i = 0; i < 1200; ++i) {
    for (int step = 0; step < steps_per_sample; ++step) {
      // Leapfrog: the middle of the step for the force and the damper.
      const double t = (i * steps_per_sample + step + 0.5) * step_s;
      const double c = 0.8 + 0.4 * std::exp(-t / 20);
      x += 0.5 * step_s * v;
      const double force = 2 * std::sin(2 * pi * t) - k * x;
      v = ((1 - 0.5 * step_s * c) * v + step_s * force) / (1 + 0.5 * step_s * c);
      x += 0.5 * step_s * v;
    }
    std::printf("%.2f,%.5f\n", (i + 1) * steps_per_sample * step_s,
                x + noise_m * StandardNormal(generator));
  }
}

// The oscillator again, k = 41.3 N/m and c = 0.23 N s/m, by a sensor whose noise of 8 mm hangs
// together over 0.2 s and that gives nonsense 3 times in 100.
void WriteRoughSensor() {
  constexpr double delta = 0.23 / 2;
  constexpr double noise_m = 0.008;
  constexpr double time_constant_s = 0.2;
  constexpr double interval_s = 0.05;
  const double omega = std::sqrt(41.3 - delta * delta);
  const double a = std::exp(-interval_s / time_constant_s);
  std::mt19937_64 generator(20'061'113);
  double e = StandardNormal(generator);
  std::puts("t,x");
  for (int i = 1; i <= 600; ++i) {
    const double t = interval_s * i;
    const double x =
        std::exp(-delta * t) * (std::cos(omega * t) + delta / omega * std::sin(omega * t));
    const bool nonsense = generator() % 100 < 3;
    std::printf("%.2f,%.5f\n", t, nonsense ? 0.5 * StandardNormal(generator) : x + noise_m * e);
    e = a * e + std::sqrt(1 - a * a) * StandardNormal(generator);
  }
}

// The oscillator let go three times by hand, from elsewhere and with another push each time.
void WriteReleases() {
  constexpr double k_n_per_m = 41.3;
  constexpr double c_n_s_per_m = 0.23;
  constexpr double noise_m = 0.01;
  constexpr double displacement_m[] = {0.83, -0.42, 1.17};
  constexpr double velocity_m_per_s[] = {0.6, -1.3, 0.2};
  const double delta = 0.5 * c_n_s_per_m;
  const double omega = std::sqrt(k_n_per_m - delta * delta);
  std::mt19937_64 generator(20'061'121);
  std::puts("t,run,x");
  for (int run = 0; run < 3; ++run) {
    const double x0 = displacement_m[run], b = (velocity_m_per_s[run] + delta * x0) / omega;
    for (int i = 1; i <= 100; ++i) {
      const double t = 0.04 * i;
      const double x = std::exp(-delta * t) * (x0 * std::cos(omega * t) + b * std::sin(omega * t));
      std::printf("%.2f,%d,%.5f\n", t, run, x + noise_m * StandardNormal(generator));
    }
  }
}

// Twenty specimens of the oscillator, whose springs are of one population, each let go once.
void WriteSpecimens() {
  constexpr double mean_n_per_m = 41.3, spread_n_per_m = 1.6;
  constexpr double delta = 0.23 / 2, noise_m = 0.05;
  std::mt19937_64 generator(20'061'157);
  std::puts("t,run,x");
  for (int run = 0; run < 20; ++run) {
    const double stiffness = mean_n_per_m + spread_n_per_m * StandardNormal(generator);
    const double omega = std::sqrt(stiffness - delta * delta);
    for (int i = 1; i <= 20; ++i) {
      const double t = 0.05 * i;
      const double x =
          std::exp(-delta * t) * (std::cos(omega * t) + delta / omega * std::sin(omega * t));
      std::printf("%.2f,%d,%.4f\n", t, run, x + noise_m * StandardNormal(generator));
    }
  }
}

}  // namespace demo
