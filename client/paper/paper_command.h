#pragma once

// Runs `polyest paper [FIGURE] [--plot FILE.svg]`, which repeats the paper's experiments.

#include <ostream>
#include <string>

namespace polyest::internal {

struct PaperOptions {
  std::string figure;     // empty: all
  std::string plot_file;  // file for the figure in SVG; empty: none
  int threads = 1;
};

// Prints the experiments to `out` and errors, one line each, to `err`. Returns the exit status: 0;
// 2 for an unknown figure or for a plot without a figure; 1 for any other error.
int RunPaper(const PaperOptions& options, std::ostream& out, std::ostream& err);

}  // namespace polyest::internal
