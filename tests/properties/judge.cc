#include "tests/properties/judge.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal::properties {
namespace {

constexpr double kNear = 0.25;     // a mean's distance, in exact standard deviations
constexpr double kRatio = 1.25;    // of standard deviations, in either direction
constexpr double kMissed = 1;      // an interval's distance from the exact mean
constexpr double kTooSure = 0.25;  // ratio of standard deviations

// These say that the computation failed. Others are about the data, and leave the numbers to be
// believed.
bool AdmitsFailure(DiagnosticCode code) {
  return code == DiagnosticCode::kExpansionInaccurate || code == DiagnosticCode::kNotConverged ||
         code == DiagnosticCode::kPointsFailed;
}

}  // namespace

const char* NameOf(Judgement judgement) {
  switch (judgement) {
    case Judgement::kRight:
      return "RIGHT";
    case Judgement::kHonest:
      return "HONEST";
    case Judgement::kSilent:
      return "SILENT";
    case Judgement::kCrash:
      return "CRASH";
    case Judgement::kSkipped:
      return "skipped";
  }
  return "";
}

std::string CodesOf(const Estimate& estimate) {
  std::string codes;
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    const std::string name = NameOf(diagnostic.code);
    if (codes.find(name) != std::string::npos) continue;
    absl::StrAppend(&codes, codes.empty() ? "" : ",", name);
  }
  return codes.empty() ? "no diagnostic" : codes;
}

Verdict Judge(const Estimate& estimate, const Moments& exact) {
  double off = 0, least = std::numeric_limits<double>::infinity(), most = 0;
  std::string missed;
  for (size_t i = 0; i < estimate.parameters.size(); ++i) {
    const ParameterEstimate& one = estimate.parameters[i];
    const double mean = exact.mean[static_cast<Eigen::Index>(i)];
    const double sd = exact.std_dev[static_cast<Eigen::Index>(i)];
    const double ratio = one.posterior_std_dev / sd;
    const double distance = std::abs(one.mean - mean) / sd;
    // Comparisons with a number that is none are false, so that it counts as far off.
    off = distance <= off ? off : distance;
    least = std::min(least, std::isfinite(ratio) ? ratio : 0);
    most = std::max(most, ratio);
    const double gap = std::max({one.lower95 - mean, mean - one.upper95, 0.0}) / sd;
    if (!(gap <= kMissed) || !(ratio >= kTooSure)) absl::StrAppend(&missed, " ", one.name);
  }
  Verdict verdict;
  verdict.note =
      absl::StrFormat("off %.3g sd, sd ratio %.3g…%.3g; %s", off, least, most, CodesOf(estimate));
  const bool admitted = std::ranges::any_of(
      estimate.diagnostics, [](const Diagnostic& one) { return AdmitsFailure(one.code); });
  if (off < kNear && least > 1 / kRatio && most < kRatio) {
    verdict.judgement = Judgement::kRight;
  } else if (missed.empty()) {
    verdict.judgement = Judgement::kHonest;
  } else {
    verdict.judgement = admitted ? Judgement::kHonest : Judgement::kSilent;
    absl::StrAppend(&verdict.note, "; missed", missed);
  }
  return verdict;
}

}  // namespace polyest::internal::properties
