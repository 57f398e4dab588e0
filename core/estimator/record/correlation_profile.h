#pragma once

// The likelihood of a channel's residuals for several correlations of their noise at once, with the
// parameters following.
//
// Let v_k = (∂y_k/∂η, e_k)/σ_k be the gradient of the output and the residual at a fixed point η_c,
// in units of the noise, and let the noise be white to the share f of its variance and correlated
// over τ for the rest. The filter of whitening.h,
//   a_k = exp(−(t_k − t_{k−1})/τ),   P_k⁻ = a_k² P_{k−1} + (1 − a_k²)(1 − f),   S_k = P_k⁻ + f,
//   u_k = (v_k − a_k v̂_{k−1})/√S_k,   v̂_k = v_k − (f/S_k)(v_k − a_k v̂_{k−1}),   P_k = P_k⁻ f/S_k,
// makes independent u_k of them, whatever the sampling times; where a run begins, v̂ = 0, P⁻ = 1 − f
// and S = 1. With
//   ( G  b ; bᵀ w ) = Σ u_k u_kᵀ,   D = Σ ½ log S_k,
// the residuals of the linearized model at η_c + δ have the χ² δᵀGδ − 2 bᵀδ + w, and −log of their
// likelihood, with δ integrated out over a Gaussian prior of precision P about η_c, is up to a
// constant
//   ½ N log s² + ½ χ²/s² + ½ δᵀPδ + D + ½ log |G/s² + P|,   at δ = (G + s²P)⁻¹ b,
// where s is the scale of the noise: 1, or s² = χ²/(N − p) if it is unknown, p = tr (G + s²P)⁻¹ G.
//
// Source: Harville, Maximum likelihood approaches to variance component estimation, Journal of the
// American Statistical Association 72 (1977) 320–338.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

// How the noise of a channel is correlated: the share of its variance that is white, and the time
// constant of the rest.
struct NoiseShape {
  double time_constant_s = 0;  // τ; 0 for white noise
  double white_share = 0;      // f, 0 ≤ f < 1; 0 for white noise, too

  bool operator==(const NoiseShape&) const = default;
  template <class Archive>
  void serialize(Archive& archive) {
    archive(time_constant_s, white_share);
  }
};

// The time constants that are compared: white noise, and kSteps values from the shortest to the
// longest in geometric progression. Empty if longest_s is 0.
struct TimeConstantGrid {
  double shortest_s = 0;
  double longest_s = 0;

  static constexpr int kSteps = 24;
  // The shortest time constant, in least intervals between samples: successive samples are then
  // correlated by e⁻⁴ = 0.02.
  static constexpr double kShortestInIntervals = 0.25;
  // Every kStride-th time constant is also compared with kShares white shares.
  static constexpr int kStride = 2;
  static constexpr int kShares = 10;

  bool empty() const { return longest_s <= 0; }
  // Returns value `step` of the progression, 0 … kSteps − 1.
  double At(int step) const;
  // Returns white share `index`, 0 … kShares − 1, for a time constant τ. f/(1 − f) ascends
  // geometrically over the range in which both parts can be seen, with n = τ ÷ the least interval:
  // beyond 2n the samples of one τ average to less than the white noise of their mean, and below
  // 1/(2n) the white part is less than what a sample adds to the correlated part.
  double ShareAt(double time_constant_s, int index) const;
};

// Steps of the differences by which a present noise that is white in part is refined: of log τ and
// of log f/(1 − f).
inline constexpr double kStepOfTimeConstant = 0.35;
inline constexpr double kStepOfShare = 0.5;
// Returns the noise that is so many steps from another that is white in part.
NoiseShape Neighbour(const NoiseShape& noise, double time_constant_steps, double share_steps);
// Factors of the time constant by which a present noise that is white in part is compared with
// others that differ from it over long times only.
inline constexpr double kLongTimeFactors[] = {0.25, 0.5, 2, 4};
// Returns the noise with another time constant that has as much white noise and, over times much
// shorter than the time constant, as much of the other: f τ/(1 − f) stays. The likelihood changes
// little between them, and may have several maxima.
NoiseShape AlikeOverShortTimes(const NoiseShape& noise, double factor);

