#include "client/cli/regularization_plot.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <limits>
#include <utility>

#include "client/cli/number_format.h"
#include "client/plot/colors.h"

namespace polyest::internal {
namespace {

using Sweep = v1::ComputeRegularizationSweepResponse;

constexpr char kWeight[] = "log₁₀ α²";
constexpr double kMinLogEvidence = -20;  // points with less evidence are not drawn

struct Rule {
  const char* name;
  const char* color;
  const Sweep::Choice& choice;
};

std::vector<Rule> RulesThatChoose(const Sweep& sweep) {
  std::vector<Rule> rules;
  for (const Rule& rule : {Rule{"L-curve", kOrange, sweep.l_curve()},
                           {"discrepancy", kTeal, sweep.discrepancy()},
                           {"evidence", kMagenta, sweep.evidence()}}) {
    if (rule.choice.determined()) rules.push_back(rule);
  }
  return rules;
}

// Returns an empty panel over log₁₀ α² with a vertical line at the choice of each rule.
LinePanel PanelOverWeight(const Sweep& sweep, std::string title, std::string y_label) {
  LinePanel panel;
  panel.title = std::move(title);
  panel.x_label = kWeight;
  panel.y_label = std::move(y_label);
  for (const Rule& rule : RulesThatChoose(sweep)) {
    panel.vertical_lines.push_back(
        {rule.name, rule.color, std::log10(rule.choice.regularization())});
  }
  return panel;
}

LinePanel LCurvePanel(const Sweep& sweep) {
  LinePanel panel;
  panel.title = "L-curve";
  panel.x_label = "log₁₀ mismatch";
  panel.y_label = "prior term";
  LineSeries series{"", kBlue, LineStyle::kMarkers, {}, {}};
  for (const Sweep::Point& point : sweep.points()) {
    if (!(point.cost().mismatch() > 0)) continue;
    series.x.push_back(std::log10(point.cost().mismatch()));
    series.y.push_back(point.cost().prior());
  }
  panel.series.push_back(std::move(series));
  return panel;
}

LinePanel EvidencePanel(const Sweep& sweep) {
  LinePanel panel = PanelOverWeight(sweep, "Evidence", "log evidence − greatest");
  LineSeries series{"", kBlue, LineStyle::kSolid, {}, {}};
  for (const Sweep::Point& point : sweep.points()) {
    const bool seen = point.log_evidence() > kMinLogEvidence;
    series.x.push_back(std::log10(point.regularization()));
    series.y.push_back(seen ? point.log_evidence() : std::numeric_limits<double>::quiet_NaN());
  }
  panel.series.push_back(std::move(series));
  return panel;
}

LinePanel ParameterPanel(const Sweep& sweep, int i) {
  LinePanel panel = PanelOverWeight(sweep, sweep.parameters(i),
                                    NameWithUnit(sweep.parameters(i), sweep.units(i)));
  LineSeries map{"estimate", kBlue, LineStyle::kSolid, {}, {}};
  LineSeries lower{"± stdDev", kBlue, LineStyle::kDotted, {}, {}};
  LineSeries upper{"", kBlue, LineStyle::kDotted, {}, {}};
  for (const Sweep::Point& point : sweep.points()) {
    const double weight = std::log10(point.regularization());
    for (const auto& [series, sign] : {std::pair{&map, 0}, {&lower, -1}, {&upper, 1}}) {
      series->x.push_back(weight);
      series->y.push_back(point.map(i) + sign * point.std_dev(i));
    }
  }
  panel.series = {std::move(map), std::move(lower), std::move(upper)};
  return panel;
}

}  // namespace

Plot MakePlot(const Sweep& sweep) {
  Plot plot;
  plot.title = "Regularization";
  plot.description = "The estimate over the weight α² of the prior term of the cost";
  plot.panels.push_back(LCurvePanel(sweep));
  plot.panels.push_back(EvidencePanel(sweep));
  for (int i = 0; i < sweep.parameters_size(); ++i) plot.panels.push_back(ParameterPanel(sweep, i));
  return plot;
}

}  // namespace polyest::internal
