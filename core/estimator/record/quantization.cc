#include "core/estimator/record/quantization.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace polyest::internal {
namespace {

constexpr int64_t kMinSamples = 20;
constexpr double kMinNoise = 1.0 / 3;  // of a step, which makes rounding errors independent
constexpr double kMaxChanges = 0.85;   // share of samples that differ from the one before
// Noise that is learned from N samples is known to 1/√(2N) of it; it must be so many of them too
// small.
constexpr double kDeviations = 2;
// Fewer than four different values show steps if each has been seen so often on average, and the
// residuals are so large a part of their distance.
constexpr int64_t kRepeated = 16;
constexpr double kMinResidual = 0.05;

double StepOf(const ColumnFacts& column, std::optional<double> residual) {
  const double step = column.Resolution();
  if (step > 0 || !residual) return step;
  if (column.samples < kRepeated * std::ssize(column.distinct)) return 0;
  const double of_few = column.Resolution(/*least=*/2);
  return *residual > kMinResidual * of_few ? of_few : 0;
}

}  // namespace

std::optional<CoarseSteps> FindCoarseSteps(const ColumnFacts& column, const RoundedNoise& noise) {
  if (column.samples < kMinSamples) return std::nullopt;
  const double step = StepOf(column, noise.residual);
  const double changes = column.faults.ShareOfChanges();
  const double samples = static_cast<double>(column.samples);
  const double error = noise.learned ? kDeviations / std::sqrt(2 * samples) : 0;
  const double rounding = step * step / 12;
  const double enough = std::sqrt(kMinNoise * kMinNoise * step * step + rounding);
  if (!(noise.std_dev < (1 - error) * enough && changes < kMaxChanges)) return std::nullopt;
  const double by_changes = 0.5 * std::sqrt(std::numbers::pi) * changes * step;
  const double variance = noise.std_dev * noise.std_dev - rounding;
  return CoarseSteps{step, variance > 0 ? std::min(std::sqrt(variance), by_changes) : by_changes};
}

}  // namespace polyest::internal
