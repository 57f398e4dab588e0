// Writes a demonstration record to the standard output, by its only argument: oscillator,
// disturbed, warming, rough_sensor, releases, roll_plane, roll_plane_4dof, quarter_car, bicycle,
// damper_rig or chain.
// Closed forms, or the equations of motion written down again and integrated in small fixed steps,
// with noise; the same bytes every time.

#include <algorithm>
#include <array>
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

// The classical Runge–Kutta method of order 4 over one sample, in so small steps that its error is
// far below the last digit written.
template <size_t kStates, class Rates>
void Advance(std::array<double, kStates>& x, double t, double duration, const Rates& rates) {
  constexpr int steps = 100;
  const double h = duration / steps;
  const auto moved = [&x](double by, const std::array<double, kStates>& along) {
    std::array<double, kStates> y = x;
    for (size_t i = 0; i < kStates; ++i) y[i] += by * along[i];
    return y;
  };
  for (int step = 0; step < steps; ++step) {
    const double begin = t + step * h;
    const auto a = rates(begin, x);
    const auto b = rates(begin + h / 2, moved(h / 2, a));
    const auto c = rates(begin + h / 2, moved(h / 2, b));
    const auto d = rates(begin + h, moved(h, c));
    for (size_t i = 0; i < kStates; ++i) x[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
}

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

}  // namespace

int main(int argc, char** argv) {
  const std::string record = argc == 2 ? argv[1] : "";
  if (record == "oscillator") {
    WriteOscillator();
  } else if (record == "disturbed") {
    WriteDisturbed();
  } else if (record == "warming") {
    WriteWarming();
  } else if (record == "rough_sensor") {
    WriteRoughSensor();
  } else if (record == "releases") {
    WriteReleases();
  } else if (record == "roll_plane") {
    WriteRollPlane();
  } else if (record == "roll_plane_4dof") {
    WriteHalfCar();
  } else if (record == "quarter_car") {
    WriteQuarterCar();
  } else if (record == "bicycle") {
    WriteBicycle();
  } else if (record == "damper_rig") {
    WriteDamperRig();
  } else if (record == "chain") {
    WriteChain();
  } else {
    std::fputs(
        "usage: generate_demo "
        "oscillator|disturbed|warming|rough_sensor|releases|roll_plane|roll_plane_4dof|quarter_car|"
        "bicycle|damper_rig|chain\n",
        stderr);
    return 2;
  }
  return 0;
}
