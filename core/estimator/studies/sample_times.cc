#include "core/estimator/studies/sample_times.h"

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/estimator/studies/information_gain.h"

namespace polyest::internal {
namespace {

constexpr double kMinAddedGain = 1e-9;  // in nats: a smaller gain is rounding

// Makes the greedy choice, one time after the other.
class SampleTimeChoice {
 public:
  SampleTimeChoice(const std::vector<Matrix>& slopes, int m)
      : slopes_(slopes),
        m_(m),
        times_(static_cast<int>(slopes.front().rows()) / m),
        covariances_(slopes.size(), Matrix::Identity(slopes.front().cols(), slopes.front().cols())),
        taken_(static_cast<size_t>(times_), false) {}

  // Returns the best time not yet taken, or −1 when none adds information.
  int Best() const {
    int best = -1;
    double most = kMinAddedGain;
    for (int k = 0; k < times_; ++k) {
      if (taken_[static_cast<size_t>(k)]) continue;
      const double added = AddedGain(k);
      if (added > most) {
        most = added;
        best = k;
      }
    }
    return best;
  }

  // Takes time k: P ← P − P a aᵀ P/(1 + aᵀ P a) for each of its samples a, where P = M⁻¹.
  void Take(int k) {
    taken_[static_cast<size_t>(k)] = true;
    for (size_t d = 0; d < slopes_.size(); ++d) {
      for (int i = 0; i < m_; ++i) {
        const Vector a = slopes_[d].row(k * m_ + i).transpose();
        const Vector pa = covariances_[d] * a;
        covariances_[d] -= pa * pa.transpose() / (1 + a.dot(pa));
      }
    }
  }

 private:
  // Returns the mean over the draws of ½ log det(Id + A P Aᵀ) in nats, where A are the samples'
  // slopes (m × n).
  double AddedGain(int k) const {
    double sum = 0;
    for (size_t d = 0; d < slopes_.size(); ++d) {
      const auto a = slopes_[d].middleRows(k * m_, m_);
      sum += FactorPrecision(a * covariances_[d] * a.transpose()).HalfLogDeterminant();
    }
    return sum / static_cast<double>(slopes_.size());
  }

  const std::vector<Matrix>& slopes_;
  int m_;
  int times_;
  std::vector<Matrix> covariances_;  // P of each draw
  std::vector<bool> taken_;
};

}  // namespace

absl::StatusOr<std::vector<int>> ChooseSampleTimes(const std::vector<Matrix>& slopes, int m,
                                                   int most, const Stop& stop) {
  POLYEST_CHECK(!slopes.empty() && m >= 1 && slopes.front().rows() % m == 0);
  SampleTimeChoice choice(slopes, m);
  std::vector<int> chosen;
  while (static_cast<int>(chosen.size()) < most) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    const int best = choice.Best();
    if (best < 0) break;
    choice.Take(best);
    chosen.push_back(best);
  }
  return chosen;
}

}  // namespace polyest::internal
