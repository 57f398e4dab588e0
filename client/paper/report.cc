#include "client/paper/report.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>

#include "client/plot/svg_writer.h"

namespace polyest::internal {
namespace {

constexpr size_t kLineWidth = 100;

const char* NameOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kIdentified:
      return "IDENTIFIED";
    case Verdict::kWeak:
      return "WEAK";
    case Verdict::kNotIdentified:
      return "NOT_IDENTIFIED";
  }
  return "";
}

// Returns "value ± deviation" with two significant digits of the deviation, but at least
// `min_decimals` and at most 9 decimals.
std::string WithDeviation(double value, double deviation, int min_decimals) {
  const int leading = deviation > 0 ? static_cast<int>(std::floor(std::log10(deviation))) : -6;
  const int decimals = std::clamp(1 - leading, min_decimals, 9);
  if (std::abs(value) < 0.5 * std::pow(10.0, -decimals)) value = 0;  // no "-0.00"
  return absl::StrFormat("%.*f ± %.*f", decimals, value, decimals, deviation);
}

using Row = std::vector<std::string>;

void PrintTable(const std::vector<Row>& rows, std::ostream& out) {
  std::vector<size_t> widths(rows.front().size(), 0);
  for (const Row& row : rows) {
    for (size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], VisibleLength(row[c]));
  }
  for (const Row& row : rows) {
    std::string line = " ";
    for (size_t c = 0; c < row.size(); ++c) {
      absl::StrAppend(&line, " ", row[c]);
      if (c + 1 < row.size()) line.append(widths[c] - VisibleLength(row[c]) + 1, ' ');
    }
    out << line << "\n";
  }
}

std::vector<std::string> Words(const std::string& text) {
  return absl::StrSplit(text, ' ', absl::SkipEmpty());
}

// Prints text in lines of at most kLineWidth columns. The first follows `head`, the others are
// indented by its width.
void PrintWrapped(const std::string& head, const std::string& text, std::ostream& out) {
  std::string line = head;
  size_t length = VisibleLength(head);
  const size_t indent = length;
  for (const std::string& word : Words(text)) {
    if (length > indent && length + VisibleLength(word) > kLineWidth) {
      out << line << "\n";
      line.assign(indent, ' ');
      length = indent;
    }
    const bool first = length == indent;
    absl::StrAppend(&line, first ? "" : " ", word);
    length += VisibleLength(word) + (first ? 0 : 1);
  }
  out << line << "\n";
}

std::string TimesText(const std::vector<double>& times_s) {
  if (times_s.size() <= 10) return absl::StrJoin(times_s, ", ");
  return absl::StrFormat("%d times from %.4g to %.4g", times_s.size(), times_s.front(),
                         times_s.back());
}

std::vector<Row> EstimateTable(const ExperimentResult& result) {
  std::vector<Row> rows = {
      {"variant", "unknown", "true", "map ± stdDev", "ξ̂ ± stdDev", "off by", "verdict"}};
  for (const VariantResult& variant : result.variants) {
    for (size_t i = 0; i < variant.estimate.parameters.size(); ++i) {
      const ParameterEstimate& p = variant.estimate.parameters[i];
      const double truth = result.experiment.reference(static_cast<Eigen::Index>(i));
      const auto index = static_cast<Eigen::Index>(i);
      rows.push_back({i == 0 ? variant.name : "", p.name, absl::StrFormat("%.6g", truth),
                      absl::StrCat(WithDeviation(p.map, p.std_dev, 0), " ", p.unit),
                      WithDeviation(variant.map_germ(index), variant.std_dev_germ(index), 4),
                      absl::StrFormat("%.2f stdDev", std::abs(p.map - truth) / p.std_dev),
                      NameOf(p.verdict)});
    }
  }
  return rows;
}

std::string DirectionText(const Direction& direction, const Estimate& estimate) {
  std::vector<std::string> terms;
  for (size_t i = 0; i < estimate.parameters.size(); ++i) {
    terms.push_back(absl::StrFormat("%+.3f %s",
                                    direction.coefficients(static_cast<Eigen::Index>(i)),
                                    estimate.parameters[i].name));
  }
  return absl::StrFormat("direction %s: information %.3g, %s", absl::StrJoin(terms, " "),
                         direction.information, NameOf(direction.verdict));
}

void PrintRemarks(const VariantResult& variant, const std::vector<double>& times_s,
                  std::ostream& out) {
  const Estimate& estimate = variant.estimate;
  out << "  " << variant.name << "\n";
  PrintWrapped("    ", absl::StrCat("measured at ", TimesText(times_s), " s"), out);
  PrintWrapped("    ",
               absl::StrFormat("J_mismatch %.4g, J_apriori %.4g, α² %.3g; %d terms, %d points, "
                               "residualToNoise %.2g",
                               estimate.cost.mismatch, estimate.cost.prior, estimate.regularization,
                               estimate.expansion.terms, estimate.expansion.points,
                               estimate.expansion.residual_to_noise),
               out);
  if (estimate.parameters.size() > 1) {
    for (const Direction& direction : estimate.directions) {
      PrintWrapped("    ", DirectionText(direction, estimate), out);
    }
  }
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    PrintWrapped(absl::StrCat("    ", NameOf(diagnostic.code), ": "), diagnostic.message, out);
  }
}

}  // namespace

void PrintExperiment(const ExperimentResult& result, std::ostream& out) {
  const Experiment& experiment = result.experiment;
  out << Heading(experiment) << "\n";
  PrintWrapped("  Asked:     ", experiment.question, out);
  PrintWrapped(experiment.from_paper ? "  The paper: " : "  Expected:  ", experiment.says, out);
  out << "\n";
  PrintTable(EstimateTable(result), out);
  out << "\n";
  for (size_t v = 0; v < result.variants.size(); ++v) {
    PrintRemarks(result.variants[v], experiment.variants[v].sample_times_s, out);
  }
}

}  // namespace polyest::internal
