// Writes the demonstration record oscillator.csv to the standard output: the free vibration of a
// damped oscillator as a displacement sensor with noise would see it. The same bytes every time.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <random>

namespace {

// The truth, which oscillator.json does not know; neither is at the centre of its prior.
constexpr double kMass_kg = 1.0;
constexpr double kStiffness_n_per_m = 41.3;
constexpr double kDamping_n_s_per_m = 0.23;
constexpr double kInitialDisplacement_m = 1.0;  // released from rest

constexpr double kNoise_m = 0.01;
constexpr int kSamplesPerSecond = 20;
constexpr int kSeconds = 50;

// m ẍ + c ẋ + k x = 0 from rest at x₀, with δ = c/2m and ω = √(k/m − δ²):
//   x(t) = x₀ e^(−δt) (cos ωt + δ/ω sin ωt)
double Displacement(double time_s) {
  const double delta = kDamping_n_s_per_m / (2 * kMass_kg);
  const double omega = std::sqrt(kStiffness_n_per_m / kMass_kg - delta * delta);
  return kInitialDisplacement_m * std::exp(-delta * time_s) *
         (std::cos(omega * time_s) + delta / omega * std::sin(omega * time_s));
}

// Box–Muller: the standard library's normal distribution may differ from one library to another.
double StandardNormal(std::mt19937_64& generator) {
  const auto uniform = [&generator] {  // in (0, 1)
    return (static_cast<double>(generator() >> 11) + 0.5) * 0x1p-53;
  };
  const double radius = std::sqrt(-2 * std::log(uniform()));
  return radius * std::cos(2 * std::numbers::pi * uniform());
}

}  // namespace

int main() {
  std::mt19937_64 generator(20'061'109);
  std::puts("t,x");
  for (int i = 1; i <= kSeconds * kSamplesPerSecond; ++i) {
    const double time_s = static_cast<double>(i) / kSamplesPerSecond;
    std::printf("%.2f,%.5f\n", time_s, Displacement(time_s) + kNoise_m * StandardNormal(generator));
  }
  return 0;
}
