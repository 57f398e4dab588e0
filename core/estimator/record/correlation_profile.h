#pragma once

// The likelihood of a channel's residuals for several time constants τ of their correlation at
// once, with the parameters following.
//
// Let v_k = (∂y_k/∂η, e_k)/σ_k be the gradient of the output and the residual at a fixed point η_c,
// in units of the noise. For noise with the correlation a_k = exp(−(t_k − t_{k−1})/τ) of successive
// samples,
//   u_k = (v_k − a_k v_{k−1})/√(1 − a_k²),   u_k = v_k where a run begins,
// are independent, whatever the sampling times. With
//   ( G  b ; bᵀ w ) = Σ u_k u_kᵀ,   D = Σ ½ log(1 − a_k²),
// the residuals of the linearized model at η_c + δ have the χ² δᵀGδ − 2 bᵀδ + w, and −log of their
// likelihood, with δ integrated out over a Gaussian prior of precision P about η_c, is up to a
// constant
//   ½ N log s² + ½ χ²/s² + ½ δᵀPδ + D + ½ log |G/s² + P|,   at δ = (G + s²P)⁻¹ b,
// where s is the scale of the noise: 1, or s² = χ²/(N − p) if it is unknown, p = tr (G + s²P)⁻¹ G.
//
// Source: Harville, Maximum likelihood approaches to variance component estimation, Journal of the
// American Statistical Association 72 (1977) 320–338.

#include <cstdint>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

// The time constants that are compared: white noise, and kSteps values from the shortest to the
// longest in geometric progression. Empty if longest_s is 0.
struct TimeConstantGrid {
  double shortest_s = 0;
  double longest_s = 0;

  static constexpr int kSteps = 24;

  bool empty() const { return longest_s <= 0; }
  // Returns value `step` of the progression, 0 … kSteps − 1.
  double At(int step) const;
};

class CorrelationProfile {
 public:
  // Makes an empty profile, which ignores everything.
  CorrelationProfile() = default;
  // Makes a profile over n unknowns. The rows added are whitened with the time constant `present_s`
  // (0: not at all), which joins those of the grid.
  CorrelationProfile(const TimeConstantGrid& grid, double present_s, Eigen::Index unknowns);

  bool empty() const { return members_.empty(); }
  // Forgets the previous sample, because correlation does not extend over runs.
  void BeginRun();
  // Adds a sample: its whitened gradient (n) and residual in units of the whitened noise, and its
  // weight in the sums, 1 unless it is an outlier or the expansion has an error of its own. Takes
  // O(n²) operations for each time constant and does not allocate.
  void Add(double time_s, const ConstVectorRef& gradient, double residual, double weight = 1);

  // The sums for one time constant.
  struct Member {
    double time_constant_s = 0;
    double log_determinant = 0;  // D
    Matrix gram;                 // Σ u uᵀ, (n + 1) × (n + 1), its upper triangle
    double correlation = 0;      // a_k and log √(1 − a_k²) for the interval of the last sample
    double log_innovation = 0;

    template <class Archive>
    void serialize(Archive& archive) {
      archive(time_constant_s, log_determinant, gram, correlation, log_innovation);
    }
  };
  // Returns the members: present, white, and the grid's in ascending order.
  const std::vector<Member>& members() const { return members_; }

  static constexpr size_t kPresent = 0, kWhite = 1, kFirstOfGrid = 2;

  // Whether the profile could be one that was made like the other.
  bool HasSizesOf(const CorrelationProfile& other) const;

  // Writes to or reads from a cereal archive. The shapes of what is read are not checked.
  template <class Archive>
  void serialize(Archive& archive) {
    archive(known_, time_s_, interval_s_, previous_, members_);
  }

 private:
  void SetInterval(double interval_s);

  uint8_t known_ = 0;       // whether there is a previous sample
  double time_s_ = 0;       // of the previous sample
  double interval_s_ = -1;  // for which the members' correlations are set
  Vector previous_;         // v of the previous sample, n + 1
  Vector row_;              // scratch
  std::vector<Member> members_;
};

// What a time constant makes of the residuals.
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
