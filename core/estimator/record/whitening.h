#pragma once

// Whitens correlated noise. Let the noise of a channel's k-th sample be σ_k n_k, where the share f
// of the variance of n_k is white and the rest correlated with that of the sample before by
// a_k = exp(−(t_k − t_{k−1})/τ). The Kalman filter of the correlated part, with its estimate ê_k of
// variance P_k,
//   P_k⁻ = a_k² P_{k−1} + (1 − a_k²)(1 − f),   S_k = P_k⁻ + f,
//   z'_k = z_k − σ_k a_k ê_{k−1},   σ'_k² = σ_k² S_k,
//   σ_k ê_k = z_k − (f/S_k) z'_k,   P_k = P_k⁻ f/S_k,
// gives innovations z' of independent noise σ'. Without a white share this is
//   z'_k = z_k − a_k (σ_k/σ_{k−1}) z_{k−1},   σ'_k² = σ_k² (1 − a_k²).
// The filter is linear: it is applied to the model's outputs in the same way, so all later steps
// may treat the samples as white. This is exact for any sampling times; a missing sample only
// lengthens the next interval. Each run begins anew, with ê = 0 and P⁻ = 1 − f.
//
// Source: Kalman, A new approach to linear filtering and prediction problems, Journal of Basic
// Engineering 82 (1960) 35–45.

#include <vector>

#include "core/common/types.h"
#include "core/estimator/record/learned_noise.h"
#include "polyest/samples.h"

namespace polyest::internal {

// The previous sample of one channel, without what is its white noise by the filter: the sample as
// it was, where the noise has no white share. Nothing else of a run is kept.
struct PreviousSample {
  bool known = false;
  double time_s = 0;
  double value = 0;     // σ ê of the measured value
  double noise = 0;     // σ
  double variance = 0;  // P
  Vector output;        // σ ê of each trajectory's output; unspecified while not known
};

class Whitening {
 public:
  // Whitens outputs with `trajectories` rows.
  Whitening(const std::vector<ChannelNoise>& noise, Eigen::Index trajectories);

  // Forgets the previous samples, because correlation does not extend over runs.
  void BeginRun();
  // Whitens rows [first, first + count) of the block in place, in order: the values and the noise
  // of its channels, and the model's outputs (column (row − first)·m + channel). Also scales the
  // noise.
  void Apply(int first, int count, RowBlock& block, MatrixRef outputs);

  // Returns the previous sample of each channel.
  std::vector<PreviousSample> State() const;
  // Restores a state with the same numbers of channels and trajectories.
  void Restore(std::vector<PreviousSample> state);

 private:
  struct Channel {
    double scale = 1;
    double time_constant_s = 0;
    double white_share = 0;
    PreviousSample previous;
    Vector scratch;
  };

  static void Whiten(Channel& channel, double time_s, double& value, double& noise,
                     VectorRef output);

  std::vector<Channel> channels_;
};

}  // namespace polyest::internal
