// Writes a demonstration record to the standard output: oscillator.csv or roll_plane.csv, by its
// only argument. Closed forms with noise; the same bytes every time.

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>

namespace {

using std::numbers::pi;

// Box–Muller: the standard library's normal distribution may differ from one library to another.
double StandardNormal(std::mt19937_64& generator) {
  const auto uniform = [&generator] {  // in (0, 1)
    return (static_cast<double>(generator() >> 11) + 0.5) * 0x1p-53;
  };
  const double radius = std::sqrt(-2 * std::log(uniform()));
  return radius * std::cos(2 * pi * uniform());
}

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

// An undamped oscillator whose foot moves linearly from one sample to the next.
struct Mode {
  double omega;
  double y = 0;
  double v = 0;

  // ÿ = −ω² (y − u) with u = u₀ + s τ:
  //   y(τ) = u₀ + s τ + (y₀ − u₀) cos ωτ + (v₀ − s)/ω sin ωτ
  void Advance(double u0, double u1, double step) {
    const double s = (u1 - u0) / step;
    const double cosine = std::cos(omega * step);
    const double sine = std::sin(omega * step);
    const double a = y - u0;
    const double b = (v - s) / omega;
    y = u1 + a * cosine + b * sine;
    v = s + omega * (b * cosine - a * sine);
  }
};

// Road height: one bump of 5 cm that lasts 0.2 s, as the record writes it down.
double Bump(double t, double start) {
  constexpr double height_m = 0.05;
  constexpr double duration_s = 0.2;
  if (t < start || t > start + duration_s) return 0;
  return std::round(1e5 * height_m * std::sin(pi * (t - start) / duration_s)) / 1e5;
}

// The bar on two equal springs moves in two modes, h = (x₁ + x₂)/2 and r = (x₂ − x₁)/2, driven by
// the half sum and the half difference of u₁ and u₂:
//   M ḧ = −2k (h − (u₁ + u₂)/2),   I r̈ = −½ k L² (r − (u₂ − u₁)/2)
void WriteRollPlane() {
  // The truth, which roll_plane.json does not know.
  constexpr double mass_kg = 612.0;
  constexpr double inertia_kg_m2 = 58.5;
  constexpr double k_n_per_m = 19357.2;
  constexpr double length_m = 1.524;
  constexpr double noise_m = 0.0005;
  constexpr int samples_per_second = 100;
  constexpr int seconds = 5;

  Mode heave{std::sqrt(2 * k_n_per_m / mass_kg)};
  Mode roll{std::sqrt(0.5 * k_n_per_m * length_m * length_m / inertia_kg_m2)};
  std::mt19937_64 generator(20'061'111);
  std::puts("t,u1,u2,x1,x2");
  double before1 = 0;
  double before2 = 0;
  for (int i = 0; i <= seconds * samples_per_second; ++i) {
    const double t = static_cast<double>(i) / samples_per_second;
    const double u1 = Bump(t, 0.5);
    const double u2 = Bump(t, 1.1);
    if (i > 0) {
      heave.Advance((before1 + before2) / 2, (u1 + u2) / 2, 1.0 / samples_per_second);
      roll.Advance((before2 - before1) / 2, (u2 - u1) / 2, 1.0 / samples_per_second);
    }
    before1 = u1;
    before2 = u2;
    const double x1 = heave.y - roll.y + noise_m * StandardNormal(generator);
    const double x2 = heave.y + roll.y + noise_m * StandardNormal(generator);
    std::printf("%.2f,%.5f,%.5f,%.5f,%.5f\n", t, u1, u2, x1, x2);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string record = argc == 2 ? argv[1] : "";
  if (record == "oscillator") {
    WriteOscillator();
  } else if (record == "roll_plane") {
    WriteRollPlane();
  } else {
    std::fputs("usage: generate_demo oscillator | roll_plane\n", stderr);
    return 2;
  }
  return 0;
}
