#include "client/cli/estimate_format.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>

#include "client/cli/number_format.h"
#include "client/cli/screen.h"
#include "client/cli/text_table.h"
#include "proto/wire/check/numbers.h"

namespace polyest::internal {
namespace {

std::string DiagnosticText(v1::Diagnostic::Code code) {
  switch (code) {
    case v1::Diagnostic::NOT_IDENTIFIED:
      return "not identified";
    case v1::Diagnostic::UNDERSAMPLED:
      return "undersampled";
    case v1::Diagnostic::EXPANSION_INACCURATE:
      return "expansion inaccurate";
    case v1::Diagnostic::MODEL_MISFIT:
      return "model misfit";
    case v1::Diagnostic::AT_PRIOR_BOUND:
      return "at a bound of the prior";
    case v1::Diagnostic::MULTIPLE_MINIMA:
      return "several minima";
    case v1::Diagnostic::NOT_CONVERGED:
      return "not converged";
    case v1::Diagnostic::POINTS_FAILED:
      return "trajectories failed";
    case v1::Diagnostic::NON_GAUSSIAN:
      return "not Gaussian";
    case v1::Diagnostic::CORRELATED_RESIDUALS:
      return "correlated residuals";
    case v1::Diagnostic::NOISE_NOT_LEARNED:
      return "noise not learned";
    case v1::Diagnostic::REGULARIZATION_NOT_DETERMINED:
      return "regularization not determined";
    case v1::Diagnostic::SUSPICIOUS_DATA:
      return "suspicious data";
    case v1::Diagnostic::INCONSISTENT_OVER_TIME:
      return "inconsistent over time";
    case v1::Diagnostic::REPLAY_POSTPONED:
      return "replay postponed";
    case v1::Diagnostic::WINDOWS_DISAGREE:
      return "windows disagree";
    case v1::Diagnostic::PRIOR_DATA_CONFLICT:
      return "prior and data in conflict";
    case v1::Diagnostic::FIXED_VALUE_CONFLICT:
      return "fixed value in conflict";
    default:
      return absl::StrCat("diagnostic ", static_cast<int>(code));
  }
}

void PrintParameters(const v1::Estimate& estimate, std::ostream& out) {
  TextTable table(
      {"parameter", "estimate ± sd", "unit", "95 % interval", "prior", "sd/prior", "verdict"});
  for (const v1::ParameterEstimate& p : estimate.parameters()) {
    const double std_dev = ShownOf(p).std_dev;
    table.AddRow({p.name(), EstimateText(p), UnitText(p.unit()),
                  FormatInterval(p.lower95(), p.upper95(), std_dev),
                  FormatUncertain(p.prior_mean(), p.prior_std_dev()),
                  FormatNumber(std_dev / p.prior_std_dev(), 2),
                  PaintVerdict(out, p.verdict(), VerdictText(p.verdict()))});
  }
  table.Print(out);
}

// Prints how far α² ≠ 1 has moved the estimates.
void PrintBias(const v1::Estimate& estimate, std::ostream& out) {
  if (estimate.regularization() == 1) return;
  TextTable table({"parameter", "bias", "unit", "bias/sd"});
  for (const v1::ParameterEstimate& p : estimate.parameters()) {
    table.AddRow({p.name(), FormatNumber(p.bias(), 3), UnitText(p.unit()),
                  FormatNumber(p.bias() / p.std_dev(), 2)});
  }
  out << "\nmoved by α² = " << FormatNumber(estimate.regularization(), 3)
      << " from the estimate with α² = 1\n";
  table.Print(out);
}

// Prints the states and the parameters that drift as the last sample left them.
void PrintFiltered(const v1::Estimate& estimate, std::ostream& out) {
  if (estimate.filtered().empty()) return;
  TextTable table({"now", "mean", "sd", "unit", "95 % interval"});
  for (const v1::FilteredQuantity& one : estimate.filtered()) {
    table.AddRow({one.name(), FormatNumber(one.mean()), FormatNumber(one.std_dev(), 3),
                  UnitText(one.unit()),
                  absl::StrCat(FormatNumber(one.lower95()), " … ", FormatNumber(one.upper95()))});
  }
  out << absl::StrFormat("\nat t = %.6g s, by the filters\n", estimate.time());
  table.Print(out);
}

// Prints what windows of the record say on their own, one row for each window.
void PrintWindows(const v1::Estimate& estimate, std::ostream& out) {
  if (estimate.windows().empty()) return;
  const bool runs = estimate.windows().rbegin()->last_run() > 0;
  std::vector<std::string> header = {"window"};
  for (const v1::ParameterEstimate& p : estimate.parameters()) header.push_back(p.name());
  TextTable table(header);
  for (const v1::WindowEstimate& window : estimate.windows()) {
    const std::string first = runs ? absl::StrFormat("run %d, ", window.first_run()) : "";
    const std::string last = window.last_run() != window.first_run()
                                 ? absl::StrFormat("run %d, ", window.last_run())
                                 : "";
    std::vector<std::string> row = {absl::StrFormat(
        "%s%.6g … %s%.6g s", first, window.start_time_s(), last, window.end_time_s())};
    for (const v1::ParameterEstimate& p : estimate.parameters()) {
      row.emplace_back("-");
      for (const v1::WindowEstimate::Value& v : window.values()) {
        if (v.parameter() == p.name()) row.back() = FormatUncertain(v.value(), v.std_dev());
      }
    }
    table.AddRow(row);
  }
  out << absl::StrFormat("\nwhat windows of the record say on their own (disagreement %.2g)\n",
                         estimate.disagreement());
  table.Print(out);
}

// Prints each component of a posterior that is a mixture. The tables above it describe the
// component of largest weight or all components together.
void PrintComponents(const v1::Estimate& estimate, std::ostream& out) {
  if (estimate.components().empty()) return;
  TextTable table({"piece", "weight", "parameter", "estimate", "sd", "unit", "mean"});
  int piece = 0;
  for (const v1::MixtureComponent& component : estimate.components()) {
    const std::string weight = absl::StrCat(FormatNumber(100 * component.weight(), 3), " %");
    ++piece;
    bool first = true;
    for (const v1::ParameterEstimate& p : component.parameters()) {
      table.AddRow({first ? absl::StrCat(piece) : "", first ? weight : "", p.name(),
                    FormatNumber(p.map()), FormatNumber(p.std_dev(), 3), UnitText(p.unit()),
                    FormatNumber(p.mean())});
      first = false;
    }
  }
  out << "\nthe posterior is in several pieces\n";
  table.Print(out);
}

void PrintChannels(const v1::Estimate& estimate, std::ostream& out) {
  if (estimate.channels().empty()) return;
  TextTable table({"channel", "samples", "χ²", "χ²/samples", "noise sd", "lag-1", "effective"});
  for (const v1::ChannelEstimate& c : estimate.channels()) {
    const bool any = c.samples() > 0;
    table.AddRow({c.output(), absl::StrCat(c.samples()), any ? FormatNumber(c.chi_squared()) : "-",
                  any ? FormatNumber(c.chi_squared() / static_cast<double>(c.samples()), 3) : "-",
                  any ? FormatNumber(c.noise_std_dev(), 3) : "-",
                  any ? FormatNumber(c.lag1_correlation(), 2) : "-",
                  any ? absl::StrFormat("%.0f", c.effective_samples()) : "-"});
  }
  out << '\n';
  table.Print(out);
  for (const v1::ChannelEstimate& c : estimate.channels()) {
    if (c.noise_time_constant_s() > 0) {
      out << absl::StrCat(c.output(), ": noise correlated over ",
                          FormatNumber(c.noise_time_constant_s(), 3), " s");
      if (c.noise_white_share() > 0) {
        out << absl::StrCat(", but for the ", FormatNumber(100 * c.noise_white_share(), 3),
                            " % of its variance that is white");
      }
      out << '\n';
    }
    if (c.outliers() > 0) out << absl::StrCat(c.output(), ": ", c.outliers(), " outliers\n");
  }
}

void PrintDirections(const v1::Estimate& estimate, std::ostream& out) {
  if (estimate.directions().empty()) return;
  TextTable table({"direction (in prior sd)", "data/prior information", "verdict"});
  for (const v1::Direction& d : estimate.directions()) {
    table.AddRow({DirectionText(d), FormatNumber(d.information(), 2),
                  PaintVerdict(out, d.verdict(), VerdictText(d.verdict()))});
  }
  out << '\n';
  table.Print(out);
  PrintTradeOffs(estimate, out);
}

void PrintSummary(const v1::Estimate& estimate, std::ostream& out) {
  const v1::Cost& cost = estimate.cost();
  out << absl::StrFormat("\ncost: %.4g = %.4g mismatch + %.4g × %.4g prior\n", cost.total(),
                         cost.mismatch(), estimate.regularization(), cost.prior());
  const v1::ExpansionSummary& e = estimate.expansion();
  std::string expansion = absl::StrFormat(
      "expansion: order %d, %d terms, %d points, %s, %d trajectories; differs from the model by "
      "%.2g of the noise",
      e.order(), e.terms(), e.points(), Counted(e.reexpansions(), "re-expansion"), e.trajectories(),
      e.residual_to_noise());
  if (e.has_pareto_shape()) {
    absl::StrAppendFormat(&expansion, "; Pareto shape of the model's weights %.2f",
                          e.pareto_shape());
  }
  PrintSentence(out, expansion);
}

}  // namespace

ShownEstimate ShownOf(const v1::ParameterEstimate& p) {
  // Where the data say less than the prior, the most probable value may be any that it allows.
  const bool unknown = p.verdict() == v1::Identifiability::NOT_IDENTIFIED;
  const bool wider = p.posterior_std_dev() >= 2 * p.std_dev();
  if (p.posterior_std_dev() > 0 && (unknown || wider)) return {p.mean(), p.posterior_std_dev()};
  return {p.map(), p.std_dev()};
}

std::string EstimateText(const v1::ParameterEstimate& p) {
  const ShownEstimate shown = ShownOf(p);
  return FormatUncertain(shown.value, shown.std_dev);
}

std::string VerdictText(v1::Identifiability::Verdict verdict) {
  switch (verdict) {
    case v1::Identifiability::IDENTIFIED:
      return "identified";
    case v1::Identifiability::WEAK:
      return "weak";
    case v1::Identifiability::NOT_IDENTIFIED:
      return "not identified";
    default:
      return "-";
  }
}

std::string PaintVerdict(std::ostream& out, v1::Identifiability::Verdict verdict,
                         absl::string_view text) {
  switch (verdict) {
    case v1::Identifiability::IDENTIFIED:
      return Paint(out, Color::kGreen, text);
    case v1::Identifiability::WEAK:
      return Paint(out, Color::kYellow, text);
    case v1::Identifiability::NOT_IDENTIFIED:
      return Paint(out, Color::kRed, text);
    default:
      return std::string(text);
  }
}

std::string DirectionText(const v1::Direction& direction) {
  constexpr double kTooSmall = 0.05;
  std::string text;
  for (const v1::Direction::Coefficient& coefficient : direction.coefficients()) {
    const double value = coefficient.value();
    if (std::abs(value) < kTooSmall) continue;
    const bool negative = value < 0;
    absl::StrAppend(&text, text.empty() ? (negative ? "−" : "") : (negative ? " − " : " + "),
                    absl::StrFormat("%.2f ", std::abs(value)), coefficient.parameter());
  }
  return text;
}

void PrintDiagnostics(const google::protobuf::RepeatedPtrField<v1::Diagnostic>& diagnostics,
                      std::ostream& out) {
  if (!diagnostics.empty()) out << '\n';
  for (const v1::Diagnostic& diagnostic : diagnostics) {
    PrintSentence(out, absl::StrCat(Paint(out, Color::kYellow, "note:"), " ",
                                    DiagnosticText(diagnostic.code()), ": ", diagnostic.message()));
  }
}

void PrintEstimate(const v1::Estimate& estimate, std::ostream& out) {
  out << absl::StrFormat("%d samples up to t = %.6g s\n\n", estimate.samples(), estimate.time());
  PrintParameters(estimate, out);
  PrintBias(estimate, out);
  PrintComponents(estimate, out);
  PrintFiltered(estimate, out);
  PrintWindows(estimate, out);
  PrintChannels(estimate, out);
  PrintDirections(estimate, out);
  PrintSummary(estimate, out);
  PrintDiagnostics(estimate.diagnostics(), out);
}

void PrintTradeOffs(const v1::Estimate& estimate, std::ostream& out) {
  for (const v1::TradeOff& t : estimate.trade_offs()) {
    PrintSentence(
        out,
        absl::StrFormat("%s is known to %.2g %%, %s and %s separately only to %.2g %% and %.2g %%",
                        t.combination(), 100 * t.relative_std_dev(), t.first(), t.second(),
                        100 * t.first_alone(), 100 * t.second_alone()));
  }
}

std::string EstimateLine(const v1::Estimate& estimate) {
  std::string line = absl::StrFormat("t = %.6g s", estimate.time());
  for (const v1::ParameterEstimate& p : estimate.parameters()) {
    const std::string unit = UnitText(p.unit());
    absl::StrAppend(&line, "  ", p.name(), " = ", EstimateText(p), unit.empty() ? "" : " ", unit);
  }
  return line;
}

}  // namespace polyest::internal
