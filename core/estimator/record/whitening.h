#pragma once

// Whitens correlated noise. Let the noise of a channel's k-th sample be correlated with that of the
// sample before by a_k = exp(−(t_k − t_{k−1})/τ). The innovations
//   z'_k = z_k − g_k z_{k−1},   g_k = a_k σ_k/σ_{k−1},   σ'_k² = σ_k² (1 − a_k²)
// then have independent noise. The model's outputs are combined in the same way, so all later steps
// may treat the samples as white. This is exact for any sampling times; a missing sample only
// lengthens the next interval. Each run begins anew.

#include <vector>

#include "core/common/types.h"
#include "core/estimator/record/learned_noise.h"
#include "polyest/samples.h"

namespace polyest::internal {

// The previous sample of one channel. Nothing else of a run is kept.
struct PreviousSample {
  bool known = false;
  double time_s = 0;
  double value = 0;
  double noise = 0;
  Vector output;  // of each trajectory; unspecified while not known
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
    PreviousSample previous;
    Vector scratch;
  };

  static void Whiten(Channel& channel, double time_s, double& value, double& noise,
                     VectorRef output);

  std::vector<Channel> channels_;
};

}  // namespace polyest::internal
