#pragma once

// Turns correlated noise into white: with e_k the noise of a channel's k-th sample, correlated with
// the one before by a_k = exp(−(t_k − t_{k−1})/τ), the innovations
//   z'_k = z_k − g_k z_{k−1},   g_k = a_k σ_k/σ_{k−1},   σ'_k² = σ_k² (1 − a_k²)
// have independent noise. The model's outputs are combined alike, so that whatever follows may take
// the samples for white. Exact for any sampling times; a sample missing only makes the next
// interval longer. Each run begins anew.

#include <vector>

#include "core/common/types.h"
#include "core/estimator/record/learned_noise.h"
#include "polyest/samples.h"

namespace polyest::internal {

// The sample before, of one channel: all that is remembered of a run.
struct PreviousSample {
  bool known = false;
  double time_s = 0;
  double value = 0;
  double noise = 0;
  Vector output;  // of each trajectory; of any content while not known
};

class Whitening {
 public:
  // outputs have `trajectories` rows.
  Whitening(const std::vector<ChannelNoise>& noise, Eigen::Index trajectories);

  void BeginRun();
  // Rows [first, first + count) of the block, in order: values and noise of their channels, and the
  // model's outputs at them (column (row − first)·m + channel). The noise is scaled as well.
  void Apply(int first, int count, RowBlock& block, MatrixRef outputs);

  std::vector<PreviousSample> State() const;
  // Of as many channels and trajectories.
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
