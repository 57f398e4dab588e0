#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <memory>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/number_format.h"
#include "client/cli/screen.h"
#include "client/cli/text_table.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Returns the models of all pages.
absl::StatusOr<v1::ListModelsResponse> ListAll(const Place& place) {
  const std::unique_ptr<Backend> backend = MakeBackend(place);
  v1::ListModelsResponse all;
  v1::ListModelsRequest request;
  do {
    POLYEST_ASSIGN_OR_RETURN(const v1::ListModelsResponse page, backend->ListModels(request));
    all.mutable_models()->MergeFrom(page.models());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return all;
}

std::string ShortName(const v1::Model& model) {
  return std::string(absl::StripPrefix(model.name(), "models/"));
}

void PrintList(const v1::ListModelsResponse& list, std::ostream& out) {
  TextTable table({"model", "kind", "summary"});
  for (const v1::Model& model : list.models()) {
    table.AddRow({ShortName(model), model.kind(), model.summary()});
  }
  table.Print(out);
}

void PrintQuantities(const std::string& title,
                     const google::protobuf::RepeatedPtrField<v1::Model::Quantity>& quantities,
                     bool defaults, std::ostream& out) {
  if (quantities.empty()) return;
  std::vector<std::string> header = {title, "unit"};
  if (defaults) header.push_back("default");
  header.push_back("meaning");
  TextTable table(std::move(header));
  for (const auto& quantity : quantities) {
    std::vector<std::string> row = {quantity.name(), quantity.unit()};
    if (defaults) {
      row.push_back(quantity.has_default_value() ? FormatNumber(quantity.default_value(), 6) : "");
    }
    row.push_back(quantity.meaning());
    table.AddRow(std::move(row));
  }
  out << '\n';
  table.Print(out);
}

void PrintModel(const v1::Model& model, std::ostream& out) {
  PrintSentence(out, absl::StrCat(ShortName(model), ": ", model.summary()));
  out << '\n' << model.equations() << '\n';
  PrintQuantities("state", model.states(), false, out);
  PrintQuantities("parameter", model.parameters(), true, out);
  PrintQuantities("input", model.inputs(), false, out);
  PrintQuantities("output", model.outputs(), false, out);
  if (!model.source().empty()) out << "\nsource: " << model.source() << '\n';
}

}  // namespace

int RunCommand(const ModelsArguments& arguments, std::ostream& out, std::ostream& err) {
  if (arguments.name.empty()) {
    return PrintAnswer(ListAll(arguments.place), arguments, PrintList, nullptr, out, err);
  }
  v1::GetModelRequest request;
  request.set_name(absl::StrCat("models/", arguments.name));
  const auto model = MakeBackend(arguments.place)->GetModel(request);
  return PrintAnswer(model, arguments, PrintModel, nullptr, out, err);
}

}  // namespace polyest::internal
