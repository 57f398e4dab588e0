#include "core/propagation/delayed_outputs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr size_t kStencil = 6;
constexpr size_t kCoarse = 4;               // nodes of p̃
constexpr double kErrorFactor = 3;          // of D √(D/Y), at the end of the record
constexpr double kFirstSpacing = 1.0 / 32;  // the first spacing, of an interval between times
constexpr double kLeast = 1.0 / 1024;       // the least one
constexpr double kMaxGrowth = 1.2;  // per node, so that neighbours are about equally far apart
constexpr double kMaxShrinkage = 0.5;
constexpr double kSafety = 0.8;
constexpr double kTooClose = 0.25;  // spacings: a node so near the end of the record is left out

}  // namespace

DelayedOutputs::DelayedOutputs(std::unique_ptr<TrajectoryEnsemble> ensemble, Matrix delays_s,
                               double relative_tolerance, double ahead_s)
    : ensemble_(std::move(ensemble)),
      delays_s_(std::move(delays_s)),
      max_difference_(kMaxDifference * relative_tolerance),
      ahead_s_(ahead_s) {
  double least_s = std::numeric_limits<double>::infinity();
  double largest_s = -least_s;
  for (const double delay_s : delays_s_.reshaped()) {
    if (!std::isfinite(delay_s)) continue;
    least_s = std::min(least_s, delay_s);
    largest_s = std::max(largest_s, delay_s);
  }
  if (least_s <= largest_s) {
    least_delay_s_ = least_s;
    largest_delay_s_ = largest_s;
  }
  POLYEST_CHECK(least_delay_s_ >= -ahead_s_);
}

absl::Status DelayedOutputs::Advance(std::span<const double> times_s, MatrixRef outputs,
                                     const Stop& stop) {
  const Eigen::Index m = delays_s_.cols();
  POLYEST_CHECK(outputs.rows() == points() && outputs.cols() == m * std::ssize(times_s));
  errors_.resize(outputs.cols());
  for (size_t k = 0; k < times_s.size(); ++k) {
    const double time_s = times_s[k];
    NoteInterval(time_s);
    const double latest_s = std::max(0.0, time_s - least_delay_s_);
    const double limit_s = time_s + ahead_s_;
    POLYEST_RETURN_IF_ERROR(AddNodes(latest_s, limit_s, stop));
    if (nodes_.back().time_s < latest_s) POLYEST_RETURN_IF_ERROR(AddEnd(limit_s, stop));
    Read(time_s, static_cast<Eigen::Index>(k) * m, outputs);
    DropNodesBefore(time_s - largest_delay_s_);
  }
  return absl::OkStatus();
}

void DelayedOutputs::NoteInterval(double time_s) {
  if (time_s > time_s_) {
    intervals_s_[next_interval_++ % intervals_s_.size()] = time_s - time_s_;
  }
  time_s_ = time_s;
}

// Adds nodes until three of them lie at or after `latest_s`, but none after `limit_s`.
absl::Status DelayedOutputs::AddNodes(double latest_s, double limit_s, const Stop& stop) {
  if (std::exchange(has_end_, false)) {
    unused_.push_back(std::move(nodes_.back()));
    nodes_.pop_back();
  }
  if (std::exchange(has_replaced_, false)) nodes_.push_back(std::move(replaced_));
  if (nodes_.empty()) POLYEST_RETURN_IF_ERROR(AddNode(0, stop));
  double interval_s = *std::ranges::max_element(intervals_s_);
  if (interval_s == 0) interval_s = kFirstSpacing * std::max(largest_delay_s_, -least_delay_s_);
  if (spacing_s_ == 0) spacing_s_ = kFirstSpacing * interval_s;
  if (latest_s == 0) return absl::OkStatus();
  while (nodes_.size() < kStencil / 2 || nodes_[nodes_.size() - kStencil / 2].time_s < latest_s) {
    spacing_s_ = std::clamp(spacing_s_, kLeast * interval_s, interval_s);
    // The ensemble may have been advanced to the end of the record so far.
    const double next_s = std::max(nodes_.back().time_s + spacing_s_, reached_s_);
    if (next_s > limit_s || !(next_s > nodes_.back().time_s)) break;
    POLYEST_RETURN_IF_ERROR(AddNode(next_s, stop));
    AdaptSpacing();
  }
  return absl::OkStatus();
}

absl::Status DelayedOutputs::AddNode(double time_s, const Stop& stop) {
  Node node;
  if (!unused_.empty()) {
    node = std::move(unused_.back());
    unused_.pop_back();
  }
  node.time_s = time_s;
  node.outputs.resize(points(), delays_s_.cols());
  POLYEST_RETURN_IF_ERROR(ensemble_->Advance({&time_s, 1}, node.outputs, stop));
  reached_s_ = time_s;
  nodes_.push_back(std::move(node));
  return absl::OkStatus();
}

// Adds a node at the time after which nothing is known yet. It stands in for the last one
// if that is too close for a well-conditioned stencil.
absl::Status DelayedOutputs::AddEnd(double time_s, const Stop& stop) {
  if (nodes_.size() > 1 && time_s - nodes_.back().time_s < kTooClose * spacing_s_) {
    replaced_ = std::move(nodes_.back());
    nodes_.pop_back();
    has_replaced_ = true;
  }
  POLYEST_RETURN_IF_ERROR(AddNode(time_s, stop));
  has_end_ = true;
  return absl::OkStatus();
}

