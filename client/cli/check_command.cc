#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/strip.h>
#include <google/protobuf/struct.pb.h>

#include <map>
#include <optional>
#include <sstream>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/data_input.h"
#include "client/cli/data_warnings.h"
#include "client/cli/exit_status.h"
#include "client/cli/input_files.h"
#include "client/cli/problem_input.h"
#include "client/cli/screen.h"
#include "client/cli/text_table.h"
#include "core/common/check.h"
#include "core/common/status.h"
#include "polyest/data_file.h"
#include "polyest/problem_file.h"
#include "proto/wire/check/problem_summary.h"
#include "proto/wire/convert/problem.h"
#include "proto/wire/convert/wire_fields.h"
#include "proto/wire/json/json_format.h"

namespace polyest::internal {
namespace {

// Number of errors of a data file that are shown; the others are only counted.
constexpr size_t kMaxLines = 20;

struct Findings {
  std::vector<std::string> errors;
  std::vector<std::string> warnings;
  int64_t unlisted = 0;  // errors that `errors` only count, less those that only count others
  std::string summary;   // empty if there are errors

  // Adds an error whose message names the file, as those of reading a file do.
  void AddError(const absl::Status& status) {
    errors.push_back(absl::StrReplaceAll(status.message(), {{"\r", ""}, {"\n", " "}}));
  }
  // Adds an error about the content of a file.
  void AddError(const absl::Status& status, const std::string& file) {
    AddError(absl::Status(status.code(), absl::StrCat(file, ": ", status.message())));
  }
};

// Collects the errors of a file's lines. An error that many lines have is shown once.
class RefusedLines {
 public:
  explicit RefusedLines(const std::string& file) : file_(file) {}

  void Add(const absl::Status& refusal) {
    const std::string sentence = Sentence(refusal);
    const auto known = places_.find(sentence);
    if (known != places_.end()) {
      ++errors_[known->second].repeated;
    } else if (errors_.size() == kMaxLines) {
      ++unlisted_;
    } else {
      places_[sentence] = errors_.size();
      errors_.push_back({refusal});
    }
  }

  void AddTo(Findings& findings) const {
    for (const Error& error : errors_) {
      findings.AddError(error.first);
      findings.unlisted += error.repeated;
      if (error.repeated == 0) continue;
      absl::StrAppend(&findings.errors.back(), " (and so in ", error.repeated,
                      error.repeated == 1 ? " further line)" : " further lines)");
    }
    if (unlisted_ == 0) return;
    findings.unlisted += unlisted_ - 1;
    findings.errors.push_back(absl::StrCat(file_, ": … and ", unlisted_, " more"));
  }

 private:
  struct Error {
    absl::Status first;
    int64_t repeated = 0;
  };

  // Returns what an error says after the file and the number of the line.
  std::string Sentence(const absl::Status& refusal) const {
    absl::string_view text = refusal.message();
    if (!absl::ConsumePrefix(&text, file_ + ":")) return std::string(text);
    while (!text.empty() && absl::ascii_isdigit(static_cast<unsigned char>(text[0]))) {
      text.remove_prefix(1);
    }
    return std::string(text);
  }

