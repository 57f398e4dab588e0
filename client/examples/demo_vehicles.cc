// Cars and halves and quarters of them.

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

}  // namespace

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

namespace {

double HalfSine(double t, double start) {
  constexpr double height_m = 0.05;
  constexpr double duration_s = 0.2;
  const double phase = (t - start) / duration_s;
  return phase < 0 || phase > 1 ? 0 : height_m * std::sin(pi * phase);
}

// A bar with a point mass on two suspensions, wheels and tyres. With the point mass at the share
// s of the length, the bar's end accelerations follow from the balance of forces and of moments
// about the left end, M at the middle and m_a at s:
//   M (a₁ + a₂)/2 + m_a ((1 − s) a₁ + s a₂) = −F₁ − F₂
//   M (a₁ + a₂)/4 + I (a₂ − a₁)/L² + m_a s ((1 − s) a₁ + s a₂) = −F₂
std::array<double, 8> HalfCarRates(double t, const std::array<double, 8>& x) {
  // The truth, which roll_plane_4dof.json does not know.
  constexpr double m_a_kg = 185.0;
  constexpr double d_m = 0.48;
  constexpr double mass_kg = 580.0;
  constexpr double length_m = 1.524;
  constexpr double roll_kg = 63.3316 / (length_m * length_m);
  constexpr double wheel_kg = 36.26;
  constexpr double s = d_m / length_m;

  const auto force = [](double travel, double rate) {
    return 19357.2 * travel + 1e5 * travel * travel * travel + 142.14 * std::tanh(10 * rate);
  };
  const double force1 = force(x[0] - x[2], x[4] - x[6]);
  const double force2 = force(x[1] - x[3], x[5] - x[7]);
  constexpr double p = mass_kg / 2 + m_a_kg * (1 - s), q = mass_kg / 2 + m_a_kg * s;
  constexpr double u = mass_kg / 4 - roll_kg + m_a_kg * s * (1 - s);
  constexpr double v = mass_kg / 4 + roll_kg + m_a_kg * s * s;
  const double right1 = -force1 - force2;
  const double right2 = -force2;
  const double tyre1 = 96319.76 * (HalfSine(t, 0.5) - x[2]);
  const double tyre2 = 96319.76 * (HalfSine(t, 1.1) - x[3]);
  return {x[4],
          x[5],
          x[6],
          x[7],
          (v * right1 - q * right2) / (p * v - q * u),
          (p * right2 - u * right1) / (p * v - q * u),
          (force1 + tyre1) / wheel_kg,
          (force2 + tyre2) / wheel_kg};
}

}  // namespace

void WriteHalfCar() {
  constexpr int samples_per_second = 100;
  constexpr int seconds = 5;
  std::array<double, 8> x{};
  std::array<double, 4> largest{};
  std::mt19937_64 generator(20'061'113);
  std::puts("t,d1,d2,d1_rate,d2_rate");
  for (int i = 1; i <= seconds * samples_per_second; ++i) {
    const double t = static_cast<double>(i) / samples_per_second;
    Advance(x, static_cast<double>(i - 1) / samples_per_second, 1.0 / samples_per_second,
            HalfCarRates);
    std::printf("%.2f", t);
    const std::array<double, 4> outputs = {x[0] - x[2], x[1] - x[3], x[4] - x[6], x[5] - x[7]};
    for (size_t j = 0; j < outputs.size(); ++j) {
      // 1 % of the value and 0.1 % of the largest so far; 10⁻⁶ at rest.
      largest[j] = std::max(largest[j], std::abs(outputs[j]));
      const double noise = std::max(1e-6, 0.01 * std::abs(outputs[j]) + 0.001 * largest[j]);
      std::printf(",%.4g", outputs[j] + noise * StandardNormal(generator));
    }
    std::puts("");
  }
}

namespace {

// A smooth road: its height is known between the samples too, whatever interpolates them.
double Road(double t) {
  return 0.02 * std::sin(2 * pi * 0.9 * t) + 0.006 * std::sin(2 * pi * 2.3 * t) +
         0.002 * std::sin(2 * pi * 7.1 * t);
}

// F of the suspension, F = ks travel + cs travel'.
double QuarterCarForce(const std::array<double, 4>& x) {
  // The truth, which quarter_car.json does not know.
  constexpr double ks_n_per_m = 15800;
  constexpr double cs_n_s_per_m = 1180;
  return ks_n_per_m * (x[0] - x[1]) + cs_n_s_per_m * (x[2] - x[3]);
}

}  // namespace

