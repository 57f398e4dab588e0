#include "tests/testing/records.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "core/common/check.h"
#include "core/estimator/estimator_access.h"

namespace polyest::internal::testing {
namespace {

template <class T>
std::vector<T> Slice(const std::vector<T>& all, size_t first, size_t end) {
  if (all.empty()) return {};
  return {all.begin() + static_cast<std::ptrdiff_t>(first),
          all.begin() + static_cast<std::ptrdiff_t>(end)};
}

}  // namespace

std::optional<Samples> SharedRecord(const std::string& file,
                                    const std::vector<std::string>& columns) {
  std::ifstream in(std::string(POLYEST_SOURCE_DIR) + "/../shared/data/" + file);
  if (!in) return std::nullopt;
  Samples record;
  for (const std::string& column : columns) record.columns.push_back({column, {}, {}});
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::string cell;
    std::getline(cells, cell, ',');
    record.time_s.push_back(std::stod(cell));
    for (SampleColumn& column : record.columns) {
      std::getline(cells, cell, ',');
      column.value.push_back(std::stod(cell));
    }
  }
  return record;
}

Samples Rows(const Samples& record, size_t first, size_t count) {
  const size_t end = std::min(record.rows(), first + count);
  Samples part;
  part.time_s = Slice(record.time_s, first, end);
  part.run = Slice(record.run, first, end);
  part.end_of_run = record.end_of_run && end == record.rows();
  for (const SampleColumn& column : record.columns) {
    part.columns.push_back(
        {column.name, Slice(column.value, first, end), Slice(column.missing, first, end)});
  }
  return part;
}

Estimate EstimateInBatches(const Problem& problem, const Samples& record, size_t batch_rows,
                           int threads) {
  auto resolved = ResolvedProblem::Make(problem);
  POLYEST_CHECK(resolved.ok());
  EstimatorOptions options;
  options.threads = threads;
  auto estimator = EstimatorAccess::Make(*std::move(resolved), options);
  POLYEST_CHECK(estimator.ok());
  for (size_t first = 0; first < record.rows(); first += batch_rows) {
    POLYEST_CHECK((*estimator)->Append(Rows(record, first, batch_rows)).ok());
    POLYEST_CHECK((*estimator)->Process().ok());
  }
  auto estimate = (*estimator)->CurrentEstimate();
  POLYEST_CHECK(estimate.ok());
  return *std::move(estimate);
}

}  // namespace polyest::internal::testing
