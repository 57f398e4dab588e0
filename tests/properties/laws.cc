#include "tests/properties/laws.h"

#include <absl/strings/str_format.h>

#include <cmath>
#include <numbers>

namespace polyest::internal::properties {
namespace {

using std::numbers::pi;

// Draws a density of a positive parameter about `middle`, of a relative half width.
Density Positive(Random& random, double middle, double half_width) {
  switch (random.Integer(0, 2)) {
    case 0:
      return Density::Uniform(middle * (1 - half_width), middle * (1 + half_width));
    case 1:
      return Density::Parabola(middle * (1 - half_width), middle * (1 + half_width));
    default:
      return Density::Lognormal(middle, 0.6 * half_width);
  }
}

// Returns a linear parameter of random prior.
Law::Linear Coefficient(Random& random, const char* name) {
  return {name, random.Uniform(-2, 2), random.LogUniform(0.1, 3)};
}

// y = b0 + b1 t/T + b2 (t/T)² + b3 sin(2π t/T), as many of the terms as drawn.
Law Regression(Random& random) {
  Law law;
  law.name = "regression";
  law.until_s = random.LogUniform(1, 100);
  const double period = law.until_s;
  const int terms = random.Integer(1, kMaxLinear);
  const std::string texts[] = {"b0 + 0*t", absl::StrFormat(" + b1*t/%.17g", period),
                               absl::StrFormat(" + b2*(t/%.17g)^2", period),
                               absl::StrFormat(" + b3*sin(2*pi*t/%.17g)", period)};
  const char* names[] = {"b0", "b1", "b2", "b3"};
  std::string y;
  for (int j = 0; j < terms; ++j) {
    y += texts[j];
    law.linear.push_back(Coefficient(random, names[j]));
  }
  law.equations.outputs = {{"y", y}};
  law.shapes = [=](const double*, double t, double* g) {
    const double all[] = {1, t / period, t / period * t / period, std::sin(2 * pi * t / period)};
    g[0] = 0;
    for (int j = 0; j < terms; ++j) g[1 + j] = all[j];
  };
  return law;
}

// y = a + b t with bounded priors.
Law BoundedLine(Random& random) {
  Law law;
  law.name = "bounded line";
  law.until_s = random.LogUniform(0.5, 5);
  const bool sloped = random.Chance(0.7);
  law.equations.outputs = {{"y", sloped ? "a + b*t" : "a + 0*t"}};
  law.nonlinear.push_back({"a", Positive(random, 2, 0.8)});
  if (sloped) law.nonlinear.push_back({"b", Density::Uniform(-1, 1)});
  law.shapes = [=](const double* nu, double t, double* g) {
    g[0] = nu[0] + (sloped ? nu[1] * t : 0);
  };
  return law;
}

// ẋ = q − a x, x(0) = x_0: x = x_0 e^{−at} + q (1 − e^{−at})/a.
Law Decay(Random& random) {
  Law law;
  law.name = "decay";
  law.until_s = random.LogUniform(0.5, 20);
  law.equations.states = {{"x", "q - a*x"}};
  law.equations.outputs = {{"y", "x"}};
  law.nonlinear.push_back({"a", Positive(random, random.LogUniform(0.2, 3), 0.8)});
  law.linear.push_back({"x_0", random.Uniform(0.5, 2), random.LogUniform(0.05, 1)});
  const bool driven = random.Chance(0.5);
  if (driven) law.linear.push_back(Coefficient(random, "q"));
  law.equations.parameters = {{"q", 0}};
  law.shapes = [=](const double* nu, double t, double* g) {
    g[0] = 0;
    g[1] = std::exp(-nu[0] * t);
    if (driven) g[2] = -std::expm1(-nu[0] * t) / nu[0];
  };
  return law;
}

// ẋ = a x, x(0) = x_0.
Law Growth(Random& random) {
  Law law;
  law.name = "growth";
  law.until_s = random.LogUniform(1, 20);
  law.equations.states = {{"x", "a*x"}};
  law.equations.outputs = {{"y", "x"}};
  law.equations.parameters = {{"x_0", 1}};
  const double most = random.Uniform(0.5, 12) / law.until_s;  // up to e¹² times as large
  law.nonlinear.push_back({"a", random.Chance(0.5) ? Density::Uniform(-0.2 * most, most)
                                                   : Density::Normal(0.5 * most, 0.15 * most)});
  const bool uncertain = random.Chance(0.5);
  if (uncertain) law.linear.push_back({"x_0", 1, random.LogUniform(0.02, 0.5)});
  law.shapes = [=](const double* nu, double t, double* g) {
    g[0] = uncertain ? 0 : std::exp(nu[0] * t);
    g[1] = std::exp(nu[0] * t);
  };
  return law;
}

// ẋ = r x (1 − x/K), x(0) = 0.1: x = K/(1 + (K/0.1 − 1) e^{−rt}).
Law Logistic(Random& random) {
  Law law;
  law.name = "logistic";
  law.until_s = random.LogUniform(2, 30);
  law.equations.states = {{"x", "r*x*(1 - x/K)"}};
  law.equations.outputs = {{"y", "x"}};
  law.equations.parameters = {{"x_0", 0.1}};
  law.nonlinear.push_back({"r", Positive(random, 1, 0.8)});
  law.nonlinear.push_back({"K", Positive(random, 2, 0.7)});
  law.shapes = [](const double* nu, double t, double* g) {
    g[0] = nu[1] / (1 + (nu[1] / 0.1 - 1) * std::exp(-nu[0] * t));
  };
  return law;
}

// y = cos(2π f t), or A cos(2π f t) + B sin(2π f t) + b.
Law Cosine(Random& random) {
  Law law;
  law.name = "cosine";
  law.until_s = random.LogUniform(1, 20);
  const bool plain = random.Chance(0.4);
  law.equations.outputs = {
      {"y", plain ? "cos(2*pi*f*t)" : "A*cos(2*pi*f*t) + B*sin(2*pi*f*t) + b"}};
  law.nonlinear.push_back(
      {"f", Positive(random, random.Uniform(0.5, 3), random.Uniform(0.1, 0.8))});
  if (!plain) {
    law.linear.push_back({"A", 1, random.LogUniform(0.1, 1)});
    law.linear.push_back({"B", 0, random.LogUniform(0.1, 1)});
    law.linear.push_back({"b", 0, random.LogUniform(0.1, 1)});
  }
  law.shapes = [=](const double* nu, double t, double* g) {
    g[0] = plain ? std::cos(2 * pi * nu[0] * t) : 0;
    g[1] = std::cos(2 * pi * nu[0] * t);
    g[2] = std::sin(2 * pi * nu[0] * t);
    g[3] = 1;
  };
  return law;
}

// ẍ = −k x − c ẋ from x_0, v_0: with w² = k − c²/4,
// x = e^{−ct/2} ((cos wt + c/2w sin wt) x_0 + sin wt/w v_0).
Law Oscillator(Random& random) {
  Law law;
  law.name = "oscillator";
  law.until_s = random.LogUniform(0.3, 20);
  law.equations.states = {{"x", "v"}, {"v", "-(k*x + c*v)"}};
  law.equations.outputs = {{"y", "x"}};
  law.equations.parameters = {{"x_0", 1}};
  law.nonlinear.push_back({"k", Positive(random, 40, random.Uniform(0.05, 0.6))});
  law.nonlinear.push_back({"c", Positive(random, random.LogUniform(0.05, 2), 0.8)});
  const bool uncertain = random.Chance(0.5);
  if (uncertain) {
    law.linear.push_back({"x_0", 1, random.LogUniform(0.02, 1)});
    law.linear.push_back({"v_0", 0, random.LogUniform(0.2, 5)});
  }
  law.shapes = [=](const double* nu, double t, double* g) {
    const double half = 0.5 * nu[1];
    const double square = nu[0] - half * half;
    const double w = std::sqrt(std::abs(square));
    // e^{−ct/2} cos wt and e^{−ct/2} sin wt, or cosh and sinh beyond critical damping.
    const double slow = std::exp((w - half) * t), fast = std::exp(-(w + half) * t);
    const double decay = std::exp(-half * t);
    const double cosine = square > 0 ? decay * std::cos(w * t) : 0.5 * (slow + fast);
    const double sine = square > 0 ? decay * std::sin(w * t) : 0.5 * (slow - fast);
    g[1] = cosine + half / w * sine;
    g[2] = sine / w;
    g[0] = uncertain ? 0 : g[1];
  };
  return law;
}

// y = a (1 − e^{−t/s}) + b.
Law Saturation(Random& random) {
  Law law;
  law.name = "saturation";
  law.until_s = random.LogUniform(1, 10);
  law.equations.outputs = {{"y", "a*(1 - exp(-t/s)) + b"}};
  law.nonlinear.push_back({"s", Positive(random, random.LogUniform(0.3, 5), 0.8)});
  law.linear.push_back({"a", 1, random.LogUniform(0.1, 1)});
  law.linear.push_back({"b", 0, random.LogUniform(0.1, 1)});
  law.shapes = [](const double* nu, double t, double* g) {
    g[0] = 0;
    g[1] = -std::expm1(-t / nu[0]);
    g[2] = 1;
  };
  return law;
}

// y = p² + q t, in two pieces.
Law Square(Random& random) {
  Law law;
  law.name = "square";
  law.until_s = random.LogUniform(1, 10);
  const bool sloped = random.Chance(0.5);
  law.equations.outputs = {{"y", sloped ? "p^2 + q*t" : "p^2 + 0*t"}};
  law.nonlinear.push_back({"p", random.Chance(0.5) ? Density::Uniform(-2, 2)
                                                   : Density::Normal(random.Uniform(0, 1), 1)});
  if (sloped) law.linear.push_back({"q", 0, random.LogUniform(0.1, 1)});
  law.shapes = [](const double* nu, double t, double* g) {
    g[0] = nu[0] * nu[0];
    g[1] = t;
  };
  return law;
}

// y = p q (1 − e^{−t}), a curved valley.
Law Product(Random& random) {
  Law law;
  law.name = "product";
  law.until_s = random.LogUniform(1, 5);
  law.equations.outputs = {{"y", "p*q*(1 - exp(-t))"}};
  law.nonlinear.push_back({"p", Positive(random, 1, 0.8)});
  law.nonlinear.push_back({"q", Positive(random, 2, 0.8)});
  law.shapes = [](const double* nu, double t, double* g) {
    g[0] = -nu[0] * nu[1] * std::expm1(-t);
  };
  return law;
}

// y = V t/(K + t) (Michaelis and Menten).
Law Hyperbola(Random& random) {
  Law law;
  law.name = "hyperbola";
  law.until_s = random.LogUniform(1, 10);
  law.equations.outputs = {{"y", "V*t/(K + t)"}};
  law.nonlinear.push_back({"K", Positive(random, random.LogUniform(0.3, 5), 0.8)});
  law.linear.push_back({"V", 1, random.LogUniform(0.1, 1)});
  law.shapes = [](const double* nu, double t, double* g) {
    g[0] = 0;
    g[1] = t / (nu[0] + t);
  };
  return law;
}

}  // namespace

Law DrawLaw(Random& random) {
  using Make = Law (*)(Random&);
  constexpr Make kLaws[] = {Regression, BoundedLine, Decay,      Growth, Logistic, Cosine,
                            Oscillator, Oscillator,  Saturation, Square, Product,  Hyperbola};
  return kLaws[random.Integer(0, std::size(kLaws) - 1)](random);
}

}  // namespace polyest::internal::properties
