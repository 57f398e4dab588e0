#include "client/cli/remedy_trial.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "client/cli/arguments.h"
#include "client/cli/state_spread.h"
#include "core/common/status.h"
#include "core/estimator/posterior/residual_tests.h"
#include "proto/wire/convert/noise.h"
#include "proto/wire/convert/problem.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

constexpr size_t kMaxTried = 8;
constexpr size_t kFinalists = 2;

// Returns whether the computing program does not accept the problem, whatever the time.
bool IsRefusal(const absl::Status& status) {
  if (absl::IsResourceExhausted(status)) {
    const auto refusal = RefusalOf(status);
    return !refusal || !refusal->retry_delay;
  }
  return absl::IsInvalidArgument(status) || absl::IsFailedPrecondition(status);
}

OutlierHandling OutliersOf(const v1::Problem& problem, const std::string& output) {
  const auto& measured = problem.measured();
  const auto found = std::ranges::find(measured, output, &v1::MeasuredOutput::output);
  if (found == measured.end()) return OutlierHandling::kNone;
  return ToOutlierHandling(found->noise()).value_or(OutlierHandling::kNone);
}

class Trial {
 public:
  Trial(const v1::Experiment& experiment, Backend& backend)
      : experiment_(experiment), backend_(backend) {}

  absl::StatusOr<RemedyTrial> Run(const v1::Estimate& estimate) {
    backend_.SetTask("weighing the problem as it is");
    auto untreated = Weigh(experiment_, backend_);
    if (IsRefusal(untreated.status())) {
      result_.refusal = untreated.status();
      return std::move(result_);
    }
    POLYEST_RETURN_IF_ERROR(untreated.status());
    result_.untreated = *std::move(untreated);
    if (!result_.untreated.log_evidence) return std::move(result_);
    // Without the spreads of the states no process noise is tried.
    auto states = SpreadsOfStates(experiment_, backend_);
    if (IsRefusal(states.status())) states.emplace();
    POLYEST_RETURN_IF_ERROR(states.status());
    const absl::Status status = TryAll(estimate, *states);
    Sort();
    if (!status.ok() && result_.tried.empty()) return status;
    result_.ended = status;
    return std::move(result_);
  }

 private:
  absl::Status TryAll(const v1::Estimate& estimate, const std::vector<StateSpread>& states) {
    const auto& times = experiment_.measurements().time_s();
    const double duration_s = times.empty() ? 0 : *std::ranges::max_element(times);
    for (const Remedy& remedy : ListRemedies(experiment_.problem(), estimate, states, duration_s)) {
      if (result_.tried.size() == kMaxTried) {
        result_.left_out.push_back(remedy);
      } else {
        POLYEST_RETURN_IF_ERROR(TrySizes(remedy));
      }
    }
    Sort();
    POLYEST_RETURN_IF_ERROR(EstimateSizes());
    return ScoreFinalists();
  }

  void Sort() { std::ranges::stable_sort(result_.tried, std::greater(), &TriedRemedy::gain); }

  bool IsFinalist(size_t i) const {
    return i < std::min(kFinalists, result_.tried.size()) &&
           result_.tried[i].gain > kDecisiveEvidence;
  }

  v1::Experiment With(const v1::Problem& problem) const {
    v1::Experiment changed = experiment_;
    *changed.mutable_problem() = problem;
    return changed;
  }

  // Weighs the problem with a remedy. Returns whether it is not refused, has an evidence to compare
  // and gains more than `tried` has, which it then replaces.
  absl::StatusOr<bool> Improve(const v1::Problem& problem, const Remedy& remedy,
                               std::optional<TriedRemedy>& tried) {
    auto weighed = Weigh(With(problem), backend_);
    if (IsRefusal(weighed.status())) {
      if (!tried) result_.refused.push_back({remedy, weighed.status()});
      return false;
    }
    POLYEST_RETURN_IF_ERROR(weighed.status());
    if (weighed->values != result_.untreated.values ||
        !HaveComparableEvidence(*weighed, result_.untreated)) {
      return false;
    }
    const double gain = *weighed->log_evidence - *result_.untreated.log_evidence;
    if (tried && gain <= tried->gain) return false;
    if (!tried) tried.emplace();
    tried->problem = problem;
    tried->assessment = *std::move(weighed);
    tried->gain = gain;
    return true;
  }

