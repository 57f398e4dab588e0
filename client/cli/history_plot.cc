#include "client/cli/history_plot.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/number_format.h"
#include "client/plot/colors.h"

namespace polyest::internal {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

// Whether times increase from point to point, as they do within one run.
bool TimesIncrease(const v1::EstimateHistory& history) {
  for (int i = 1; i < history.points_size(); ++i) {
    if (!(history.points(i).time_s() > history.points(i - 1).time_s())) return false;
  }
  return true;
}

// Returns the range of the intervals from a quarter of the points on, with as much again on each
// side, so that the wide ones of the beginning do not hide the others.
std::pair<double, double> VerticalRange(const BandSeries& band) {
  double lower = std::numeric_limits<double>::infinity(), upper = -lower;
  double least = lower, largest = upper;
  for (size_t i = 0; i < band.x.size(); ++i) {
    if (std::isnan(band.lower[i])) continue;
    least = std::min(least, band.lower[i]);
    largest = std::max(largest, band.upper[i]);
    if (4 * i < band.x.size()) continue;
    lower = std::min(lower, band.lower[i]);
    upper = std::max(upper, band.upper[i]);
  }
  if (!(upper > lower)) return {least, largest};
  const double width = upper - lower;
  return {std::max(least, lower - width), std::min(largest, upper + width)};
}

using Parameter = v1::EstimateHistory::Parameter;

// The values of a point that a panel shows: `parameters` or `drifting`.
using Values =
    const google::protobuf::RepeatedPtrField<Parameter>& (v1::EstimateHistory::Point::*)() const;

LinePanel ParameterPanel(const v1::EstimateHistory& history, Values values, const std::string& name,
                         const std::string& unit, bool over_time) {
  LinePanel panel;
  panel.x_label = over_time ? "t (s)" : "samples";
  panel.y_label = NameWithUnit(name, unit);
  BandSeries band{"95 % interval", kBlue, {}, {}, {}};
  LineSeries mean{"estimate", kBlue, LineStyle::kSolid, {}, {}};
  for (const v1::EstimateHistory::Point& point : history.points()) {
    const double x = over_time ? point.time_s() : static_cast<double>(point.sample_count());
    band.x.push_back(x);
    mean.x.push_back(x);
    const auto found = std::ranges::find((point.*values)(), name, &Parameter::name);
    const bool known = found != (point.*values)().end();
    band.lower.push_back(known ? found->lower95() : kGap);
    band.upper.push_back(known ? found->upper95() : kGap);
    mean.y.push_back(known ? found->mean() : kGap);
  }
  if (!band.x.empty()) panel.y_range = VerticalRange(band);
  panel.areas = {std::move(band)};
  panel.series = {std::move(mean)};
  return panel;
}

}  // namespace

Plot MakePlot(const v1::EstimateHistory& history) {
  Plot plot;
  plot.title = "How the estimate came about";
  plot.description = "Each parameter's estimate and 95 % interval while measurements came in";
  const bool over_time = TimesIncrease(history);
  const auto add = [&](Values values, const std::string& when) {
    std::vector<std::string> names;
    for (const v1::EstimateHistory::Point& point : history.points()) {
      for (const Parameter& parameter : (point.*values)()) {
        if (std::ranges::find(names, parameter.name()) != names.end()) continue;
        names.push_back(parameter.name());
        LinePanel panel =
            ParameterPanel(history, values, parameter.name(), parameter.unit(), over_time);
        panel.title = absl::StrCat(parameter.name(), when);
        plot.panels.emplace_back(std::move(panel));
      }
    }
  };
  add(&v1::EstimateHistory::Point::parameters, "");
  add(&v1::EstimateHistory::Point::drifting, " at the time");
  return plot;
}

}  // namespace polyest::internal
