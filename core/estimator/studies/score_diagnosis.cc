#include "core/estimator/studies/score_diagnosis.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <utility>

namespace polyest::internal {
namespace {

// In a linear model χ² falls by s². The model's own χ² must fall by at least this part of it.
constexpr double kMinGain = 0.5;
constexpr double kMinShift = 1;         // of an estimate, in standard deviations, to be named
constexpr double kNearlyAsLarge = 0.9;  // times the largest score
constexpr size_t kMaxOthers = 3;

bool Has(const Estimate& estimate, std::initializer_list<DiagnosticCode> codes) {
  return std::ranges::any_of(estimate.diagnostics, [codes](const Diagnostic& diagnostic) {
    return std::ranges::count(codes, diagnostic.code) > 0;
  });
}

// Returns "; another value of x.offset or m would explain it nearly as well", or an empty text.
std::string Others(const std::vector<ScoreTest>& scores) {
  std::vector<std::string> names;
  for (size_t i = 1; i < scores.size() && names.size() < kMaxOthers; ++i) {
    if (std::abs(scores[i].score) < kNearlyAsLarge * std::abs(scores[0].score)) break;
    names.push_back(scores[i].name);
  }
  if (names.empty()) return "";
  return absl::StrCat("; another value of ", absl::StrJoin(names, " or "),
                      " would explain it nearly as well");
}

// Returns " and k would be 3.2 standard deviations higher", or an empty text.
std::string Shift(const ScoreTest& test, const Estimate& estimate) {
  Eigen::Index moved;
  if (test.shifts.cwiseAbs().maxCoeff(&moved) < kMinShift) return "";
  const double shift = test.shifts[moved];
  return absl::StrFormat(" and %s would be %.1f standard deviations %s",
                         estimate.parameters[static_cast<size_t>(moved)].name, std::abs(shift),
                         shift > 0 ? "higher" : "lower");
}

}  // namespace

bool IsWorthTesting(const Estimate& estimate) {
  using enum DiagnosticCode;
  return !Has(estimate, {kExpansionInaccurate, kMultipleMinima, kNotConverged, kReplayPostponed,
                         kAtPriorBound});
}

void AddScoreTests(const FixedValueTests& tests, Estimate& estimate) {
  using enum DiagnosticCode;
  if (!tests.correction) return;
  const ScoreTest& largest = tests.scores.front();
  const double gain = tests.correction->chi_squared_before - tests.correction->chi_squared;
  if (gain < kMinGain * largest.score * largest.score) return;
  const bool residuals_contradict =
      Has(estimate, {kModelMisfit, kCorrelatedResiduals, kWindowsDisagree, kInconsistentOverTime});
  const double widened = std::sqrt(tests.correction->dispersion);
  const double score = std::abs(largest.score) / widened;
  const std::string shift = Shift(largest, estimate);
  if (score < kMinScore || (shift.empty() && !residuals_contradict)) return;
  const bool is_number = largest.unit.empty() || largest.unit == "1";
  const std::string unit = is_number ? "" : absl::StrCat(" ", largest.unit);
  std::string message = absl::StrFormat(
      "the residuals ask for %s = %.4g ± %.2g%s instead of %.4g (%.1f standard deviations); χ² "
      "would fall from %.0f to %.0f%s; correct it or make it uncertain%s",
      largest.name, largest.value + largest.change, widened * largest.deviation, unit,
      largest.value, score, tests.correction->chi_squared_before, tests.correction->chi_squared,
      shift, Others(tests.scores));
  estimate.diagnostics.insert(estimate.diagnostics.begin(),
                              {kFixedValueConflict, std::move(message)});
  for (size_t i = 0; i < estimate.parameters.size(); ++i) {
    Verdict& verdict = estimate.parameters[i].verdict;
    const bool moves = std::abs(largest.shifts[static_cast<Eigen::Index>(i)]) >= kMinShift;
    if (moves && verdict == Verdict::kIdentified) verdict = Verdict::kWeak;
  }
}

}  // namespace polyest::internal