  const std::string file_;
  std::vector<Error> errors_;
  std::map<std::string, size_t> places_;  // in `errors_`
  int64_t unlisted_ = 0;
};

// Reads the rows that are valid and adds the errors of the others to the findings.
std::optional<v1::Measurements> ReadRows(const std::string& file, const DataColumns& columns,
                                         DataInFile& read, Findings& findings) {
  RefusedLines refused(file);
  const auto note = [&](const absl::Status& refusal) {
    refused.Add(refusal);
    return absl::OkStatus();
  };
  auto data = ReadData(file, columns, read, note);
  refused.AddTo(findings);
  if (!data.ok()) findings.AddError(data.status());
  if (!data.ok()) return std::nullopt;
  return *std::move(data);
}

// Prints remarks as a table. The first remark, the model, is its header. Each topic is named once.
void Print(const Remarks& remarks, std::ostream& out) {
  const auto& model = remarks.front();
  TextTable table({model.topic(), model.name(), model.description()});
  for (size_t i = 1; i < remarks.size(); ++i) {
    const bool first = remarks[i].topic() != remarks[i - 1].topic();
    table.AddRow({first ? remarks[i].topic() : "", remarks[i].name(), remarks[i].description()});
  }
  table.Print(out);
}

absl::Status CheckRecord(const ResolvedProblem& problem, const v1::Measurements& data,
                         Findings& findings, std::ostream& out) {
  POLYEST_ASSIGN_OR_RETURN(DataSummary record, SummarizeRecord(problem, data));
  out << "\ndata: " << record.rows << '\n';
  for (const std::string& channel : record.channels) out << "  " << channel << '\n';
  for (std::string& warning : record.warnings) findings.warnings.push_back(std::move(warning));
  return absl::OkStatus();
}

// Adds the summary of a problem without errors and of its data, and warnings of both.
void AddSummary(const InputFiles& files, const v1::Problem& problem, const ModelLibrary& models,
                const std::optional<v1::Measurements>& data, std::ostream& out,
                Findings& findings) {
  const auto resolved = ToProblem(problem, models);
  POLYEST_CHECK(resolved.ok());
  std::ostringstream summary;
  summary.copyfmt(out);  // for the width of its tables
  const auto remarks = SummarizeProblem(problem, *resolved);
  if (remarks.ok()) {
    Print(*remarks, summary);
  } else {
    findings.AddError(remarks.status(), files.problem);
  }
  if (problem.measured().empty()) {
    findings.warnings.emplace_back(
        "the problem has no measured outputs: it can be propagated, but its parameters cannot be "
        "estimated");
  }
  if (data) {
    const absl::Status checked = CheckRecord(*resolved, *data, findings, summary);
    if (!checked.ok()) findings.AddError(InFiles(WireFields(checked), files));
  }
  findings.summary = summary.str();
}

Findings Check(const CheckArguments& arguments, std::ostream& out) {
  Findings findings;
  const absl::Status order = CheckFilesAreNotSwapped(arguments.problem_file, arguments.data_file);
  if (!order.ok()) {
    findings.errors.emplace_back(order.message());
    return findings;
  }
  const auto problem = ReadProblemFile(arguments.problem_file);
  if (!problem.ok()) {
    findings.AddError(problem.status());
    return findings;
  }
  const auto models = OpenModels(arguments.place);
  if (!models.ok()) {
    findings.errors.emplace_back(models.status().message());
    return findings;
  }
  for (const absl::Status& refusal : CheckProblem(*problem, *models)) {
    findings.AddError(refusal, arguments.problem_file);
  }
  InputFiles files{.problem = arguments.problem_file};
  std::optional<v1::Measurements> data;
  if (!arguments.data_file.empty()) {
    data = ReadRows(arguments.data_file, DataColumnsFor(*problem, *models, arguments.data_options),
                    files.data, findings);
  }
  if (findings.errors.empty()) AddSummary(files, *problem, *models, data, out, findings);
  return findings;
}

std::string AsJson(const Findings& findings) {
  google::protobuf::Struct json;
  auto& fields = *json.mutable_fields();
  fields["ok"].set_bool_value(findings.errors.empty());
  for (const auto& [name, texts] :
       {std::pair{"errors", &findings.errors}, {"warnings", &findings.warnings}}) {
    auto& list = *fields[name].mutable_list_value();
    for (const std::string& text : *texts) list.add_values()->set_string_value(text);
  }
  return ToJson(json, /*several_lines=*/true);
}

}  // namespace

int RunCommand(const CheckArguments& arguments, std::ostream& out, std::ostream& err) {
  const Findings findings = Check(arguments, out);
  const bool ok = findings.errors.empty();
  if (arguments.format == Format::kJson) {
    out << AsJson(findings) << '\n';
  } else if (ok) {
    out << findings.summary;
    PrintWarnings(findings.warnings, out);
  }
  if (ok) return kExitOk;
  for (const std::string& error : findings.errors) {
    err << Paint(err, Color::kRed, "polyest:") << ' ' << error << '\n';
  }
  const int64_t count = std::ssize(findings.errors) + findings.unlisted;
  err << "polyest: " << count << (count == 1 ? " error" : " errors") << std::endl;
  return kExitBadInput;
}

}  // namespace polyest::internal
