#include "proto/wire/check/data_summary.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include "proto/wire/check/numbers.h"

namespace polyest::internal {
namespace {

// A step longer than this many usual steps is a gap. A first row later than this many usual steps
// after t = 0 is suspicious.
constexpr double kGapSteps = 10;
// If the smallest noise is below this part of the largest, a few samples outweigh all others.
constexpr double kNoiseRange = 1e-3;

std::string Counted(int64_t count, const char* what) {
  return absl::StrCat(count, " ", what, count == 1 ? "" : "s");
}

struct Steps {
  double usual_s = 0;  // the median; 0: there is none
  double shortest_s = 0;
  double longest_s = 0;
  double longest_after_s = 0;  // time at which the longest begins
  int gaps = 0;
  int runs = 0;
  double largest_first_s = 0;  // latest time of a run's first row
};

Steps StepsOf(const std::vector<SampleRow>& rows) {
  Steps steps;
  std::vector<double> lengths;
  for (size_t k = 0; k < rows.size(); ++k) {
    if (k == 0 || rows[k].run != rows[k - 1].run) {
      ++steps.runs;
      steps.largest_first_s = std::max(steps.largest_first_s, rows[k].time_s);
      continue;
    }
    const double length = rows[k].time_s - rows[k - 1].time_s;
    if (length > steps.longest_s) {
      steps.longest_s = length;
      steps.longest_after_s = rows[k - 1].time_s;
    }
    lengths.push_back(length);
  }
  if (lengths.empty()) return steps;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  steps.usual_s = *middle;
  steps.shortest_s = *std::min_element(lengths.begin(), lengths.end());
  steps.gaps = static_cast<int>(std::count_if(lengths.begin(), lengths.end(), [&](double length) {
    return length > kGapSteps * steps.usual_s;
  }));
  return steps;
}

// Values of a column of the record, and their statistics.
struct Channel {
  std::vector<double> values;  // without missing ones
  double smallest = std::numeric_limits<double>::infinity();
  double largest = -std::numeric_limits<double>::infinity();
  double spread = 0;  // standard deviation of the values
  double min_noise = std::numeric_limits<double>::infinity();
  double max_noise = 0;
};

Channel ChannelOf(const CheckedSamples& samples, size_t place, size_t width, size_t channels) {
  Channel channel;
  for (size_t k = 0; k < samples.rows.size(); ++k) {
    const double value = samples.values[k * width + place];
    if (std::isnan(value)) continue;
    channel.values.push_back(value);
    channel.smallest = std::min(channel.smallest, value);
    channel.largest = std::max(channel.largest, value);
    if (place >= channels) continue;
    const double noise = samples.noise[k * channels + place];
    channel.min_noise = std::min(channel.min_noise, noise);
    channel.max_noise = std::max(channel.max_noise, noise);
  }
  const auto count = static_cast<double>(channel.values.size());
  double mean = 0;
  for (const double value : channel.values) mean += value / count;
  double sum = 0;
  for (const double value : channel.values) sum += (value - mean) * (value - mean);
  if (count > 0) channel.spread = std::sqrt(sum / count);
  return channel;
}

// Returns the step of which all differences between values are multiples, such as that of an
// analogue-to-digital converter or of a file with few digits; 0 if there is none.
double Resolution(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  double step = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < values.size(); ++i) step = std::min(step, values[i] - values[i - 1]);
  if (values.size() < 3) return 0;
  for (const double value : values) {
    const double multiple = (value - values.front()) / step;
    if (std::abs(multiple - std::round(multiple)) > 1e-3) return 0;
  }
  return step;
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
    WarnOfTimes();
    const auto channels = static_cast<size_t>(problem_.channels());
    const size_t width = channels + problem_.streamed_inputs().size();
    for (size_t place = 0; place < width; ++place) {
      const bool measured = place < channels;
      const int column =
          measured ? problem_.outputs()[place] : problem_.streamed_inputs()[place - channels];
      const auto& quantities = measured ? model_.outputs : model_.inputs;
      const Channel channel = ChannelOf(samples_, place, width, channels);
      DescribeChannel(quantities[static_cast<size_t>(column)], channel);
      if (measured) {
        WarnOfNoise(problem_.problem().measured[place], channel);
        measured_ += channel.values.size();
      }
    }
    if (measured_ < static_cast<size_t>(problem_.dimension())) {
      Warn("there are only %d samples for %d unknowns: the prior determines what they leave open",
           measured_, problem_.dimension());
    }
    return std::move(summary_);
  }

