#include "client/cli/study_plots.h"

#include <absl/strings/str_cat.h>

#include <string>
#include <utility>
#include <vector>

#include "client/cli/number_format.h"
#include "client/plot/colors.h"

namespace polyest::internal {
namespace {

using Sensitivity = v1::ComputeSensitivityResponse;
using Design = v1::ComputeExperimentDesignResponse;

// A rise of ½ above the least cost is one standard deviation of a Gaussian, a rise of 2 is two.
constexpr double kOneDeviation = 0.5, kTwoDeviations = 2;
constexpr double kHighestRise = 8;

LinePanel ProfilePanel(const v1::ComputeCostProfilesResponse& profiles,
                       const v1::ComputeCostProfilesResponse::Profile& profile) {
  LinePanel panel;
  panel.title = profile.parameter();
  panel.x_label = NameWithUnit(profile.parameter(), profile.unit());
  panel.y_label = "cost above its least";
  LineSeries total{"cost", kBlue, LineStyle::kSolid, {}, {}};
  for (int k = 0; k < profile.value_size(); ++k) {
    total.x.push_back(profile.value(k));
    total.y.push_back(profile.total(k) - profiles.least().total());
  }
  panel.series = {std::move(total)};
  panel.horizontal_lines = {{"one and two standard deviations", kGray, kOneDeviation},
                            {"", kGray, kTwoDeviations}};
  panel.y_range = std::pair{-0.2, kHighestRise};
  return panel;
}

LinePanel SpreadPanel(const Sensitivity& analysis, const Sensitivity::Output& output) {
  LinePanel panel;
  panel.title = output.name();
  panel.x_label = "t (s)";
  panel.y_label = NameWithUnit(output.name(), output.unit());
  BandSeries band{"± standard deviation", kBlue, {}, {}, {}};
  LineSeries mean{"mean", kBlue, LineStyle::kSolid, {}, {}};
  for (int k = 0; k < analysis.time_s_size(); ++k) {
    band.x.push_back(analysis.time_s(k));
    band.lower.push_back(output.mean(k) - output.std_dev(k));
    band.upper.push_back(output.mean(k) + output.std_dev(k));
    mean.x.push_back(analysis.time_s(k));
    mean.y.push_back(output.mean(k));
  }
  panel.areas = {std::move(band)};
  panel.series = {std::move(mean)};
  return panel;
}

LinePanel SharePanel(const Sensitivity& analysis, const Sensitivity::Output& output) {
  LinePanel panel;
  panel.title = "share of the variance";
  panel.x_label = "t (s)";
  panel.y_label = absl::StrCat("share of the variance of ", output.name());
  const int n = analysis.parameters_size();
  for (int i = 0; i < n; ++i) {
    LineSeries series{
        analysis.parameters(i), ColorOfLine(static_cast<size_t>(i)), LineStyle::kSolid, {}, {}};
    for (int k = 0; k < analysis.time_s_size(); ++k) {
      series.x.push_back(analysis.time_s(k));
      series.y.push_back(output.total(k * n + i));
    }
    panel.series.push_back(std::move(series));
  }
  panel.y_range = std::pair{-0.03, 1.03};
  return panel;
}

std::string NameOf(const Design::Candidate& candidate) {
  return candidate.name().empty() ? "the problem's inputs" : candidate.name();
}

LinePanel GainPanel(const Design& design) {
  LinePanel panel;
  panel.title = "best sample times";
  panel.x_label = "t (s)";
  panel.y_label = "gain with all earlier choices (bits)";
  for (int c = 0; c < design.candidates_size(); ++c) {
    const Design::Candidate& candidate = design.candidates(c);
    LineSeries series{
        NameOf(candidate), ColorOfLine(static_cast<size_t>(c)), LineStyle::kMarkers, {}, {}};
    for (const Design::SampleTime& sample : candidate.samples()) {
      series.x.push_back(sample.time_s());
      series.y.push_back(sample.gain().bits());
    }
    panel.series.push_back(std::move(series));
  }
  return panel;
}

// Returns the expected standard deviation of a parameter over the number of samples chosen.
LinePanel DeviationPanel(const Design& design, int i) {
  const Design::Parameter& parameter = design.parameters(i);
  LinePanel panel;
  panel.title = parameter.name();
  panel.x_label = "samples chosen";
  panel.y_label =
      NameWithUnit(absl::StrCat("standard deviation of ", parameter.name()), parameter.unit());
  for (int c = 0; c < design.candidates_size(); ++c) {
    const Design::Candidate& candidate = design.candidates(c);
    LineSeries series{NameOf(candidate),
                      ColorOfLine(static_cast<size_t>(c)),
                      LineStyle::kSolid,
                      {0},
                      {parameter.std_dev()}};
    for (const Design::SampleTime& sample : candidate.samples()) {
      series.x.push_back(static_cast<double>(series.x.size()));
      series.y.push_back(sample.gain().std_dev(i));
    }
    panel.series.push_back(std::move(series));
  }
  return panel;
}

}  // namespace

Plot MakePlot(const v1::ComputeCostProfilesResponse& profiles) {
  Plot plot;
  plot.title = "Cost over each parameter, least over all others";
  plot.description = plot.title;
  for (const auto& profile : profiles.profiles()) {
    plot.panels.emplace_back(ProfilePanel(profiles, profile));
  }
  return plot;
}

Plot MakePlot(const Sensitivity& analysis) {
  Plot plot;
  plot.title = "Sensitivity";
  plot.description =
      "Each output's mean and spread over time, and the share of its variance that involves each "
      "parameter";
  for (const Sensitivity::Output& output : analysis.outputs()) {
    plot.panels.emplace_back(SpreadPanel(analysis, output));
    plot.panels.emplace_back(SharePanel(analysis, output));
  }
  return plot;
}

Plot MakePlot(const Design& design) {
  Plot plot;
  plot.title = "What a next experiment would tell";
  plot.description =
      "The expected gain of the best sample times, and the standard deviation of each parameter "
      "over their number";
  plot.panels.emplace_back(GainPanel(design));
  for (int i = 0; i < design.parameters_size(); ++i) {
    plot.panels.emplace_back(DeviationPanel(design, i));
  }
  return plot;
}

}  // namespace polyest::internal