class CorrelationProfile {
 public:
  // Makes an empty profile, which ignores everything.
  CorrelationProfile() = default;
  // Makes a profile over n unknowns. The rows added are whitened with the noise `present`, which
  // joins those of the grid.
  CorrelationProfile(const TimeConstantGrid& grid, const NoiseShape& present,
                     Eigen::Index unknowns);

  bool empty() const { return shapes_.empty(); }
  // Forgets the samples before, because correlation does not extend over runs.
  void BeginRun();
  // Adds a sample: its whitened gradient (n) and residual in units of the whitened noise, and its
  // weight in the sums, 1 unless it is an outlier or the expansion has an error of its own. Takes
  // O(n²) operations for each member and does not allocate.
  void Add(double time_s, const ConstVectorRef& gradient, double residual, double weight = 1);

  // The sums for one noise.
  struct Member {
    NoiseShape noise;
    double log_determinant = 0;  // D
    Matrix gram;                 // Σ u uᵀ, (n + 1) × (n + 1), its upper triangle
  };
  // Returns the members in the order of shapes().
  std::vector<Member> Members() const;

  // Returns the noises that are compared: the present one, white, those of the grid without a white
  // share in ascending order, those of the grid with white shares, and, if the present one is white
  // in part, its neighbours by −1, 0 and 1 steps of the time constant (outer) and the share, itself
  // in the middle, and those alike over short times.
  const std::vector<NoiseShape>& shapes() const { return shapes_; }
  static constexpr size_t kPresent = 0, kWhite = 1, kFirstOfGrid = 2;
  static constexpr size_t kFirstMixed = kFirstOfGrid + TimeConstantGrid::kSteps;
  static constexpr size_t kFirstNeighbour = kFirstMixed + TimeConstantGrid::kSteps /
                                                              TimeConstantGrid::kStride *
                                                              TimeConstantGrid::kShares;
  bool HasNeighbours() const { return shapes_.size() > kFirstNeighbour; }

  // Whether the profile could be one that was made like the other.
  bool HasSizesOf(const CorrelationProfile& other) const;

  // Writes to or reads from a cereal archive. The shapes of what is read are not checked.
  template <class Archive>
  void serialize(Archive& archive) {
    archive(known_, time_s_, shapes_, share_, variance_, state_, gram_, log_determinant_, product_);
  }

 private:
  void Allocate();
  void SetInterval(double interval_s);
  void Predict(double time_s);

  uint8_t known_ = 0;  // whether there is a sample before in the run
  double time_s_ = 0;  // of that sample
  std::vector<NoiseShape> shapes_;
  // By member, M, with columns for the n + 1 components of v or for their pairs i ≤ j, column
  // ½ j (j + 1) + i.
  Vector share_;            // f
  Vector variance_;         // P
  Matrix state_;            // v̂
  Matrix gram_;             // Σ u uᵀ
  Vector log_determinant_;  // D without the factors of the product
  Vector product_;          // Π S of the last samples

  // What follows from the interval before a sample, set for interval_s_, and scratch.
  double interval_s_ = -1;
  Vector correlation_, added_;  // a and (1 − a²)(1 − f)
  Vector innovation_, kept_, precision_, weighted_;
  Matrix difference_;
  Vector row_;
};

// What a noise makes of the residuals.
struct ProfileValue {
  double negative_log_likelihood = 0;
  double scale = 1;        // s
  double chi_squared = 0;  // at δ, in units of the working noise
};

// Returns the likelihood of a member as above. `degrees` is N; the columns of `unit` (n × n) are
// the prior's unit vectors, P = unit⁻ᵀ unit⁻¹.
ProfileValue EvaluateMember(const CorrelationProfile::Member& member, double degrees,
                            const ConstMatrixRef& unit, bool scale_unknown);

}  // namespace polyest::internal
