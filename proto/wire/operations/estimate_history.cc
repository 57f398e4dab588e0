#include "proto/wire/operations/estimate_history.h"

#include <utility>

#include "core/common/status.h"
#include "core/estimator/estimator_access.h"
#include "core/estimator/record/sample_checks.h"
#include "proto/wire/convert/estimate.h"
#include "proto/wire/convert/wire_fields.h"

namespace polyest::internal {
namespace {

// Returns rows [first, last) of the samples.
Samples RowsOf(const Samples& samples, size_t first, size_t last) {
  const auto part = [&](const auto& values) {
    using Values = std::decay_t<decltype(values)>;
    if (values.empty()) return Values();
    return Values(values.begin() + static_cast<std::ptrdiff_t>(first),
                  values.begin() + static_cast<std::ptrdiff_t>(last));
  };
  Samples rows;
  rows.time_s = part(samples.time_s);
  rows.run = part(samples.run);
  for (const SampleColumn& column : samples.columns) {
    rows.columns.push_back({column.name, part(column.value), part(column.missing)});
  }
  rows.end_of_run = samples.end_of_run && last == samples.rows();
  return rows;
}

}  // namespace

absl::Status ProcessWithHistory(Samples samples, int points, Estimator& estimator,
                                v1::EstimateHistory& history, const Stop& stop) {
  if (points == 0) {
    POLYEST_RETURN_IF_ERROR(WireFields(estimator.Append(std::move(samples))));
    return estimator.Process(stop);
  }
  // All rows are checked before any is processed.
  const SampleChecks checks(EstimatorAccess::ProblemOf(estimator));
  POLYEST_RETURN_IF_ERROR(WireFields(checks.Check(samples).status()));
  const auto rows = static_cast<double>(samples.rows());
  size_t first = 0;
  for (int i = 1; i <= points; ++i) {
    const double part = static_cast<double>(i) / points;
    const size_t last = i == points ? samples.rows() : static_cast<size_t>(rows * part * part);
    if (last == first && i < points) continue;
    POLYEST_RETURN_IF_ERROR(WireFields(estimator.Append(RowsOf(samples, first, last))));
    POLYEST_RETURN_IF_ERROR(estimator.Process(stop));
    first = last;
    if (estimator.rows_processed() == 0) continue;
    POLYEST_ASSIGN_OR_RETURN(const Estimate estimate, estimator.CurrentEstimate(stop));
    *history.add_points() = ToHistoryPoint(ToProto(estimate));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
