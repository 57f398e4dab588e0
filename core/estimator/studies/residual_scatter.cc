#include "core/estimator/studies/residual_scatter.h"

#include <algorithm>

namespace polyest::internal {

void ResidualScatter::Add(const Vector& residuals, bool begins_run) {
  if (begins_run) {
    for (Channel& channel : channels_) {
      channel.last = channel.sum = 0;
      channel.in_sum = 0;
    }
  }
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    const double u = residuals[i];
    if (u == 0) continue;
    Channel& channel = channels_[static_cast<size_t>(i) % channels_.size()];
    ++channel.samples;
    channel.squares += u * u;
    channel.products += u * channel.last;
    channel.last = u;
    channel.sum += u;
    if (++channel.in_sum < kOfBlock) continue;
    channel.squares_of_sums += channel.sum * channel.sum;
    ++channel.sums;
    channel.sum = 0;
    channel.in_sum = 0;
  }
}

double ResidualScatter::ChiSquared() const {
  double total = 0;
  for (const Channel& channel : channels_) total += channel.squares;
  return total;
}

double ResidualScatter::MeanSquare(Eigen::Index channel) const {
  const Channel& of = channels_[static_cast<size_t>(channel)];
  return of.samples == 0 ? 1 : of.squares / of.samples;
}

double ResidualScatter::Dispersion() const {
  constexpr double kMaxCorrelation = 0.999;
  double largest = 1;
  for (const Channel& channel : channels_) {
    if (channel.samples == 0) continue;
    const double r = std::clamp(channel.products / channel.squares, 0.0, kMaxCorrelation);
    const double of_pairs = channel.squares / channel.samples * (1 + r) / (1 - r);
    const double of_blocks =
        channel.sums == 0 ? 0 : channel.squares_of_sums / (kOfBlock * channel.sums);
    largest = std::max({largest, of_pairs, of_blocks});
  }
  return largest;
}

}  // namespace polyest::internal
