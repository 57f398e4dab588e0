#include "client/cli/report_page.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>

#include <sstream>
#include <utility>
#include <vector>

#include "client/cli/estimate_format.h"
#include "client/cli/fit_plot.h"
#include "client/cli/history_plot.h"
#include "client/cli/number_format.h"
#include "client/cli/study_plots.h"
#include "client/plot/svg_plot.h"
#include "client/plot/svg_writer.h"
#include "proto/wire/json/json_format.h"

namespace polyest::internal {
namespace {

constexpr char kStyle[] = R"(
body { font: 16px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #222;
       background: #fff; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin-bottom: 0; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
.about { color: #555; margin-top: .2rem; }
table { border-collapse: collapse; width: 100%; }
th { text-align: left; border-bottom: 2px solid #888; padding: .3rem .8rem .3rem 0; }
td { border-bottom: 1px solid #ddd; padding: .3rem .8rem .3rem 0; vertical-align: top; }
.verdict { font-weight: 600; white-space: nowrap; }
.IDENTIFIED { color: #116b3a; } .WEAK { color: #8a5a00; } .NOT_IDENTIFIED { color: #a11212; }
.warning { border-left: 4px solid #d95f02; padding: .2rem .8rem; margin: .5rem 0; background: #fff6ee; }
.well { border-left: 4px solid #1b9e77; padding: .2rem .8rem; background: #f0faf6; }
img { max-width: 100%; height: auto; }
pre { background: #f6f6f6; padding: .8rem; overflow-x: auto; font-size: .85rem; }
@media print { details { display: none; } h2 { break-after: avoid; } img { break-inside: avoid; } }
)";

// Returns a table with texts that are not markup yet. `classes`: of the last column's cells.
std::string Table(const std::vector<std::string>& header,
                  const std::vector<std::vector<std::string>>& rows,
                  const std::vector<std::string>& classes = {}) {
  std::string html = "<table><thead><tr>";
  for (const std::string& cell : header) absl::StrAppend(&html, "<th>", EscapeXml(cell), "</th>");
  html += "</tr></thead><tbody>\n";
  for (size_t i = 0; i < rows.size(); ++i) {
    html += "<tr>";
    for (size_t j = 0; j < rows[i].size(); ++j) {
      const bool marked = !classes.empty() && j + 1 == rows[i].size();
      absl::StrAppend(&html, "<td",
                      marked ? absl::StrCat(" class=\"verdict ", classes[i], "\"") : "", ">",
                      EscapeXml(rows[i][j]), "</td>");
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table>\n";
}

// An image element, rather than the plot's own elements: the names inside of several plots would
// collide.
std::string Image(const Plot& plot) {
  return absl::StrCat("<img alt=\"", EscapeXml(plot.description),
                      "\" src=\"data:image/svg+xml;base64,", absl::Base64Escape(RenderSvg(plot)),
                      "\">\n");
}

std::string Parameters(const v1::Estimate& estimate) {
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> classes;
  for (const v1::ParameterEstimate& p : estimate.parameters()) {
    rows.push_back({p.name(), EstimateText(p), UnitText(p.unit()),
                    FormatInterval(p.lower95(), p.upper95(), ShownOf(p).std_dev),
                    FormatUncertain(p.prior_mean(), p.prior_std_dev()), VerdictText(p.verdict())});
    classes.push_back(v1::Identifiability::Verdict_Name(p.verdict()));
  }
  return Table({"parameter", "estimate ± standard deviation", "unit", "95 % interval",
                "before the test", "verdict"},
               rows, classes);
}

// Returns the lines that `print` prints, each as a paragraph.
template <typename Print>
std::string Paragraphs(const Print& print, const char* style) {
  std::ostringstream text;
  print(text);
  std::string html;
  for (const absl::string_view line : absl::StrSplit(text.str(), '\n', absl::SkipWhitespace())) {
    absl::StrAppend(&html, "<p class=\"", style, "\">", EscapeXml(std::string(line)), "</p>\n");
  }
  return html;
}

std::string Warnings(const v1::Estimate& estimate) {
  const std::string trade_offs =
      Paragraphs([&](std::ostream& out) { PrintTradeOffs(estimate, out); }, "warning");
  const std::string diagnostics = Paragraphs(
      [&](std::ostream& out) { PrintDiagnostics(estimate.diagnostics(), out); }, "warning");
  if (!trade_offs.empty() || !diagnostics.empty()) return trade_offs + diagnostics;
  return "<p class=\"well\">No warnings: residuals, noise, expansion and windows of the record "
         "agree.</p>\n";
}

std::string Scores(const v1::PredictResponse& prediction) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& output : prediction.outputs()) {
    if (!output.has_score()) continue;
    const auto& score = output.score();
    if (score.sample_count() == 0) {
      rows.push_back({output.output(), UnitText(output.unit()), "0", "-", "-", "-"});
      continue;
    }
    rows.push_back({output.output(), UnitText(output.unit()), absl::StrCat(score.sample_count()),
                    FormatNumber(score.root_mean_square()), FormatPercent(score.coverage95()),
                    FormatNumber(score.log_score())});
  }
  return Table({"output", "unit", "samples", "root mean square residual",
                "samples within the 95 % band", "log score"},
               rows);
}

std::string Channels(const v1::Estimate& estimate) {
  std::vector<std::vector<std::string>> rows;
  for (const v1::ChannelEstimate& c : estimate.channels()) {
    if (c.samples() == 0) {
      rows.push_back({c.output(), "0", "-", "-", "-", "-", "-"});
      continue;
    }
    rows.push_back({c.output(), absl::StrCat(c.samples()), FormatNumber(c.noise_std_dev()),
                    FormatNumber(c.chi_squared()), FormatNumber(c.lag1_correlation(), 2),
                    FormatNumber(c.effective_samples(), 3), absl::StrCat(c.outliers())});
  }
  return Table({"output", "samples", "noise (standard deviation)", "χ²",
                "correlation of successive residuals", "effective samples", "outliers"},
               rows);
}

std::string Computation(const ReportContent& content) {
  const v1::ExpansionSummary& e = content.estimate.expansion();
  return absl::StrFormat(
      "<p>Polynomial chaos expansion of order %d with %d terms on %d collocation points, expanded "
      "again %d times; %d trajectories of the model in all. Expansion and model differ by %s of "
      "the noise. Weight of the prior α² = %s. Cost %s: mismatch %s, prior %s. The bands are "
      "those of %d trajectories of the model at draws of the posterior. polyest %s.</p>\n",
      e.order(), e.terms(), e.points(), e.reexpansions(), e.trajectories(),
      FormatNumber(e.residual_to_noise(), 2), FormatNumber(content.estimate.regularization()),
      FormatNumber(content.estimate.cost().total()),
      FormatNumber(content.estimate.cost().mismatch()),
      FormatNumber(content.estimate.cost().prior()), content.prediction.draw_count(),
      EscapeXml(content.version));
}

}  // namespace

std::string ReportPage(const ReportContent& content) {
  std::string html = absl::StrCat(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>",
      EscapeXml(content.subject), "</title>\n<style>", kStyle, "</style></head>\n<body>\n<h1>",
      "Parameter estimate</h1>\n<p class=\"about\">", EscapeXml(content.subject), " · ",
      EscapeXml(content.date), " · ", content.estimate.samples(),
      " measured values up to t = ", FormatNumber(content.estimate.time(), 6), " s</p>\n");
  const auto add = [&](const char* title, const std::string& body) {
    absl::StrAppend(&html, "<h2>", title, "</h2>\n", body);
  };
  add("Parameters", Parameters(content.estimate));
  add("Warnings", Warnings(content.estimate));
  add("Model and measurements", Image(MakePlot(content.prediction)) + Scores(content.prediction));
  if (content.drift.outputs_size() > 0) {
    add("Parameters that drift",
        absl::StrCat("<p>Their values over time, as all samples of the run tell them.</p>\n",
                     Image(MakePlot(content.drift))));
  }
  if (content.history.points_size() > 1) {
    add("How the estimate came about", Image(MakePlot(content.history)));
  }
  add("Posterior", Image(MakePlot(content.posterior)));
  add("Measured outputs", Channels(content.estimate));
  add("How it was computed", Computation(content));
  add("Problem", absl::StrCat("<details><summary>The problem file</summary><pre>",
                              EscapeXml(ToJson(content.problem, /*several_lines=*/true)),
                              "</pre></details>\n"));
  return html + "</body>\n</html>\n";
}

}  // namespace polyest::internal
