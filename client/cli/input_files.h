#pragma once

// The files that a command reads, as its errors name them.

#include <absl/status/status.h>

#include <string>

#include "polyest/data_file.h"

namespace polyest::internal {

// A file of data.
struct DataInFile {
  std::string file = {};  // empty: none
  RowLines lines = {};    // of its rows; none if they are not known
};

// The files that a request is made of.
struct InputFiles {
  std::string problem = {};  // empty: none
  DataInFile data = {};      // Experiment.measurements
  DataInFile record = {};    // PredictRequest.record
};

// Returns the error with its place in front, if it refuses a field of one of these files: the
// file's name and, for a row of data, the number of its line. Other errors stay unchanged: those
// of options, those about a session, and those of reading a file.
absl::Status InFiles(const absl::Status& status, const InputFiles& files);

}  // namespace polyest::internal
