#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/csv_field.h"
#include "client/cli/estimate_format.h"
#include "client/cli/input_files.h"
#include "client/cli/name_list.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "client/cli/study_plots.h"
#include "client/cli/text_table.h"
#include "core/common/status.h"
#include "polyest/data_file.h"

namespace polyest::internal {
namespace {

constexpr int kSketchWidth = 30;                // characters
constexpr int kPlottedBins = 3 * kSketchWidth;  // of each density

absl::StatusOr<v1::ComputePosteriorResponse> GetPosterior(const PosteriorArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(arguments.plot_file));
  v1::ComputePosteriorRequest request;
  for (const std::string& joint : arguments.joints) {
    const std::vector<std::string> names = SplitNames(joint);
    if (names.size() != 2) {
      return absl::InvalidArgumentError(
          absl::StrCat("--joint: \"", joint, "\" must be two parameters, NAME,NAME"));
    }
    auto& pair = *request.add_joints();
    pair.set_first(names[0]);
    pair.set_second(names[1]);
  }
  POLYEST_ASSIGN_OR_RETURN(const InputFiles files,
                           FillSubject(arguments, *request.mutable_subject()));
  request.mutable_probabilities()->Add(arguments.probabilities.begin(),
                                       arguments.probabilities.end());
  request.set_sample_count(arguments.samples);
  request.set_all_joints(!arguments.plot_file.empty());
  if (arguments.format == Format::kTable) {
    request.set_density_bin_count(arguments.plot_file.empty() ? kSketchWidth : kPlottedBins);
  }
  auto response = MakeBackend(arguments.place)->ComputePosterior(request);
  if (!response.ok()) return InFiles(response.status(), files);
  return Plotted(*std::move(response), MakePlot, arguments.plot_file);
}

// Draws a density as a line of bars.
std::string Sketch(const google::protobuf::RepeatedField<double>& density) {
  static constexpr std::array<const char*, 9> kBars = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  // Several bins may share a character.
  const int group = std::max(1, density.size() / kSketchWidth);
  std::vector<double> heights(static_cast<size_t>(density.size() / group), 0);
  for (size_t i = 0; i < heights.size(); ++i) {
    const auto first = density.begin() + static_cast<int>(i) * group;
    heights[i] = std::accumulate(first, first + group, 0.0);
  }
  const double highest = heights.empty() ? 0 : *std::max_element(heights.begin(), heights.end());
  std::string text;
  for (const double value : heights) {
    const double height = highest > 0 ? value / highest * (kBars.size() - 1) : 0;
    text += kBars[static_cast<size_t>(height + 0.5)];
  }
  return text;
}

// Whether there are Markov chains, which alone have an R̂.
bool HasChains(const v1::ComputePosteriorResponse& posterior) {
  return posterior.method() == v1::ComputePosteriorResponse::MARKOV_CHAINS;
}

void PrintTable(const v1::ComputePosteriorResponse& posterior, std::ostream& out) {
  const bool chains = HasChains(posterior);
  std::vector<std::string> header = {"parameter", "mean ± sd", "unit"};
  for (const double probability : posterior.probabilities()) {
    header.push_back(FormatPercent(probability));
  }
  header.insert(header.end(), {"density over the central 99.9 %", "effective samples"});
  if (chains) header.push_back("R̂");
  TextTable table(std::move(header));
  for (const auto& parameter : posterior.parameters()) {
    const double sd = parameter.std_dev();
    std::vector<std::string> row = {parameter.name(), FormatUncertain(parameter.mean(), sd),
                                    UnitText(parameter.unit())};
    for (const double quantile : parameter.quantiles()) row.push_back(FormatValue(quantile, sd));
    row.push_back(Sketch(parameter.density()));
    row.push_back(absl::StrFormat("%.0f", parameter.effective_sample_size()));
    if (chains) row.push_back(absl::StrFormat("%.3f", parameter.r_hat()));
    table.AddRow(std::move(row));
  }
  table.Print(out);
  out << absl::StrFormat(
      "\n%d measured values up to t = %.6g s; %d draws by %s\n", posterior.measured_value_count(),
      posterior.time_s(), posterior.draw_count(),
      chains ? "Markov chains" : "importance sampling from the curvature's Gaussian");
  PrintDiagnostics(posterior.diagnostics(), out);
}

void PrintSamples(const v1::ComputePosteriorResponse& posterior, std::ostream& out) {
  const int columns = posterior.parameters_size();
  for (int j = 0; j < columns; ++j) {
    out << CsvField(posterior.parameters(j).name()) << (j + 1 < columns ? ',' : '\n');
  }
  for (int i = 0; i < posterior.samples_size(); ++i) {
    out << FormatExact(posterior.samples(i)) << ((i + 1) % columns != 0 ? ',' : '\n');
  }
}

void PrintJoints(const v1::ComputePosteriorResponse& posterior, std::ostream& out) {
  out << "first,second,firstValue,secondValue,density\n";
  for (const auto& joint : posterior.joints()) {
    const int inner = joint.second_value_size();
    for (int i = 0; i < joint.density_size(); ++i) {
      out << CsvField(joint.first()) << ',' << CsvField(joint.second()) << ','
          << FormatExact(joint.first_value(i / inner)) << ','
          << FormatExact(joint.second_value(i % inner)) << ',' << FormatExact(joint.density(i))
          << '\n';
    }
  }
}

void PrintParameters(const v1::ComputePosteriorResponse& posterior, std::ostream& out) {
  out << "parameter,mean,stdDev";
  for (const double probability : posterior.probabilities()) {
    out << ",q" << FormatExact(probability);
  }
  out << ",effectiveSampleSize,rHat\n";
  for (const auto& parameter : posterior.parameters()) {
    out << CsvField(parameter.name()) << ',' << FormatExact(parameter.mean()) << ','
        << FormatExact(parameter.std_dev());
    for (const double quantile : parameter.quantiles()) out << ',' << FormatExact(quantile);
    out << ',' << FormatExact(parameter.effective_sample_size()) << ',';
    if (HasChains(posterior)) out << FormatExact(parameter.r_hat());
    out << '\n';
  }
}

}  // namespace

int RunCommand(const PosteriorArguments& arguments, std::ostream& out, std::ostream& err) {
  Printer<v1::ComputePosteriorResponse> print_csv = PrintParameters;
  if (arguments.samples > 0) {
    print_csv = PrintSamples;
  } else if (!arguments.joints.empty()) {
    print_csv = PrintJoints;
  }
  return PrintAnswer(GetPosterior(arguments), arguments, PrintTable, print_csv, out, err);
}

}  // namespace polyest::internal
