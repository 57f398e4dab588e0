#pragma once

// What a sample tells a Gaussian where the sample's noise has Student's t distribution.
//
// Problem: an output has the distribution N(ẑ, a), and the sample is z = output + σ t, t with ν
// degrees of freedom. Student's t is a scale mixture of normals, t | λ ~ N(0, 1/λ) with λ ~
// Gamma(ν/2, rate ν/2), so that with e = z − ẑ, r_λ = σ²/λ and S_λ = a + r_λ
//
//   p(e) = ∫ N(e; 0, S_λ) p(λ) dλ,   π(λ) = p(λ) N(e; 0, S_λ)/p(e),
//   mean       m + P_xz A e,                        A = E_π[1/S_λ],
//   covariance P − P_xz (A − B) P_xzᵀ,              B = e² Var_π(1/S_λ),
//
// which are exact: the Gaussian with these moments goes on. A sample far off has a small A and
// leaves the state where it is; one that may or may not be far off widens it (B > A). With K = P_xz
// A the covariance is Σ (x − K y)(x − K y)ᵀ + R K Kᵀ over the vectors of the factor (x of the
// states, y of the output), R = (E_π[r_λ/S_λ] + B/A)/A, in which nothing is subtracted.
//
// The likelihood is written as for a Gaussian: −log p(e) = ½ w² + ½ l + constant, where
//
//   l = 2 log(p_0/p(0)),  p_0 the density at 0 for a = 0 and the noise as stated,
//   w = ± √(2 log(p(0)/p(e))) with the sign of e,
//
// so that w = e/√S and l = log(S/σ²) for ν → ∞, and w grows as √log |e| for ν finite.
//
// λ is integrated by the trapezoidal rule in log λ with the step h, which is exact to about
// |Γ(ν/2 + 2πi/h)|/Γ(ν/2): 3e-7 for ν = 4. As its weights are normalized, the sum is a distribution
// itself, whose tail is that of t to 1 % up to 100 σ, and a Gaussian's far beyond.
//
// Source: Masreliez, Approximate Non-Gaussian Filtering with Linear State and Observation
// Relations, IEEE Transactions on Automatic Control 20 (1975) 107–110, for the moments.

#include <array>
#include <cstddef>

namespace polyest::internal {

// ν of the noise of samples with outliers, that of OutlierHandling::kStudentT.
inline constexpr double kTailDegreesOfFreedom = 4;

class HeavyTail {
 public:
  explicit HeavyTail(double degrees_of_freedom = kTailDegreesOfFreedom);

  struct Result {
    double innovation = 0;      // w
    double log_variance = 0;    // l
    double gain_variance = 1;   // 1/A
    double noise_variance = 0;  // R
    double spread = 1;          // 1/(A − B), whose sign may be either
  };
  // `error`: e; `variance`: a ≥ 0; `scale`: σ > 0; `stated`: σ > 0 as stated, for p_0.
  Result Take(double error, double variance, double scale, double stated) const;

 private:
  static constexpr size_t kNodes = 27;
  struct Node {
    double inverse_precision = 1;  // 1/λ
    double probability = 0;
  };
  std::array<Node, kNodes> nodes_;  // with the largest 1/λ first
  double peak_ = 0;                 // E[√λ]
};

}  // namespace polyest::internal
