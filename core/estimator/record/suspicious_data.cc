#include "core/estimator/record/suspicious_data.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/estimator/problem/settable_quantities.h"

namespace polyest::internal {
namespace {

// If the smallest noise is below this part of the largest, a few samples outweigh all others.
constexpr double kNoiseRange = 1e-3;
// Probability below which the samples' spread is too small for their noise.
constexpr double kUnlikely = 5e-3;
// Rise of the noise with the largest value so far from which it is mentioned: the weights change by
// its square.
constexpr double kRiseOfNoise = 10;
constexpr int64_t kMinConstant = 3;  // samples of one value before it is said never to change
constexpr int64_t kMinDropouts = 4;  // to one value before they are mentioned
constexpr int64_t kMinBends = 32;    // samples of an input before its bends are judged
constexpr int kOfLines = 1;          // knots that straight lines need
constexpr double kMaxLost = 0.02;    // of an amplitude, by straight lines
constexpr double kMinPerPeriod = 5;  // samples, for a curve
constexpr int64_t kMinPlateaus = 4;  // at either end of a range before they are mentioned
// A fit explains its samples only with so many degrees of freedom left, and noise that is learned
// from it must be so much smaller than the samples' spread.
constexpr double kMinDegrees = 8;
constexpr double kExplained = 0.3;

// Returns an upper bound of the probability that χ² with `degrees` degrees of freedom is at most
// `chi_squared` (Chernoff): (r e^{1−r})^{degrees/2} with r = χ²/degrees < 1; else 1.
double ProbabilityOfLess(double chi_squared, double degrees) {
  if (degrees <= 0) return 1;
  const double r = chi_squared / degrees;
  return r < 1 ? std::exp(0.5 * degrees * (std::log(r) + 1 - r)) : 1;
}

// Returns the names of the parameters that are initial states, "x_0" or "x0" for a state x.
std::vector<std::string> InitialStates(const ModelDescription& model) {
  std::vector<std::string> names;
  for (const Quantity& state : model.states) {
    for (const std::string& name : {state.name + "_0", state.name + "0"}) {
      if (model.FindParameter(name)) names.push_back(name);
    }
  }
  return names;
}

// Whether the noise of an output is a fixed or an uncertain parameter and not what is stated.
bool IsNoiseSet(const ResolvedProblem& problem, const std::string& output) {
  const std::string name = NoiseName(output);
  const std::vector<std::string> uncertain = problem.prior().Names();
  return problem.problem().fixed.contains(name) ||
         std::ranges::find(uncertain, name) != uncertain.end();
}

// Whether the fitted model explains all samples of a column.
bool Explains(const ChannelFit& fit, const NoiseModel& noise, const ColumnFacts& column) {
  if (fit.contradicts || fit.degrees < kMinDegrees) return false;
  return !noise.unknown || fit.residual < kExplained * column.Spread();
}

// Whether the fitted model may explain what looks like dropouts: the squares of the residuals that
// are beyond the noise do not suffice for half the jumps. Noise that has been learned from these
// residuals is no larger than the usual step.
bool MayExplain(const ChannelFit& fit, const NoiseModel& noise, const ColumnFacts& column) {
  const SignalFaults& faults = column.faults;
  const RecurringValue dropouts = faults.Dropouts();
  const auto samples = static_cast<double>(column.samples);
  const double usual = faults.UsualStep();
  const double by_noise =
      noise.unknown ? samples * usual * usual : fit.degrees * fit.noise * fit.noise;
  const double jump = std::max(faults.SmallestJump(), std::abs(dropouts.value - column.mean));
  const double half = static_cast<double>(dropouts.count) * jump * jump / 4;
  return samples * fit.residual * fit.residual - by_noise < half;
}

class Warnings {
 public:
  Warnings(const ResolvedProblem& problem, const DataFacts& facts,
           const std::vector<ChannelFit>& fits)
      : problem_(problem),
        model_(problem.problem().model->description()),
        intervals_(facts.intervals()),
        columns_(facts.columns()),
        inputs_(facts.inputs()),
        fits_(fits) {}