// Chooses the next spacing h ∝ D^(−1/4) from D in the middle of the last stencil.
void DelayedOutputs::AdaptSpacing() {
  if (nodes_.size() < kStencil) return;
  const size_t first = nodes_.size() - kStencil;
  const double middle_s = std::midpoint(nodes_[first + 2].time_s, nodes_[first + 3].time_s);
  const Weights fine = LagrangeWeights(first, kStencil, middle_s);
  const Weights coarse = LagrangeWeights(first + 1, kCoarse, middle_s);
  difference_.setZero(points(), delays_s_.cols());
  for (size_t j = 0; j < kStencil; ++j) {
    const bool inner = j >= 1 && j <= kCoarse;
    difference_ += (fine.value[j] - (inner ? coarse.value[j - 1] : 0)) * nodes_[first + j].outputs;
  }
  double worst = 0;
  for (Eigen::Index c = 0; c < difference_.cols(); ++c) {
    double largest = 0, difference = 0;
    for (Eigen::Index q = 0; q < difference_.rows(); ++q) {
      if (!std::isfinite(difference_(q, c))) continue;
      difference = std::max(difference, std::abs(difference_(q, c)));
      for (size_t j = 0; j < kStencil; ++j) {
        largest = std::max(largest, std::abs(nodes_[first + j].outputs(q, c)));
      }
    }
    if (largest > 0) worst = std::max(worst, difference / largest);
  }
  const double factor = worst > 0 ? kSafety * std::pow(max_difference_ / worst, 0.25) : kMaxGrowth;
  spacing_s_ *= std::clamp(factor, kMaxShrinkage, kMaxGrowth);
}

// Keeps a whole stencil before the first time that may still be asked for.
void DelayedOutputs::DropNodesBefore(double time_s) {
  while (nodes_.size() > 2 * kStencil && nodes_[kStencil].time_s < time_s) {
    unused_.push_back(std::move(nodes_.front()));
    nodes_.pop_front();
  }
}

// ℓ_j(t) = Π_{i ≠ j} (t − τ_i)/(τ_j − τ_i)
DelayedOutputs::Weights DelayedOutputs::LagrangeWeights(size_t first, size_t count,
                                                        double time_s) const {
  Weights weights{.first = first, .count = count};
  for (size_t j = 0; j < count; ++j) {
    double weight = 1;
    for (size_t i = 0; i < count; ++i) {
      if (i == j) continue;
      const double node_s = nodes_[first + i].time_s;
      weight *= (time_s - node_s) / (nodes_[first + j].time_s - node_s);
    }
    weights.value[j] = weight;
  }
  return weights;
}

void DelayedOutputs::Read(double time_s, Eigen::Index column, MatrixRef outputs) {
  for (Eigen::Index c = 0; c < delays_s_.cols(); ++c) {
    double largest_error = 0;
    for (Eigen::Index q = 0; q < delays_s_.rows(); ++q) {
      double value = std::numeric_limits<double>::quiet_NaN(), error = 0;
      const double delay_s = delays_s_(q, c);
      if (std::isfinite(delay_s)) {
        ReadPoint(q, c, std::max(0.0, time_s - delay_s), value, error);
      }
      outputs(q, column + c) = value;
      if (std::isfinite(value)) largest_error = std::max(largest_error, error);
    }
    errors_[column + c] = largest_error;
  }
}

double DelayedOutputs::Interpolate(const Weights& weights, Eigen::Index point,
                                   Eigen::Index output) const {
  double sum = 0;
  for (size_t j = 0; j < weights.count; ++j) {
    sum += weights.value[j] * nodes_[weights.first + j].outputs(point, output);
  }
  return sum;
}

void DelayedOutputs::ReadPoint(Eigen::Index point, Eigen::Index output, double at_s, double& value,
                               double& error) const {
  const auto after = std::ranges::lower_bound(nodes_, at_s, {}, &Node::time_s);
  POLYEST_CHECK(after != nodes_.end());
  const auto i = static_cast<size_t>(after - nodes_.begin());
  if (after->time_s == at_s) {
    value = after->outputs(point, output);
    error = 0;
    return;
  }
  const size_t count = std::min(kStencil, nodes_.size());
  const size_t first = std::min(i - std::min(i, count / 2), nodes_.size() - count);
  double largest = 0;
  for (size_t j = first; j < first + count; ++j) {
    largest = std::max(largest, std::abs(nodes_[j].outputs(point, output)));
  }
  value = Interpolate(LagrangeWeights(first, count, at_s), point, output);
  // All polynomials p̃ whose nodes are on both sides do not happen to agree with p where a
  // derivative of the output is 0.
  const size_t fewer = count == kStencil ? kCoarse : std::min<size_t>(2, count);
  double difference = 0;
  for (size_t begin = first; begin + fewer <= first + count; ++begin) {
    if (nodes_[begin].time_s > at_s || nodes_[begin + fewer - 1].time_s < at_s) continue;
    const double coarse = Interpolate(LagrangeWeights(begin, fewer, at_s), point, output);
    difference = std::max(difference, std::abs(value - coarse));
  }
  // 3 D √(D/Y)
  error = largest > 0 ? kErrorFactor * difference * std::sqrt(difference / largest) : 0;
}

}  // namespace polyest::internal
