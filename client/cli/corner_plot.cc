#include <absl/strings/str_cat.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/number_format.h"
#include "client/cli/study_plots.h"
#include "client/plot/colors.h"

namespace polyest::internal {
namespace {

using Posterior = v1::ComputePosteriorResponse;

constexpr int kMaxParameters = 8;  // of which ComputePosteriorRequest.all_joints gives the joints

LinePanel DensityPanel(const Posterior::Marginal& parameter) {
  LinePanel panel;
  panel.title = parameter.name();
  panel.x_label = NameWithUnit(parameter.name(), parameter.unit());
  BandSeries area{"", kBlue, {}, {}, {}};
  area.x.assign(parameter.value().begin(), parameter.value().end());
  area.lower.assign(area.x.size(), 0);
  area.upper.assign(parameter.density().begin(), parameter.density().end());
  LineSeries line{"", kBlue, LineStyle::kSolid, area.x, area.upper};
  panel.areas = {std::move(area)};
  panel.series = {std::move(line)};
  panel.vertical_lines = {{"mean", kOrange, parameter.mean()}};
  return panel;
}

// Returns the mean of each value and its neighbours with the weights 1, 2, 1 on each axis. A
// histogram of draws has more scatter than shape from bin to bin.
Matrix Smoothed(const Matrix& values) {
  Matrix smooth = values;
  for (Eigen::Index i = 1; i + 1 < values.rows(); ++i) {
    smooth.row(i) = 0.25 * (values.row(i - 1) + 2 * values.row(i) + values.row(i + 1));
  }
  const Matrix once = smooth;
  for (Eigen::Index j = 1; j + 1 < values.cols(); ++j) {
    smooth.col(j) = 0.25 * (once.col(j - 1) + 2 * once.col(j) + once.col(j + 1));
  }
  return smooth;
}

// Returns the density above which there is this share of the probability.
double LevelOf(const Matrix& density, double share) {
  std::vector<double> values(density.data(), density.data() + density.size());
  std::sort(values.begin(), values.end(), std::greater<>());
  const double wanted = share * density.sum();
  double sum = 0;
  for (const double value : values) {
    sum += value;
    if (sum >= wanted) return value;
  }
  return values.back();
}

ContourPanel JointPanel(const Posterior& posterior, const Posterior::Joint& joint, int across,
                        int up) {
  const bool swapped = joint.first() != posterior.parameters(across).name();
  const auto rows = joint.first_value_size(), columns = joint.second_value_size();
  Matrix density(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) density(i, j) = joint.density(i * columns + j);
  }
  const auto& x = swapped ? joint.second_value() : joint.first_value();
  const auto& y = swapped ? joint.first_value() : joint.second_value();
  ContourPanel panel;
  panel.x = Eigen::Map<const Vector>(x.data(), x.size());
  panel.y = Eigen::Map<const Vector>(y.data(), y.size());
  panel.value = Smoothed(swapped ? Matrix(density.transpose()) : density);
  panel.levels = {LevelOf(panel.value, 0.95), LevelOf(panel.value, 0.5)};
  panel.level_texts = {"95 %", "50 %"};
  if (!(panel.levels[1] > panel.levels[0])) {
    panel.levels.pop_back();
    panel.level_texts.pop_back();
  }
  const Posterior::Marginal &first = posterior.parameters(across),
                            &second = posterior.parameters(up);
  panel.x_label = NameWithUnit(first.name(), first.unit());
  panel.y_label = NameWithUnit(second.name(), second.unit());
  panel.points = {{"mean", kOrange, first.mean(), second.mean()}};
  return panel;
}

// Returns the panel of a pair; an empty one if its joint density is not there.
Panel PairPanel(const Posterior& posterior, int across, int up) {
  const std::string &first = posterior.parameters(across).name(),
                    &second = posterior.parameters(up).name();
  for (const Posterior::Joint& joint : posterior.joints()) {
    const bool same = joint.first() == first && joint.second() == second;
    const bool swapped = joint.first() == second && joint.second() == first;
    const bool drawable = joint.first_value_size() >= 2 && joint.second_value_size() >= 2;
    if ((same || swapped) && drawable) return JointPanel(posterior, joint, across, up);
  }
  return EmptyPanel();
}

}  // namespace

Plot MakePlot(const Posterior& posterior) {
  const int count = std::min(posterior.parameters_size(), kMaxParameters);
  Plot plot;
  plot.title = count < posterior.parameters_size()
                   ? absl::StrCat("Posterior of the first ", count, " parameters")
                   : "Posterior";
  plot.description =
      "The density of each parameter on the diagonal; below it the regions of highest density of "
      "each pair that hold 50 % and 95 % of the probability";
  plot.columns = count;
  plot.panel_width = 320;
  plot.panel_height = 270;
  for (int up = 0; up < count; ++up) {
    for (int across = 0; across < count; ++across) {
      if (across == up) {
        plot.panels.emplace_back(DensityPanel(posterior.parameters(up)));
      } else {
        plot.panels.push_back(across < up ? PairPanel(posterior, across, up) : EmptyPanel());
      }
    }
  }
  return plot;
}

}  // namespace polyest::internal
