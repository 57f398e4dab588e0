#pragma once

// The arguments of the commands that work on a daemon's sessions, one struct for each.

#include <string>

#include "client/cli/answer_format.h"
#include "client/cli/place.h"
#include "polyest/data_file.h"

namespace polyest::internal {

struct StreamArguments {
  Place place;
  std::string problem_file;
  std::string data_file;  // "-": standard input
  DataFileOptions data_options;
  int batch_rows = 30;
  double rate = 0;              // factor by which data are sent faster than measured; 0: at once
  std::string session;          // its id; empty: the daemon chooses
  double reorder_window_s = 0;  // within which rows may be out of order; 0: they may not
  Format format = Format::kTable;
};

struct ExportArguments {
  Place place;
  std::string session;  // its id
  std::string file;
};

struct ImportArguments {
  Place place;
  std::string file;
  std::string session;  // its id in this daemon; empty: the id that it had
};

struct DeleteArguments {
  Place place;
  std::string session;  // its id
};

struct ListArguments {
  Place place;
  Format format = Format::kTable;
};

struct NodesArguments {
  Place place;
  std::string action;  // "drain"; empty: the nodes are listed
  std::string node;    // the one to drain: its number, its name or its address
  Format format = Format::kTable;
};

struct WatchArguments {
  Place place;
  std::string session;  // its id
  bool once = false;
  Format format = Format::kTable;
};

struct BackupArguments {
  Place place;
  std::string output_file;
};

struct TopArguments {
  Place place;
  bool once = false;
  double interval_s = 2;
};

}  // namespace polyest::internal
