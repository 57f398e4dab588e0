#include "proto/wire/check/data_summary.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>

#include "core/estimator/expansion/prior_prediction.h"
#include "core/estimator/record/record_summary.h"
#include "core/estimator/record/suspicious_data.h"
#include "proto/wire/check/numbers.h"

namespace polyest::internal {
namespace {

struct Steps {
  double usual_s = 0;  // the median; 0: there is none
  double shortest_s = 0;
  double longest_s = 0;
  int runs = 0;
};

Steps StepsOf(const std::vector<SampleRow>& rows) {
  Steps steps;
  std::vector<double> lengths;
  for (size_t k = 0; k < rows.size(); ++k) {
    if (k == 0 || rows[k].run != rows[k - 1].run) {
      ++steps.runs;
      continue;
    }
    lengths.push_back(rows[k].time_s - rows[k - 1].time_s);
  }
  if (lengths.empty()) return steps;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  steps.usual_s = *middle;
  const auto [shortest, longest] = std::minmax_element(lengths.begin(), lengths.end());
  steps.shortest_s = *shortest;
  steps.longest_s = *longest;
  return steps;
}

class Summarizer {
 public:
  Summarizer(const ResolvedProblem& problem, const CheckedSamples& samples)
      : problem_(problem),
        model_(problem.problem().model->description()),
        samples_(samples),
        steps_(StepsOf(samples.rows)) {}

  DataSummary Run() {
    DescribeRows();
    RecordSummary record;
    for (int row = 0; row < samples_.count(); ++row) {
      record.Add(samples_, row, problem_.channels());
    }
    AddPredictionsOfPrior(problem_, record);
    const auto channels = static_cast<size_t>(problem_.channels());
    for (size_t place = 0; place < record.facts().columns().size(); ++place) {
      const bool measured = place < channels;
      const int column =
          measured ? problem_.outputs()[place] : problem_.streamed_inputs()[place - channels];
      const auto& quantities = measured ? model_.outputs : model_.inputs;
      DescribeColumn(quantities[static_cast<size_t>(column)], record.facts().columns()[place]);
    }
    summary_.warnings = WarnOfSuspiciousData(problem_, record.facts());
    return std::move(summary_);
  }

 private:
  void DescribeRows() {
    const auto by_time = [](const SampleRow& a, const SampleRow& b) { return a.time_s < b.time_s; };
    const auto [first, last] =
        std::minmax_element(samples_.rows.begin(), samples_.rows.end(), by_time);
    summary_.rows =
        absl::StrCat(Counted(static_cast<int64_t>(samples_.rows.size()), "row"), ", ",
                     steps_.runs > 1 ? absl::StrCat(steps_.runs, " runs, ") : "", "t from ",
                     Number(first->time_s), " to ", Number(last->time_s), " s");
    if (problem_.gate() != nullptr) {
      absl::StrAppend(&summary_.rows, ", ", samples_.left_out, " of them left out by useWhen");
    }
    if (steps_.usual_s == 0) return;
    // Times in a file are rounded: a thousandth of a step is no irregularity.
    const bool regular = steps_.longest_s - steps_.shortest_s < 1e-3 * steps_.usual_s;
    absl::StrAppend(&summary_.rows,
                    regular ? absl::StrCat(", every ", Number(steps_.usual_s), " s (",
                                           absl::StrFormat("%.4g", 1 / steps_.usual_s), " Hz)")
                            : absl::StrCat(", steps of ", Number(steps_.shortest_s), " to ",
                                           Number(steps_.longest_s), " s, usually ",
                                           Number(steps_.usual_s), " s"));
  }

  void DescribeColumn(const Quantity& quantity, const ColumnFacts& column) {
    if (column.samples == 0) {
      summary_.channels.push_back(quantity.name + ": no sample");
      return;
    }
    const std::string unit = quantity.unit == "1" ? "" : " " + quantity.unit;
    summary_.channels.push_back(absl::StrCat(quantity.name, ": ", Counted(column.samples, "sample"),
                                             " from ", Number(column.smallest), " to ",
                                             Number(column.largest), unit));
  }

  const ResolvedProblem& problem_;
  const ModelDescription& model_;
  const CheckedSamples& samples_;
  Steps steps_;
  DataSummary summary_;
};

}  // namespace

DataSummary Summarize(const ResolvedProblem& problem, const CheckedSamples& samples) {
  CheckedSamples whole = samples;
  whole.run_ended = true;
  return Summarizer(problem, whole).Run();
}

}  // namespace polyest::internal