void WriteQuarterCar() {
  constexpr double kt_n_per_m = 204000;  // the truth
  constexpr double sprung_kg = 290;
  constexpr double unsprung_kg = 59;
  constexpr double travel_noise_m = 0.0005;
  constexpr double acceleration_noise_m_per_s2 = 0.05;
  constexpr int samples_per_second = 100;
  constexpr int seconds = 5;
  const auto rates = [](double t, const std::array<double, 4>& x) -> std::array<double, 4> {
    const double force = QuarterCarForce(x);
    return {x[2], x[3], -force / sprung_kg, (force + kt_n_per_m * (Road(t) - x[1])) / unsprung_kg};
  };
  std::array<double, 4> x{};
  std::mt19937_64 generator(20'061'127);
  std::puts("t,road,travel,zs_accel");
  for (int i = 0; i <= seconds * samples_per_second; ++i) {
    const double t = static_cast<double>(i) / samples_per_second;
    if (i > 0) Advance(x, t - 1.0 / samples_per_second, 1.0 / samples_per_second, rates);
    const double travel = x[0] - x[1] + travel_noise_m * StandardNormal(generator);
    const double acceleration =
        -QuarterCarForce(x) / sprung_kg + acceleration_noise_m_per_s2 * StandardNormal(generator);
    std::printf("%.2f,%.5f,%.5f,%.3f\n", t, Road(t), travel, acceleration);
  }
}

namespace {

// A slalom of growing swing at a speed that varies a little: at first the tyres are linear, at the
// end they slide.
double Speed(double t) { return 19 + 1.5 * std::sin(2 * pi * 0.11 * t); }
double Steering(double t) { return 0.009 * t * std::sin(2 * pi * 0.45 * t); }

// v̇y + vx r and ṙ.
std::array<double, 2> BicycleAccelerations(double t, const std::array<double, 2>& x) {
  // The truth, which bicycle.json does not know.
  constexpr double yaw_kg_m2 = 2410, front_n_per_rad = 76500, rear_n_per_rad = 93800, mu = 0.87;
  constexpr double mass_kg = 1500, lf_m = 1.2, lr_m = 1.4, weight_n = mass_kg * 9.81;
  const auto tyre = [](double linear, double load) {
    return linear / std::hypot(1, linear / (mu * load));
  };
  const double vx = Speed(t);
  const double front_slip = Steering(t) - std::atan((x[0] + lf_m * x[1]) / vx);
  const double rear_slip = -std::atan((x[0] - lr_m * x[1]) / vx);
  const double front =
      std::cos(Steering(t)) * tyre(front_n_per_rad * front_slip, weight_n * lr_m / (lf_m + lr_m));
  const double rear = tyre(rear_n_per_rad * rear_slip, weight_n * lf_m / (lf_m + lr_m));
  return {(front + rear) / mass_kg, (lf_m * front - lr_m * rear) / yaw_kg_m2};
}

}  // namespace

void WriteBicycle() {
  constexpr double yaw_noise_rad_per_s = 0.005;
  constexpr double acceleration_noise_m_per_s2 = 0.1;
  constexpr int samples_per_second = 50;
  constexpr int seconds = 10;
  const auto rates = [](double t, const std::array<double, 2>& x) -> std::array<double, 2> {
    const auto [lateral, yaw] = BicycleAccelerations(t, x);
    return {lateral - Speed(t) * x[1], yaw};
  };
  std::array<double, 2> x{};
  std::mt19937_64 generator(20'061'131);
  std::puts("t,vx,delta,r,ay");
  for (int i = 0; i <= seconds * samples_per_second; ++i) {
    const double t = static_cast<double>(i) / samples_per_second;
    if (i > 0) Advance(x, t - 1.0 / samples_per_second, 1.0 / samples_per_second, rates);
    const double yaw_rate = x[1] + yaw_noise_rad_per_s * StandardNormal(generator);
    const double lateral =
        BicycleAccelerations(t, x)[0] + acceleration_noise_m_per_s2 * StandardNormal(generator);
    std::printf("%.2f,%.4f,%.5f,%.4f,%.3f\n", t, Speed(t), Steering(t), yaw_rate, lateral);
  }
}

}  // namespace demo
