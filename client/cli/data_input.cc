#include "client/cli/data_input.h"

#include <absl/strings/str_cat.h>

#include <iostream>
#include <utility>

#include "client/cli/backend.h"
#include "core/common/status.h"
#include "proto/wire/convert/problem.h"

namespace polyest::internal {
namespace {

// Adds the units of all quantities that have one. Both a model of the core and a message have
// quantities with a name and a unit.
void AddUnits(const std::vector<Quantity>& quantities, DataColumns& columns) {
  for (const Quantity& quantity : quantities) {
    if (!quantity.unit.empty()) columns.units.emplace(quantity.name, quantity.unit);
  }
}

void AddUnits(const google::protobuf::RepeatedPtrField<v1::Model::Quantity>& quantities,
              DataColumns& columns) {
  for (const v1::Model::Quantity& quantity : quantities) {
    if (!quantity.unit().empty()) columns.units.emplace(quantity.name(), quantity.unit());
  }
}

}  // namespace

bool IsInFolder(const v1::Problem::Model& model) { return model.has_fmu() || model.has_umbridge(); }

DataColumns DataColumnsFor(const v1::Problem& problem, const ModelLibrary& models,
                           const DataFileOptions& options) {
  DataColumns columns = ColumnsOf(problem);
  columns.options = options;
  if (const auto model = FindModelOf(problem, models)) {
    AddUnits(model->description().outputs, columns);
    AddUnits(model->description().inputs, columns);
  }
  return columns;
}

absl::StatusOr<DataColumns> DataColumnsFor(const v1::Problem& problem, const Place& place,
                                           const DataFileOptions& options) {
  const v1::Problem::Model& source = problem.model();
  if (IsInFolder(source) && !place.server.empty()) {
    v1::GetModelRequest request;
    request.set_name(absl::StrCat("models/", source.has_fmu() ? source.fmu() : source.umbridge()));
    POLYEST_ASSIGN_OR_RETURN(const v1::Model model, MakeBackend(place)->GetModel(request));
    DataColumns columns = ColumnsOf(problem);
    columns.options = options;
    AddUnits(model.outputs(), columns);
    AddUnits(model.inputs(), columns);
    return columns;
  }
  POLYEST_ASSIGN_OR_RETURN(const ModelLibrary models, OpenModels(place));
  return DataColumnsFor(problem, models, options);
}

void TellOfDataFile(const std::string& found) {
  if (!found.empty()) std::cerr << found << std::endl;
}

absl::StatusOr<v1::Measurements> ReadData(const std::string& file, const DataColumns& columns,
                                          DataInFile& data, RefusedLine refused) {
  std::string found;
  auto read = ReadDataFile(file, columns, refused, &found, &data.lines);
  data.file = file;
  if (read.ok()) TellOfDataFile(found);
  return read;
}

}  // namespace polyest::internal
