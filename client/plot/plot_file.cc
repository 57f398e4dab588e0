#include "client/plot/plot_file.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
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

bool IsPng(const std::string& file) { return absl::EndsWithIgnoreCase(file, ".png"); }

// Returns the error of a PNG without the program that makes it.
absl::Status NoConverter(const std::string& png, int error) {
  return absl::InvalidArgumentError(
      absl::StrCat("--plot ", png, ": a PNG needs the program ", kConverter, " (", strerror(error),
                   "): sudo apt-get install librsvg2-bin, or write an .svg"));
}

// Whether a folder of the PATH has the program.
bool HasConverter() {
  const char* const folders = getenv("PATH");
  for (const absl::string_view folder : absl::StrSplit(folders == nullptr ? "" : folders, ':')) {
    const std::string program = absl::StrCat(folder.empty() ? "." : folder, "/", kConverter);
    std::error_code unknown;
    if (std::filesystem::is_regular_file(program, unknown) && access(program.c_str(), X_OK) == 0) {
      return true;
    }
  }
  return false;
}

// Runs rsvg-convert, without a shell.
absl::Status Convert(std::string svg, std::string png) {
  std::string name = kConverter, zoom_option = "--zoom", zoom = kZoom, output = "--output";
  char* arguments[] = {name.data(), zoom_option.data(), zoom.data(), output.data(),
                       png.data(),  svg.data(),         nullptr};
  pid_t process = 0;
  const int failed = posix_spawnp(&process, kConverter, nullptr, nullptr, arguments, environ);
  if (failed != 0) return NoConverter(png, failed);
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
  if (!absl::EndsWithIgnoreCase(file, ".svg") && !IsPng(file)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--plot: \"", file, "\" must end in .svg or .png"));
  }
  if (IsPng(file) && !HasConverter()) return NoConverter(file, ENOENT);
  return CheckOutputFile("--plot", file);
}

absl::Status WritePlot(const Plot& plot, const std::string& file) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(file));
  const std::string text = RenderSvg(plot);
  return IsPng(file) ? WritePng(text, file) : WriteOutputFile("--plot", file, text);
}

}  // namespace polyest::internal