  std::vector<std::string> Run() {
    if (columns_.empty()) return {};
    const auto channels = static_cast<size_t>(problem_.channels());
    for (size_t i = 0; i < inputs_.size(); ++i) {
      AddGaps(NameOf(channels + i), inputs_[i].intervals);
      AddBeginning(NameOf(channels + i), inputs_[i].intervals);
      AddEnds(NameOf(channels + i), inputs_[i], problem_.knots_needed()[i] == 0);
      AddBends(NameOf(channels + i), inputs_[i], columns_[channels + i],
               problem_.knots_needed()[i]);
    }
    AddLateStart();
    int64_t samples = 0;
    for (size_t i = 0; i < columns_.size(); ++i) {
      AddConstant(i, columns_[i]);
      if (i >= channels) continue;
      samples += columns_[i].samples;
      AddFaults(i);
      AddNoise(i);
      AddPrediction(problem_.problem().measured[i], columns_[i]);
    }
    if (samples < problem_.dimension()) {
      Add("there are only %d samples for %d unknowns: the prior determines what they leave open",
          samples, problem_.dimension());
    }
    return std::move(warnings_);
  }

 private:
  template <class... Arguments>
  void Add(const absl::FormatSpec<Arguments...>& format, const Arguments&... arguments) {
    warnings_.push_back(absl::StrFormat(format, arguments...));
  }

  const std::string& NameOf(size_t column) const {
    const auto channels = static_cast<size_t>(problem_.channels());
    if (column < channels) return problem_.problem().measured[column].output;
    const int input = problem_.streamed_inputs()[column - channels];
    return model_.inputs[static_cast<size_t>(input)].name;
  }

  // Returns "its initial state (x0, v0)".
  std::string InitialState() const {
    const std::vector<std::string> names = InitialStates(model_);
    return names.empty() ? "its initial state"
                         : absl::StrCat("its initial state (", absl::StrJoin(names, ", "), ")");
  }

  bool StartsLate() const { return !model_.states.empty() && intervals_.StartsLate(); }

  // Between samples the model goes on exactly, unless an input is known at the samples only.
  void AddGaps(const std::string& name, const IntervalFacts& intervals) {
    const int64_t gaps = intervals.gaps();
    if (gaps == 0) return;
    Add("%s: %d gap%s of more than %g usual steps; the longest is %g s, after t = %g s: the "
        "streamed input is interpolated across it, and what it did there is not known; split the "
        "record there with a column run, and make %s uncertain with perRun",
        name, gaps, gaps == 1 ? "" : "s", IntervalFacts::kGapSteps, intervals.longest_s(),
        intervals.longest_after_s(), InitialState());
  }

  // Before its first sample in a run an input has that sample's value.
  void AddBeginning(const std::string& name, const IntervalFacts& intervals) {
    const double late_s = intervals.latest_first_s() - intervals_.latest_first_s();
    if (!(intervals.usual_s() > 0 && late_s > IntervalFacts::kGapSteps * intervals.usual_s())) {
      return;
    }
    Add("%s: the streamed input has no sample in the first %g s of a run, before t = %g s, and is "
        "taken to have its first value there; let the record begin at its first sample",
        name, late_s, intervals.latest_first_s());
  }

  // Without any sample in a run an input is 0, and after its last one it stays as it is, which for
  // a held input is what it is meant to do.
  void AddEnds(const std::string& name, const InputFacts& input, bool is_held) {
    if (input.runs_without > 0) {
      Add("%s: the streamed input has no sample in %d run%s and is taken as 0 there", name,
          input.runs_without, input.runs_without == 1 ? "" : "s");
    }
    const double usual_s = input.intervals.usual_s();
    if (is_held || !(usual_s > 0 && input.longest_end_s > IntervalFacts::kGapSteps * usual_s)) {
      return;
    }
    Add("%s: the streamed input has no sample in the last %g s of a run, after t = %g s, and is "
        "taken to stay at its last value there",
        name, input.longest_end_s, input.end_from_s);
  }

  // Between its samples an input follows straight lines or a curve. The second differences of a
  // sine that advances by w from sample to sample have (2 sin(w/2))⁴ of its mean square, and
  // straight lines lose w²/12 of its amplitude.
  void AddBends(const std::string& name, const InputFacts& input, const ColumnFacts& column,
                int knots_needed) {
    if (knots_needed == 0 || column.samples < kMinBends || !(column.square_sum > 0)) return;
    const double chord = std::pow(input.bends / column.square_sum, 0.25);
    const double w = 2 * std::asin(std::min(1.0, chord / 2));
    const double per_period = 2 * std::numbers::pi / w;
    const double lost = w * w / 12;
    if (knots_needed == kOfLines && lost > kMaxLost) {
      Add("%s: about %.2g samples of the streamed input are a period of it, and straight lines "
          "between them lose %.2g %% of its amplitude; let it follow the smooth curve, sample it "
          "more often, or say that it is held if it is",
          name, per_period, 100 * lost);
    } else if (knots_needed > kOfLines && per_period < kMinPerPeriod) {
      Add("%s: about %.2g samples of the streamed input are a period of it, so that the curve "
          "between them is a guess; sample it more often, or say that it is held if it is",
          name, per_period);
    }
  }

