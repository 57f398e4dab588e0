#include "client/plot/plot_file.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "client/plot/output_file.h"
#include "core/common/status.h"

extern char** environ;

namespace polyest::internal {
namespace {

constexpr char kConverter[] = "rsvg-convert";
constexpr char kZoom[] = "2";  // pixels of the PNG for each of the SVG: sharp on paper, too

// Runs rsvg-convert, without a shell.
absl::Status Convert(std::string svg, std::string png) {
  std::string name = kConverter, zoom_option = "--zoom", zoom = kZoom, output = "--output";
  char* arguments[] = {name.data(), zoom_option.data(), zoom.data(), output.data(),
                       png.data(),  svg.data(),         nullptr};
  pid_t process = 0;
  const int failed = posix_spawnp(&process, kConverter, nullptr, nullptr, arguments, environ);
  if (failed != 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("--plot ", png, ": a PNG needs the program ", kConverter, " (",
                     strerror(failed), "): sudo apt-get install librsvg2-bin, or write an .svg"));
  }
  int state = 0;
  while (waitpid(process, &state, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(state) && WEXITSTATUS(state) == 0) return absl::OkStatus();
  return absl::UnknownError(absl::StrCat("--plot: ", kConverter, " could not write ", png));
}

absl::Status WritePng(const std::string& text, const std::string& file) {
  std::error_code unknown;
  std::filesystem::path folder = std::filesystem::temp_directory_path(unknown);
  if (unknown) folder = "/tmp";
  std::string svg = folder / "polyest_plot_XXXXXX";
  const int descriptor = mkstemp(svg.data());
  if (descriptor < 0) {
    return absl::UnknownError(absl::StrCat("--plot: cannot write ", svg, ": ", strerror(errno)));
  }
  close(descriptor);
  absl::Status written = WriteOutputFile("--plot", svg, text);
  if (written.ok()) written = Convert(svg, file);
  unlink(svg.c_str());
  return written;
}

}  // namespace

absl::Status CheckPlotFile(const std::string& file) {
  if (file.empty()) return absl::OkStatus();
  if (!absl::EndsWithIgnoreCase(file, ".svg") && !absl::EndsWithIgnoreCase(file, ".png")) {
    return absl::InvalidArgumentError(
        absl::StrCat("--plot: \"", file, "\" must end in .svg or .png"));
  }
  return CheckOutputFile("--plot", file);
}

absl::Status WritePlot(const Plot& plot, const std::string& file) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(file));
  const std::string text = RenderSvg(plot);
  return absl::EndsWithIgnoreCase(file, ".png") ? WritePng(text, file)
                                                : WriteOutputFile("--plot", file, text);
}

}  // namespace polyest::internal
