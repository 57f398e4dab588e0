#include "core/estimator/problem/ended_runs.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/bayes/noise.h"
#include "core/common/finite_matrix.h"

namespace polyest::internal {
namespace {

bool AreShapes(const std::vector<ScoreMixture>& shapes) {
  return std::ranges::all_of(shapes, [](const ScoreMixture& shape) {
    const Eigen::Index count = shape.log_weights.size();
    return count == 0 || (count <= ScoreMixture::kMaxComponents && shape.log_weights.allFinite() &&
                          std::isfinite(shape.first) && shape.step > 0 && shape.step < 1);
  });
}

template <class Number>
bool AreAscending(const std::vector<Number>& numbers) {
  return std::ranges::adjacent_find(numbers, std::ranges::greater_equal()) == numbers.end();
}

}  // namespace

// A column is centre, slope and spread one after the other: n_φ (1 + n_θ + n_φ) numbers.
int EndedRuns::own_parameters() const {
  const int shared = region.dimension();
  int own = 1;
  while (own * (1 + shared + own) < paths.rows()) ++own;
  return own;
}

RunPath EndedRuns::Path(size_t i) const {
  const Eigen::Index own = own_parameters(), shared = region.dimension();
  const Vector column = paths.col(static_cast<Eigen::Index>(i));
  RunPath path;
  path.centre = column.head(own);
  path.slope = column.segment(own, own * shared).reshaped(own, shared);
  path.spread = column.tail(own * own).reshaped(own, own);
  return path;
}

void EndedRuns::SetPath(size_t i, const RunPath& path) {
  auto column = paths.col(static_cast<Eigen::Index>(i));
  column << path.centre, path.slope.reshaped(), path.spread.reshaped();
}

void EndedRuns::Append(int run_index, int64_t first, int64_t end, const RunPath& path) {
  run.push_back(run_index);
  first_row.push_back(first);
  rows = end;
  const Eigen::Index numbers = path.centre.size() + path.slope.size() + path.spread.size();
  paths.conservativeResize(numbers, std::ssize(run));
  SetPath(run.size() - 1, path);
}

std::vector<ChannelSums> SumsWithRemainder(const std::vector<MeasuredOutput>& measured,
                                           const EndedRuns& ended) {
  std::vector<ChannelSums> sums = ended.sums;
  for (size_t c = 0; c < sums.size(); ++c) {
    sums[c].scale_unknown = measured[c].noise.unknown;
    sums[c].degrees_factor = BoundedDegreesFactor(measured[c].noise.outliers);
  }
  ChannelSums& remainder = sums.emplace_back(ended.basis->size());
  remainder.log_variance = ended.remainder;
  // A group of its own.
  remainder.scale_unknown = true;
  return sums;
}

Vector TermsAtCentre(const EndedRuns& ended) {
  Vector terms(ended.basis->size());
  ended.basis->Evaluate(Vector::Zero(ended.basis->dimension()), terms);
  return terms;
}

bool IsWellFormed(const EndedRuns& ended, int shared, int own, int channels) {
  const auto runs = std::ssize(ended.run);
  const int terms = ended.basis->size();
  if (ended.rows < 1 || ended.sample_count < 0 || runs < 1 || std::ssize(ended.first_row) != runs ||
      !AreAscending(ended.run) || ended.run.front() < 0 || !AreAscending(ended.first_row) ||
      ended.first_row.front() != 0 || ended.first_row.back() >= ended.rows) {
    return false;
  }
  for (const ChannelSums& sums : ended.sums) {
    if (!sums.samples.IsValid(terms) || !sums.differences.IsValid(terms)) return false;
    if (!std::isfinite(sums.spent) || !std::isfinite(sums.surplus)) return false;
  }
  return ended.region.dimension() == shared && ended.basis->dimension() == shared &&
         IsFiniteMatrix(ended.paths, own * (1 + shared + own), runs) &&
         IsFiniteMatrix(ended.centre, shared) && IsFiniteMatrix(ended.factor, shared, shared) &&
         std::ssize(ended.sums) == channels && std::ssize(ended.outliers) == channels &&
         IsFiniteMatrix(ended.discount, channels) && IsFiniteMatrix(ended.largest, channels) &&
         IsFiniteMatrix(ended.remainder, terms) &&
         IsFiniteMatrix(ended.noise_time_constant_s, channels) &&
         IsFiniteMatrix(ended.noise_white_share, channels) &&
         IsFiniteMatrix(ended.left_out, shared) && AreShapes(ended.shapes) &&
         (ended.shapes.empty() || std::ssize(ended.shapes) == runs) &&
         std::isfinite(ended.unresolved) && IsFiniteMatrix(ended.noise_scale, channels) &&
         ended.noise_scale.minCoeff() > 0 && std::isfinite(ended.own_error) &&
         std::isfinite(ended.log_noise) && std::isfinite(ended.log_variance);
}

}  // namespace polyest::internal