  absl::Status TrySizes(const Remedy& remedy) {
    backend_.SetTask(RemedyText(remedy));
    std::optional<TriedRemedy> tried;
    const std::vector<double> sizes = HasSize(remedy) ? remedy.sizes : std::vector<double>{0};
    for (size_t i = 0; i < sizes.size(); ++i) {
      const double size = sizes[i];
      const v1::Problem problem = WithKnownSize(experiment_.problem(), remedy, size);
      POLYEST_ASSIGN_OR_RETURN(const bool better, Improve(problem, remedy, tried));
      if (!tried) break;
      if (!better) continue;
      tried->remedy = remedy;
      tried->remedy.sizes = HasSize(remedy) ? std::vector<double>{size} : remedy.sizes;
      if (i == 1) break;  // larger is better than the middle, so that less would be worse
    }
    if (tried) result_.tried.push_back(*std::move(tried));
    return absl::OkStatus();
  }

  // Lets the sizes of the finalists be estimated, whatever that costs in evidence.
  absl::Status EstimateSizes() {
    for (size_t i = 0; IsFinalist(i); ++i) {
      TriedRemedy& finalist = result_.tried[i];
      if (!HasSize(finalist.remedy)) continue;
      backend_.SetTask(absl::StrFormat("size of %s", RemedyText(finalist.remedy)));
      std::optional<TriedRemedy> estimated = finalist;
      estimated->gain = -std::numeric_limits<double>::infinity();
      const v1::Problem problem =
          WithUnknownSize(experiment_.problem(), finalist.remedy, finalist.remedy.sizes.front());
      POLYEST_ASSIGN_OR_RETURN(const bool accepted, Improve(problem, finalist.remedy, estimated));
      if (accepted) finalist = *std::move(estimated);
    }
    Sort();
    return absl::OkStatus();
  }

  absl::Status ScoreFinalists() {
    for (size_t i = 0; IsFinalist(i); ++i) {
      TriedRemedy& finalist = result_.tried[i];
      if (i == 0) {
        backend_.SetTask("held-out rows, the problem as it is");
        const absl::Status scored = Score(experiment_, HoldOut(), backend_, result_.untreated);
        if (!scored.ok()) return IsRefusal(scored) ? absl::OkStatus() : scored;
      }
      backend_.SetTask(absl::StrFormat("held-out rows, %s", RemedyText(finalist.remedy)));
      const absl::Status scored =
          Score(With(finalist.problem), HoldOut(), backend_, finalist.assessment);
      if (!scored.ok() && !IsRefusal(scored)) return scored;
      finalist.scored = scored.ok() && finalist.assessment.held_out == result_.untreated.held_out;
    }
    return absl::OkStatus();
  }

  const v1::Experiment& experiment_;
  Backend& backend_;
  RemedyTrial result_;
};

}  // namespace

std::vector<v1::Diagnostic::Code> Contradictions(
    const google::protobuf::RepeatedPtrField<v1::Diagnostic>& diagnostics) {
  std::vector<v1::Diagnostic::Code> codes;
  for (const v1::Diagnostic& diagnostic : diagnostics) {
    switch (diagnostic.code()) {
      case v1::Diagnostic::MODEL_MISFIT:
      case v1::Diagnostic::CORRELATED_RESIDUALS:
      case v1::Diagnostic::WINDOWS_DISAGREE:
      case v1::Diagnostic::INCONSISTENT_OVER_TIME:
        if (std::ranges::count(codes, diagnostic.code()) == 0) codes.push_back(diagnostic.code());
        break;
      default:
        break;
    }
  }
  return codes;
}

bool CallsForRemedies(const v1::Problem& problem, const v1::Estimate& estimate) {
  if (Contradictions(estimate.diagnostics()).empty()) return false;
  const bool filtered = UsesFilters(problem);
  return std::ranges::any_of(estimate.channels(), [&](const v1::ChannelEstimate& channel) {
    const double ratio = TooSmallRatio(OutliersOf(problem, channel.output()), filtered);
    return ratio * channel.chi_squared() >= static_cast<double>(channel.samples());
  });
}

absl::StatusOr<RemedyTrial> TryRemedies(const v1::Experiment& experiment,
                                        const v1::Estimate& estimate, Backend& backend) {
  return Trial(experiment, backend).Run(estimate);
}

}  // namespace polyest::internal