  const ChannelFit* FitOf(size_t channel) const {
    return channel < fits_.size() ? &fits_[channel] : nullptr;
  }

  bool IsAllExplained() const {
    for (size_t c = 0; c < fits_.size(); ++c) {
      if (!Explains(fits_[c], problem_.problem().measured[c].noise, columns_[c])) return false;
    }
    return !fits_.empty();
  }

  // A model that explains what follows was in its initial state at t = 0.
  void AddLateStart() {
    if (!StartsLate() || IsAllExplained()) return;
    Add("t does not begin near 0: a run's first row is at t = %g s, but the model starts from its "
        "initial state at t = 0; if the record was cut out of a longer one, let its times begin at "
        "0 and make %s uncertain",
        intervals_.latest_first_s(), InitialState());
  }

  void AddConstant(size_t place, const ColumnFacts& column) {
    const std::string& name = NameOf(place);
    if (column.samples == 0 && place < static_cast<size_t>(problem_.channels())) AddNoSample(place);
    if (column.samples >= kMinConstant && column.smallest == column.largest) {
      Add("%s never changes: it is %g in every row; is the sensor connected?", name,
          column.smallest);
    }
  }

  void AddNoSample(size_t channel) {
    const std::string& output = NameOf(channel);
    const double from_s = problem_.used_from_s()[channel];
    const char* const gate = problem_.gate() == nullptr ? "" : " in rows for which useWhen holds";
    if (from_s > 0) {
      Add("%s is measured, but the data have no sample of it%s after t = %g s, the largest delay "
          "that its prior allows, before which samples are not used",
          output, gate, from_s);
    } else {
      Add("%s is measured, but the data have no sample of it%s", output, gate);
    }
  }

  // Where gross errors are expected, dropouts are taken care of.
  void AddFaults(size_t channel) {
    const MeasuredOutput& measured = problem_.problem().measured[channel];
    const ChannelFit* fit = FitOf(channel);
    const SignalFaults& faults = columns_[channel].faults;
    const RecurringValue dropouts = faults.Dropouts();
    if (measured.noise.outliers == OutlierHandling::kNone && dropouts.count >= kMinDropouts &&
        !(fit != nullptr && MayExplain(*fit, measured.noise, columns_[channel]))) {
      Add("%s: it jumps to %g and back at least %d times, as when a signal drops out; leave these "
          "cells empty, or give its noise outliers",
          measured.output, dropouts.value, dropouts.count);
    }
    // Correlated noise takes up the residuals that a clipped signal leaves; coarse steps are flat.
    if (fit != nullptr && fit->white && !fit->contradicts) return;
    if (CoarseStepsOf(problem_, channel, columns_[channel], fit)) return;
    for (const RecurringValue& end : {faults.UpperPlateaus(), faults.LowerPlateaus()}) {
      if (end.count < kMinPlateaus) continue;
      Add("%s: it stops at %g %d times, for three samples or more each, as at the end of a "
          "measuring range; leave these cells empty, or measure with a larger range",
          measured.output, end.value, end.count);
    }
  }

  void AddCoarseSteps(const std::string& name, const CoarseSteps& coarse) {
    Add("%s: its samples come in steps of %.3g, beside which their noise of about %.2g is small: "
        "errors of up to half a step last as long as the signal stays within one and come back "
        "with it, so that the uncertainty may be far too small; measure with a finer range, add "
        "dither, or state noise of half a step that is correlated for as long",
        name, coarse.step, coarse.noise);
  }

