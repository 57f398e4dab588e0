#include "client/cli/fit_plot.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "client/cli/number_format.h"
#include "client/plot/colors.h"

namespace polyest::internal {
namespace {

using Output = v1::PredictResponse::Output;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kGaussian95 = 1.96;
constexpr double kLimit = 4;  // of standardized residuals that are shown, at least

int RunOf(const v1::PredictResponse& prediction, int row) {
  return prediction.run().empty() ? 0 : prediction.run(row);
}

// Returns the index of the least or of the largest probability.
int Outermost(const v1::PredictResponse& prediction, bool largest) {
  const auto& p = prediction.probabilities();
  const auto found =
      largest ? std::max_element(p.begin(), p.end()) : std::min_element(p.begin(), p.end());
  return static_cast<int>(found - p.begin());
}

// The text of a band between the outermost probabilities: "95 %".
std::string BandText(const v1::PredictResponse& prediction) {
  const double between = prediction.probabilities(Outermost(prediction, true)) -
                         prediction.probabilities(Outermost(prediction, false));
  return FormatPercent(between);
}

// Calls `add` for each time, and before each run but the first with a gap, so that lines of
// different runs are not joined.
template <typename Add>
void ForEachTime(const v1::PredictResponse& prediction, const Add& add) {
  for (int k = 0; k < prediction.time_s_size(); ++k) {
    if (k > 0 && RunOf(prediction, k) != RunOf(prediction, k - 1)) add(-1, kNaN);
    add(k, prediction.time_s(k));
  }
}

// Returns the area between the outermost quantiles, times × probabilities.
BandSeries Band(const v1::PredictResponse& prediction,
                const google::protobuf::RepeatedField<double>& quantiles) {
  const int width = prediction.probabilities_size();
  const int lower = Outermost(prediction, false), upper = Outermost(prediction, true);
  BandSeries band;
  ForEachTime(prediction, [&](int k, double time_s) {
    band.x.push_back(time_s);
    band.lower.push_back(k < 0 ? kNaN : quantiles[k * width + lower]);
    band.upper.push_back(k < 0 ? kNaN : quantiles[k * width + upper]);
  });
  return band;
}

LinePanel FitPanel(const v1::PredictResponse& prediction, const Output& output) {
  LinePanel panel;
  panel.title = output.output();
  panel.x_label = "t (s)";
  panel.y_label = NameWithUnit(output.output(), output.unit());
  if (prediction.probabilities_size() >= 2) {
    if (!output.sample_quantiles().empty()) {
      panel.areas.push_back(Band(prediction, output.sample_quantiles()));
      panel.areas.back().label = absl::StrCat(BandText(prediction), " of new samples");
      panel.areas.back().color = kLightBlue;
    }
    panel.areas.push_back(Band(prediction, output.quantiles()));
    panel.areas.back().label = absl::StrCat(BandText(prediction), " of the model");
    panel.areas.back().color = kBlue;
  }
  LineSeries measured{"measured", kDarkGray, LineStyle::kMarkers, {}, {}};
  for (int i = 0; i < output.measured_rows_size(); ++i) {
    measured.x.push_back(prediction.time_s(output.measured_rows(i)));
    measured.y.push_back(output.measured(i));
  }
  LineSeries model{"model", kBlue, LineStyle::kSolid, {}, {}};
  ForEachTime(prediction, [&](int k, double time_s) {
    model.x.push_back(time_s);
    model.y.push_back(k < 0 ? kNaN : output.mean(k));
  });
  panel.series = {std::move(measured), std::move(model)};
  return panel;
}

LinePanel ResidualPanel(const v1::PredictResponse& prediction, const Output& output) {
  LinePanel panel;
  panel.title = "residuals";
  panel.x_label = "t (s)";
  panel.y_label = "residual ÷ its spread";
  LineSeries series{"", kOrange, LineStyle::kMarkers, {}, {}};
  double largest = kLimit;
  for (int i = 0; i < output.standardized_residual_size(); ++i) {
    series.x.push_back(prediction.time_s(output.measured_rows(i)));
    series.y.push_back(output.standardized_residual(i));
    largest = std::max(largest, std::abs(output.standardized_residual(i)));
  }
  panel.y_range = std::pair{-1.05 * largest, 1.05 * largest};
  panel.series = {std::move(series)};
  panel.horizontal_lines = {{"", kGray, -kGaussian95}, {"", kGray, kGaussian95}};
  return panel;
}

LinePanel AutocorrelationPanel(const Output& output) {
  LinePanel panel;
  panel.title = "autocorrelation";
  panel.x_label = "samples apart";
  panel.y_label = "correlation of residuals";
  LineSeries series{"", kOrange, LineStyle::kSolid, {0}, {1}};
  for (int lag = 0; lag < output.score().autocorrelation_size(); ++lag) {
    series.x.push_back(lag + 1);
    series.y.push_back(output.score().autocorrelation(lag));
  }
  panel.series = {std::move(series)};
  panel.y_range = std::pair{-1.05, 1.05};
  const auto samples = static_cast<double>(output.score().sample_count());
  if (samples > 0) {
    const double limit = kGaussian95 / std::sqrt(samples);
    panel.horizontal_lines = {{"", kGray, -limit}, {"", kGray, limit}};
  }
  return panel;
}

}  // namespace

Plot MakePlot(const v1::PredictResponse& prediction) {
  Plot plot;
  plot.title = "Model and measurements";
  plot.description =
      "Measured samples against the model's prediction with its bands, the residuals over time and "
      "their autocorrelation, a row for each output";
  const bool scored = std::ranges::any_of(prediction.outputs(), &Output::has_score);
  plot.columns = scored ? 3 : 1;
  plot.column_widths = scored ? std::vector<double>{640, 420, 320} : std::vector<double>{960};
  if (!scored) {
    plot.title = "From all samples";
    plot.description = "Outputs and parameters over time with their bands, from all samples";
  }
  for (const Output& output : prediction.outputs()) {
    plot.panels.emplace_back(FitPanel(prediction, output));
    if (!scored) continue;
    if (output.standardized_residual().empty()) {
      plot.panels.insert(plot.panels.end(), 2, EmptyPanel());
      continue;
    }
    plot.panels.emplace_back(ResidualPanel(prediction, output));
    plot.panels.emplace_back(AutocorrelationPanel(output));
  }
  return plot;
}

}  // namespace polyest::internal
