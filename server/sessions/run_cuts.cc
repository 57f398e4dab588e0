#include "server/sessions/run_cuts.h"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <vector>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Stands before the cuts. The state of an estimator never begins with it.
constexpr absl::string_view kMark = "polyest run cuts";

template <typename Value>
void Filter(const std::vector<bool>& kept, std::vector<Value>& values) {
  size_t place = 0;
  for (size_t row = 0; row < values.size(); ++row) {
    if (kept[row]) values[place++] = values[row];
  }
  values.resize(place);
}

// Takes the first line off a text.
absl::StatusOr<absl::string_view> NextLine(absl::string_view& text) {
  const size_t end = text.find('\n');
  if (end == absl::string_view::npos) return absl::DataLossError("the cuts of runs break off");
  const absl::string_view line = text.substr(0, end);
  text.remove_prefix(end + 1);
  return line;
}

}  // namespace

void RunCuts::Add(const SampleRow& row, bool first_of_record, absl::string_view reason) {
  everything_ = everything_ || first_of_record;
  cuts_[row.run] = {row.time_s, absl::StrReplaceAll(reason, {{"\n", " "}})};
}

bool RunCuts::LeavesOut(int run, double time_s) const {
  const auto cut = cuts_.find(run);
  return everything_ || (cut != cuts_.end() && time_s >= cut->second.from_s);
}

Samples RunCuts::Keep(Samples samples) const {
  if (cuts_.empty()) return samples;
  // Before its first row a record has no run that could end.
  if (everything_) samples.end_of_run = false;
  std::vector<bool> kept(samples.rows());
  for (size_t row = 0; row < samples.rows(); ++row) {
    kept[row] = !LeavesOut(samples.run.empty() ? 0 : samples.run[row], samples.time_s[row]);
  }
  if (std::ranges::find(kept, false) == kept.end()) return samples;
  Filter(kept, samples.time_s);
  if (!samples.run.empty()) Filter(kept, samples.run);
  for (SampleColumn& column : samples.columns) {
    Filter(kept, column.value);
    if (!column.missing.empty()) Filter(kept, column.missing);
  }
  // A run that is cut waits for nothing, but rows before it may: an end without rows says nothing.
  samples.end_of_run = samples.end_of_run && samples.rows() > 0;
  return samples;
}

Diagnostic RunCuts::Describe() const {
  const auto& [run, cut] = *cuts_.begin();
  std::string message =
      everything_ ? absl::StrFormat("no row could be used, not even the first one: %s", cut.reason)
                  : absl::StrFormat(
                        "the rows of run %d from t = %g s on were left out: %s; rows of a new "
                        "run are used again",
                        run, cut.from_s, cut.reason);
  if (!everything_ && cuts_.size() > 1) {
    absl::StrAppendFormat(&message, "; the same happened in %d more of the runs", cuts_.size() - 1);
  }
  return {DiagnosticCode::kPointsFailed, std::move(message)};
}

std::string RunCuts::Prepend(std::string state) const {
  if (cuts_.empty()) return state;
  std::string text = absl::StrFormat("%s\n%d %d\n", kMark, cuts_.size(), everything_);
  for (const auto& [run, cut] : cuts_) {
    absl::StrAppendFormat(&text, "%d %.17g %s\n", run, cut.from_s, cut.reason);
  }
  return text + state;
}

absl::StatusOr<RunCuts> RunCuts::Split(std::string& state) {
  RunCuts cuts;
  absl::string_view rest = state;
  if (!absl::StartsWith(rest, kMark)) return cuts;
  const absl::Status unreadable = absl::DataLossError("the cuts of runs cannot be read");
  POLYEST_RETURN_IF_ERROR(NextLine(rest).status());
  POLYEST_ASSIGN_OR_RETURN(const absl::string_view head, NextLine(rest));
  const std::vector<absl::string_view> counts = absl::StrSplit(head, ' ');
  int64_t count = 0;
  if (counts.size() != 2 || !absl::SimpleAtoi(counts[0], &count)) return unreadable;
  cuts.everything_ = counts[1] == "1";
  for (int64_t i = 0; i < count; ++i) {
    POLYEST_ASSIGN_OR_RETURN(const absl::string_view line, NextLine(rest));
    const std::vector<absl::string_view> words = absl::StrSplit(line, absl::MaxSplits(' ', 2));
    int run = 0;
    Cut cut;
    if (words.size() != 3 || !absl::SimpleAtoi(words[0], &run) ||
        !absl::SimpleAtod(words[1], &cut.from_s)) {
      return unreadable;
    }
    cut.reason = std::string(words[2]);
    cuts.cuts_[run] = std::move(cut);
  }
  state = std::string(rest);
  return cuts;
}

}  // namespace polyest::internal
