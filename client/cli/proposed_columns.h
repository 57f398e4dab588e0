#pragma once

// Proposes which columns of a data file are which quantities of a model, for `polyest init --from`.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <map>
#include <string>
#include <vector>

#include "client/cpp/data/column_names.h"
#include "polyest/data_file.h"
#include "polyest/model.h"

namespace polyest::internal {

// The columns of a data file.
struct RecordedColumns {
  std::vector<ColumnName> names;  // all but the time, with the units of a row of units
  std::string time;               // header of the time
};

// The header of each quantity's column; `t` among them if the file alone does not tell its time.
struct ProposedColumns {
  std::map<std::string, std::string> headers;
};

// Reads the header of a data file and the row of units below it, if there is one.
absl::StatusOr<RecordedColumns> ReadColumns(const std::string& file,
                                            const DataFileOptions& options);

// Proposes the columns with a quantity's name, and then each column whose unit has the dimension of
// one remaining quantity only, if no other remaining column has it.
ProposedColumns ProposeColumns(const ModelDescription& model, const RecordedColumns& recorded);

// INVALID_ARGUMENT when no output of the model has a column.
absl::Status CheckProposal(const ModelDescription& model, const RecordedColumns& recorded,
                           const ProposedColumns& proposed, const std::string& file);

// Says in one line which columns are proposed for what, and which are not used.
std::string Describe(const RecordedColumns& recorded, const ProposedColumns& proposed);

}  // namespace polyest::internal
