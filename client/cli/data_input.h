#pragma once

// Reads data files for the commands, and says what has been found out about them.

#include <absl/status/statusor.h>

#include <string>

#include "client/cli/arguments.h"
#include "client/cli/input_files.h"
#include "core/external/model_library.h"
#include "polyest/data_file.h"
#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// Whether the model is in a folder of the program that computes, so that a daemon's is unknown
// here.
bool IsInFolder(const v1::Problem::Model& model);

// Returns the columns of data for a problem with the units of its model.
DataColumns DataColumnsFor(const v1::Problem& problem, const ModelLibrary& models,
                           const DataFileOptions& options);
// Returns the columns with the units of the models of a place. The units of an FMU that only a
// daemon has are those that the daemon names.
absl::StatusOr<DataColumns> DataColumnsFor(const v1::Problem& problem, const Place& place,
                                           const DataFileOptions& options);

// Prints what has been found out about a file (DataReader::Found), if anything, to the standard
// error. All commands that read data do so.
void TellOfDataFile(const std::string& found);

// Reads a whole file, says what has been found out about it, and fills in `data` with it.
absl::StatusOr<v1::Measurements> ReadData(const std::string& file, const DataColumns& columns,
                                          DataInFile& data,
                                          RefusedLine refused = StopAtRefusedLine);

}  // namespace polyest::internal
