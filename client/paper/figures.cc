#include "client/paper/figures.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "client/plot/contours.h"

namespace polyest::internal {
namespace {

constexpr char kTotalColor[] = "#1f4e9c", kMismatchColor[] = "#d95f02", kPriorColor[] = "#1b9e77",
               kResponseColor[] = "#6a4c93", kSampleColor[] = "#222222",
               kReferenceColor[] = "#555555", kEstimateColor[] = "#c2185b";
constexpr int kContourLevels = 14;

std::vector<double> ToStdVector(const Vector& values) { return {values.begin(), values.end()}; }

// Returns the axis of one parameter of a cost grid in units of its germ.
Vector GermAxis(const CostGrid& grid, const Prior& prior, int axis) {
  for (const UncertainParameter& parameter : prior.parameters()) {
    if (parameter.name == grid.parameters[axis]) {
      return (grid.axes[axis].array() - parameter.location) / parameter.scale;
    }
  }
  return grid.axes[axis];
}

// Returns a panel with one output at the reference values and the variant's measurements.
LinePanel ResponsePanel(const ExperimentResult& result, int variant, int channel) {
  const ExperimentVariant& asked = result.experiment.variants[variant];
  const std::string& name = asked.problem.measured[channel].output;
  const auto& description = asked.problem.model->description();
  std::string unit;
  if (auto column = description.FindOutput(name)) unit = description.outputs[*column].unit;
  const Samples& samples = result.variants[variant].samples;
  const ReferenceResponse& response = result.variants[variant].response;
  LinePanel panel;
  panel.title = absl::StrCat(name, ", ", samples.rows(), samples.rows() == 1 ? " time" : " times");
  panel.x_label = "t (s)";
  panel.y_label = absl::StrCat(name, " (", unit, ")");
  panel.series.push_back({"without noise", kResponseColor, LineStyle::kSolid, response.time_s,
                          ToStdVector(response.value.col(channel))});
  panel.series.push_back({"measured", kSampleColor, LineStyle::kMarkers, samples.time_s,
                          samples.columns[channel].value});
  return panel;
}

LinePanel CostPanel(const ExperimentResult& result, const VariantResult& variant) {
  const std::vector<double> xi = ToStdVector(GermAxis(variant.cost, result.prior, 0));
  const double estimate = variant.map_germ(0), std_dev = variant.std_dev_germ(0);
  LinePanel panel;
  panel.title = variant.name;
  panel.x_label = absl::StrCat("ξ (", variant.cost.parameters[0], ")");
  panel.y_label = "J";
  panel.bands.push_back(
      {"estimate ± stdDev", kEstimateColor, estimate - std_dev, estimate + std_dev});
  panel.vertical_lines.push_back({"true value", kReferenceColor, result.reference_germ(0)});
  panel.series.push_back(
      {"prior", kPriorColor, LineStyle::kDotted, xi, ToStdVector(variant.cost.prior.col(0))});
  panel.series.push_back({"mismatch", kMismatchColor, LineStyle::kDashed, xi,
                          ToStdVector(variant.cost.mismatch.col(0))});
  panel.series.push_back(
      {"total", kTotalColor, LineStyle::kSolid, xi, ToStdVector(variant.cost.total.col(0))});
  panel.series.push_back(
      {"estimate", kEstimateColor, LineStyle::kMarkers, {estimate}, {variant.estimate.cost.total}});
  return panel;
}

ContourPanel ContoursOf(const ExperimentResult& result, const VariantResult& variant,
                        std::string title, const Matrix& value) {
  ContourPanel panel;
  panel.title = std::move(title);
  panel.x_label = absl::StrCat("ξ₁ (", variant.cost.parameters[0], ")");
  panel.y_label = absl::StrCat("ξ₂ (", variant.cost.parameters[1], ")");
  panel.x = GermAxis(variant.cost, result.prior, 0);
  panel.y = GermAxis(variant.cost, result.prior, 1);
  panel.value = value;
  panel.levels = BowlLevels(value, kContourLevels);
  panel.points.push_back(
      {"true value", kReferenceColor, result.reference_germ(0), result.reference_germ(1)});
  panel.points.push_back({"estimate", kEstimateColor, variant.map_germ(0), variant.map_germ(1)});
  return panel;
}

void AddCurves(const ExperimentResult& result, Plot& plot) {
  const auto& asked = result.experiment.variants;
  for (size_t v = 0; v < asked.size(); ++v) {
    // Variants with the same outputs and times differ in noise only: one panel is enough.
    const bool shown = v > 0 && asked[v].sample_times_s == asked[0].sample_times_s &&
                       asked[v].problem.measured.size() == asked[0].problem.measured.size();
    const int channels = static_cast<int>(asked[v].problem.measured.size());
    for (int c = 0; c < channels && !shown; ++c) {
      plot.panels.push_back(ResponsePanel(result, static_cast<int>(v), c));
    }
  }
  for (const VariantResult& variant : result.variants) {
    plot.panels.push_back(CostPanel(result, variant));
  }
}

}  // namespace

Plot MakePlot(const ExperimentResult& result) {
  const Experiment& experiment = result.experiment;
  Plot plot;
  plot.title = Heading(experiment);
  plot.description = experiment.question;
  switch (experiment.cost_picture) {
    case CostPicture::kCurves:
      AddCurves(result, plot);
      break;
    case CostPicture::kContours:
      for (const VariantResult& variant : result.variants) {
        plot.panels.push_back(ContoursOf(result, variant, variant.name, variant.cost.total));
      }
      break;
    case CostPicture::kContourParts: {
      const VariantResult& first = result.variants.front();
      plot.panels.push_back(ContoursOf(result, first, "mismatch", first.cost.mismatch));
      plot.panels.push_back(ContoursOf(result, first, "prior", first.cost.prior));
      plot.panels.push_back(ContoursOf(result, first, "total", first.cost.total));
      break;
    }
    case CostPicture::kResponsesAndContours: {
      const VariantResult& first = result.variants.front();
      const int channels = static_cast<int>(experiment.variants.front().problem.measured.size());
      for (int c = 0; c < channels; ++c) plot.panels.push_back(ResponsePanel(result, 0, c));
      plot.panels.push_back(ContoursOf(result, first, "mismatch", first.cost.mismatch));
      plot.panels.push_back(ContoursOf(result, first, "total", first.cost.total));
      break;
    }
  }
  plot.columns = plot.panels.size() % 3 == 0 ? 3 : 2;
  return plot;
}

}  // namespace polyest::internal
