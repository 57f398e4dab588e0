#pragma once

// `polyest paper [FIGURE] [--plot FILE.svg]`: the paper's experiments, rerun.

#include <ostream>
#include <string>

namespace polyest::internal {

struct PaperOptions {
  std::string figure;     // empty: all
  std::string plot_file;  // the figure as SVG; empty: none
  int threads = 1;
};

// Prints the experiments to `out` and errors, one line each, to `err`. The exit status: 0; 2 for a
// figure that there is not or a plot without a figure; 1 for anything else.
int RunPaper(const PaperOptions& options, std::ostream& out, std::ostream& err);

}  // namespace polyest::internal
