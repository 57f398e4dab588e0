#pragma once

// Describes the screen that shows an output stream: its width, to which tables are fitted, and
// whether it has colours. The description is stored in the stream itself, so that all code that
// prints to the stream follows it. copyfmt() copies it to a stream that collects text first.

#include <absl/strings/string_view.h>

#include <ostream>
#include <string>

namespace polyest::internal {

enum class ColorChoice { kAuto, kAlways, kNever };

enum class Color { kGreen, kYellow, kRed, kFaint };

// Size and colours of a screen. Until SetScreen, a stream has the default: text of any width
// without colours.
struct Screen {
  int columns = 0;  // 0: no limit
  int rows = 0;     // 0: no limit
  bool color = false;
};

// Returns the screen of a file descriptor: the size of its terminal, whose width the environment
// variable COLUMNS overrides, or no limits if it is no terminal. `kAuto` means colours on a
// terminal that has them, unless NO_COLOR is set (https://no-color.org).
Screen ScreenOf(int descriptor, ColorChoice color);

void SetScreen(std::ios_base& stream, const Screen& screen);
Screen GetScreen(std::ios_base& stream);

// Returns the text in the colour if the stream's screen has colours; otherwise the plain text.
std::string Paint(std::ios_base& stream, Color color, absl::string_view text);

// Returns the number of columns that UTF-8 text takes on a screen: one per code point, none for
// combining marks and for the sequences that Paint adds.
int DisplayWidth(absl::string_view text);

// Breaks text at blanks into lines of at most `columns` columns. All lines but the first are
// indented. A longer word gets a line of its own. With 0 columns, the text stays one line.
std::string WrapText(absl::string_view text, int columns, int indent = 0);

// Prints a sentence and a line end. The sentence is wrapped to the width of the screen.
void PrintSentence(std::ostream& out, absl::string_view text);

}  // namespace polyest::internal
