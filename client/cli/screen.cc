#include "client/cli/screen.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "core/common/utf8.h"

namespace polyest::internal {
namespace {

constexpr int kDefaultColumns = 80;  // of a terminal whose size is unknown
constexpr int kDefaultRows = 24;
constexpr int kMinColumns = 20;
constexpr char kEscape = '\x1b';

// The following functions return the indices of a stream's storage for a Screen. A stream's values
// are 0 at first, which is the default of Screen.
int ColumnsSlot() {
  static const int slot = std::ios_base::xalloc();
  return slot;
}
int RowsSlot() {
  static const int slot = std::ios_base::xalloc();
  return slot;
}
int ColorSlot() {
  static const int slot = std::ios_base::xalloc();
  return slot;
}

bool IsSet(const char* variable) {
  const char* const value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

bool TerminalHasColors() {
  const char* const terminal = std::getenv("TERM");
  return IsSet("TERM") && absl::string_view(terminal) != "dumb" && !IsSet("NO_COLOR");
}

const char* CodeOf(Color color) {
  switch (color) {
    case Color::kGreen:
      return "32";
    case Color::kYellow:
      return "33";
    case Color::kRed:
      return "31";
    case Color::kFaint:
      return "2";
  }
  return "0";
}

// Returns the position after the escape sequence that begins at `i`.
size_t SkipSequence(absl::string_view text, size_t i) {
  const size_t end = text.find('m', i);
  return end == absl::string_view::npos ? text.size() : end + 1;
}

}  // namespace

Screen ScreenOf(int descriptor, ColorChoice color) {
  Screen screen;
  const bool terminal = isatty(descriptor) != 0;
  screen.color = color == ColorChoice::kAlways ||
                 (color == ColorChoice::kAuto && terminal && TerminalHasColors());
  if (!terminal) return screen;
  winsize size = {};
  const bool known = ioctl(descriptor, TIOCGWINSZ, &size) == 0;
  screen.columns = known && size.ws_col > 0 ? size.ws_col : kDefaultColumns;
  screen.rows = known && size.ws_row > 0 ? size.ws_row : kDefaultRows;
  int columns = 0;
  const char* const wanted = std::getenv("COLUMNS");
  if (wanted != nullptr && absl::SimpleAtoi(wanted, &columns) && columns > 0) {
    screen.columns = columns;
  }
  screen.columns = std::max(screen.columns, kMinColumns);
  return screen;
}

void SetScreen(std::ios_base& stream, const Screen& screen) {
  stream.iword(ColumnsSlot()) = screen.columns;
  stream.iword(RowsSlot()) = screen.rows;
  stream.iword(ColorSlot()) = screen.color ? 1 : 0;
}

Screen GetScreen(std::ios_base& stream) {
  Screen screen;
  screen.columns = static_cast<int>(stream.iword(ColumnsSlot()));
  screen.rows = static_cast<int>(stream.iword(RowsSlot()));
  screen.color = stream.iword(ColorSlot()) != 0;
  return screen;
}

std::string Paint(std::ios_base& stream, Color color, absl::string_view text) {
  if (!GetScreen(stream).color || text.empty()) return std::string(text);
  return absl::StrCat("\x1b[", CodeOf(color), "m", text, "\x1b[0m");
}

int DisplayWidth(absl::string_view text) {
  int width = 0;
  for (size_t i = 0; i < text.size();) {
    if (text[i] == kEscape) {
      i = SkipSequence(text, i);
      continue;
    }
    // Only the first byte of a UTF-8 code point counts. A combining mark such as that of R̂, U+0300
    // to U+036F, takes no column.
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool combines = byte == 0xCC || (byte == 0xCD && i + 1 < text.size() &&
                                           static_cast<unsigned char>(text[i + 1]) < 0xB0);
    if (!ContinuesCharacter(text[i]) && !combines) ++width;
    ++i;
  }
  return width;
}

std::string WrapText(absl::string_view text, int columns, int indent) {
  if (columns <= 0 || DisplayWidth(text) <= columns) return std::string(text);
  std::string wrapped;
  int width = 0;
  bool begins = true;
  for (const absl::string_view word : absl::StrSplit(text, ' ')) {
    const int more = DisplayWidth(word);
    if (!begins && width + 1 + more > columns) {
      absl::StrAppend(&wrapped, "\n", std::string(static_cast<size_t>(indent), ' '), word);
      width = indent + more;
    } else {
      absl::StrAppend(&wrapped, begins ? "" : " ", word);
      width += more + (begins ? 0 : 1);
    }
    begins = false;
  }
  return wrapped;
}

void PrintSentence(std::ostream& out, absl::string_view text) {
  constexpr int kIndent = 2;  // of the lines after the first
  out << WrapText(text, GetScreen(out).columns, kIndent) << '\n';
}

}  // namespace polyest::internal
