#include "core/estimator/expansion/prior_prediction.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/estimator/record/memory_store.h"
#include "core/estimator/record/row_block.h"
#include "core/estimator/record/sample_checks.h"

namespace polyest::internal {
namespace {

constexpr int64_t kRows = 16;
constexpr std::chrono::seconds kMaxDuration{1};

// Returns the first rows, as far as the beginning, which is what the store has, settles the
// streamed inputs.
RowBlock FirstRows(const ResolvedProblem& problem, const RowBlock& beginning,
                   const SampleStore& store) {
  const RecordPosition after = After(SampleChecks(problem).position(), beginning);
  const auto settled = SettledRows(problem, after.knots, 0, beginning.count(), store);
  RowBlock block;
  if (settled.ok()) AppendRows(beginning, 0, std::min(kRows, *settled), block);
  return block;
}

}  // namespace

void AddPredictionsOf(const RegionalExpansion& expansion, int row, RecordSummary& record) {
  for (size_t c = 0; c < expansion.sums().size(); ++c) {
    const auto prediction = expansion.PredictionOf(row, static_cast<int>(c));
    if (prediction) record.AddPrediction(static_cast<int>(c), *prediction);
  }
}

void AddPredictionsOfPrior(const ResolvedProblem& problem, RecordSummary& record) {
  if (record.facts().intervals().StartsLate()) return;
  MemoryStore store;
  if (!store.Append(record.beginning()).ok()) return;
  const RowBlock block = FirstRows(problem, record.beginning(), store);
  if (block.count() == 0) return;
  auto design = DesignForPrior(problem);
  if (!design.ok()) return;
  const Stop stop(std::stop_token(), Stop::Clock::now() + kMaxDuration);
  auto expansion = RegionalExpansion::Make(problem, &store, *std::move(design),
                                           NoiseToBeginWith(problem.problem()), 1, stop);
  if (!expansion.ok()) return;
  if (!(*expansion)->Propagate(block, stop).ok()) return;
  for (int row = 0; row < (*expansion)->fitted_rows(); ++row) {
    AddPredictionsOf(**expansion, row, record);
  }
}

}  // namespace polyest::internal