  void AddNoise(size_t channel) {
    const MeasuredOutput& measured = problem_.problem().measured[channel];
    const ColumnFacts& column = columns_[channel];
    const std::string& name = measured.output;
    if (column.samples < 3 || column.smallest == column.largest) return;
    const bool is_unknown = measured.noise.unknown || IsNoiseSet(problem_, name);
    if (const auto coarse = CoarseStepsOf(problem_, channel, column, FitOf(channel))) {
      AddCoarseSteps(name, *coarse);
    } else if (!is_unknown) {
      AddSizeOfNoise(name, column);
    }
    // Noise with a part relative to the largest value so far is that small only during rest.
    if (measured.noise.relative_to_max == 0 && column.min_noise < kNoiseRange * column.max_noise) {
      Add("%s: its noise goes down to %s, so that the samples near 0 outweigh all others; give it "
          "an absolute part",
          name,
          is_unknown ? "less than a thousandth of the largest"
                     : absl::StrFormat("%g", column.min_noise));
    }
    if (is_unknown) return;
    AddRunningMaximum(measured, column);
  }

  void AddSizeOfNoise(const std::string& name, const ColumnFacts& column) {
    const double chi_squared = column.square_sum / (column.min_noise * column.min_noise);
    if (ProbabilityOfLess(chi_squared, static_cast<double>(column.samples - 1)) < kUnlikely) {
      Add("%s: its noise of %g is larger than the spread of its samples, %g; check its size and "
          "its unit",
          name, column.min_noise, column.Spread());
    }
    const double rounding = column.Resolution() / std::sqrt(12.0);
    if (column.max_noise < rounding) {
      Add("%s: its noise of at most %g is less than the rounding of its samples, %.2g, which is "
          "noise as well",
          name, column.max_noise, rounding);
    }
  }

  // Noise relative to the largest value so far is small during rest, and rises with the signal.
  void AddRunningMaximum(const MeasuredOutput& measured, const ColumnFacts& column) {
    const NoiseModel& noise = measured.noise;
    if (noise.relative_to_max == 0 || noise.full_scale > 0 || noise.absolute > 0) return;
    const double rise = column.max_noise / column.min_noise;
    if (!(rise >= kRiseOfNoise)) return;
    Add("%s: its noise rises with its largest value so far, from %g to %g, so that a sample before "
        "counts up to %.2g times as much as one after; give it its sensor's fullScale",
        measured.output, column.min_noise, column.max_noise, rise * rise);
  }

  // Noise that is not known, or has gross errors, is no measure of a sample's distance.
  void AddPrediction(const MeasuredOutput& measured, const ColumnFacts& column) {
    if (measured.noise.unknown || measured.noise.outliers != OutlierHandling::kNone) return;
    if (column.predicted == 0 || StartsLate()) return;
    const PriorPrediction& first = column.first;
    const double distance = DistanceOf(first);
    const bool is_fixed = first.variance <= first.noise * first.noise;
    if (!model_.states.empty() && is_fixed && distance > DataFacts::kFar) {
      Add("%s: its first sample, %g, is %.3g times its noise away from %g, where the model's "
          "initial state puts it whatever the unknowns are; check the unit of %s, or make %s "
          "uncertain",
          measured.output, first.value, distance, first.mean, measured.output, InitialState());
      return;
    }
    if (column.far < 2 || 2 * column.far <= column.predicted) return;
    Add("%s: the data are %.3g times as far from what the prior predicts as its spread and the "
        "noise together; check the unit of %s, the priors and the values that are fixed",
        measured.output, std::sqrt(column.error_sum / column.deviation_sum), measured.output);
  }

  const ResolvedProblem& problem_;
  const ModelDescription& model_;
  const IntervalFacts& intervals_;
  const std::vector<ColumnFacts>& columns_;
  const std::vector<InputFacts>& inputs_;
  const std::vector<ChannelFit>& fits_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::optional<CoarseSteps> CoarseStepsOf(const ResolvedProblem& problem, size_t channel,
                                         const ColumnFacts& column, const ChannelFit* fit) {
  const MeasuredOutput& measured = problem.problem().measured[channel];
  if (fit != nullptr) {
    if (measured.noise.correlation == NoiseCorrelation::kKnown) return std::nullopt;
    return FindCoarseSteps(column, {fit->noise, measured.noise.unknown, fit->residual});
  }
  const bool stated = !measured.noise.unknown &&
                      measured.noise.correlation == NoiseCorrelation::kWhite &&
                      !IsNoiseSet(problem, measured.output);
  if (!stated) return std::nullopt;
  return FindCoarseSteps(column, {.std_dev = column.max_noise});
}

std::vector<std::string> WarnOfSuspiciousData(const ResolvedProblem& problem,
                                              const DataFacts& facts,
                                              const std::vector<ChannelFit>& fits) {
  return Warnings(problem, facts, fits).Run();
}

}  // namespace polyest::internal