 private:
  template <class... Arguments>
  void Warn(const absl::FormatSpec<Arguments...>& format, const Arguments&... arguments) {
    summary_.warnings.push_back(absl::StrFormat(format, arguments...));
  }

  void DescribeRows() {
    const auto by_time = [](const SampleRow& a, const SampleRow& b) { return a.time_s < b.time_s; };
    const auto [first, last] =
        std::minmax_element(samples_.rows.begin(), samples_.rows.end(), by_time);
    summary_.rows =
        absl::StrCat(Counted(static_cast<int64_t>(samples_.rows.size()), "row"), ", ",
                     steps_.runs > 1 ? absl::StrCat(steps_.runs, " runs, ") : "", "t from ",
                     Number(first->time_s), " to ", Number(last->time_s), " s");
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

  void WarnOfTimes() {
    if (steps_.gaps > 0) {
      Warn("%s of more than %g usual steps; the longest is %g s, after t = %g s",
           Counted(steps_.gaps, "gap"), kGapSteps, steps_.longest_s, steps_.longest_after_s);
    }
    if (!model_.states.empty() && steps_.usual_s > 0 &&
        steps_.largest_first_s > kGapSteps * steps_.usual_s) {
      Warn(
          "a run's first row is at t = %g s, but the model starts from its initial state at t = 0; "
          "if the record was cut out of a longer one, let its times begin at 0",
          steps_.largest_first_s);
    }
  }

  void DescribeChannel(const Quantity& quantity, const Channel& channel) {
    const auto count = static_cast<int64_t>(channel.values.size());
    if (count == 0) {
      summary_.channels.push_back(quantity.name + ": no sample");
      Warn("%s is measured, but the data have no sample of it", quantity.name);
      return;
    }
    const std::string unit = quantity.unit == "1" ? "" : " " + quantity.unit;
    summary_.channels.push_back(absl::StrCat(quantity.name, ": ", Counted(count, "sample"),
                                             " from ", Number(channel.smallest), " to ",
                                             Number(channel.largest), unit));
    if (count > 1 && channel.smallest == channel.largest) {
      Warn("%s never changes: it is %g in every row", quantity.name, channel.smallest);
    }
  }

  void WarnOfNoise(const MeasuredOutput& measured, const Channel& channel) {
    if (measured.noise.unknown) return;
    const std::string& name = measured.output;
    if (channel.values.size() < 3 || channel.smallest == channel.largest) return;
    if (channel.min_noise > channel.spread) {
      Warn("%s: its noise of %g is larger than the spread of its samples, %g", name,
           channel.min_noise, channel.spread);
    }
    const double rounding = Resolution(channel.values) / std::sqrt(12.0);
    if (channel.max_noise < rounding) {
      Warn("%s: its noise of at most %g is less than the rounding of its samples, %.2g", name,
           channel.max_noise, rounding);
    }
    // Noise with a part relative to the largest value so far is that small only during rest.
    if (measured.noise.relative_to_max == 0 &&
        channel.min_noise < kNoiseRange * channel.max_noise) {
      Warn(
          "%s: its noise goes down to %g, so that the samples near 0 outweigh all others; give it "
          "an absolute part",
          name, channel.min_noise);
    }
  }

  const ResolvedProblem& problem_;
  const ModelDescription& model_;
  const CheckedSamples& samples_;
  Steps steps_;
  size_t measured_ = 0;
  DataSummary summary_;
};

}  // namespace

DataSummary Summarize(const ResolvedProblem& problem, const CheckedSamples& samples) {
  return Summarizer(problem, samples).Run();
}

}  // namespace polyest::internal
