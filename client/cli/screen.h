#pragma once

// What an output stream is shown on: the width that tables follow, and whether there are colours.
// It is kept in the stream itself, so that whatever prints to the stream follows it; copyfmt()
// takes it along to a stream that collects text first.

#include <absl/strings/string_view.h>

#include <ostream>
#include <string>

namespace polyest::internal {

enum class ColorChoice { kAuto, kAlways, kNever };

enum class Color { kGreen, kYellow, kRed, kFaint };

// A stream's screen is this one until SetScreen: text of any width without colours.
struct Screen {
  int columns = 0;  // 0: no limit
  int rows = 0;     // 0: no limit
  bool color = false;
};

// Returns the screen behind a file descriptor: the size of its terminal, where COLUMNS in the
// environment overrides the width; no limits without a terminal. `kAuto` means colours on a
// terminal that has them, unless NO_COLOR is set (https://no-color.org).
Screen ScreenOf(int descriptor, ColorChoice color);

void SetScreen(std::ios_base& stream, const Screen& screen);
Screen GetScreen(std::ios_base& stream);

// Returns the text in that colour if the stream's screen has colours; otherwise the text.
std::string Paint(std::ios_base& stream, Color color, absl::string_view text);

// Returns the number of places that UTF-8 text takes on a screen: one a code point, none for the
// sequences that Paint adds.
int DisplayWidth(absl::string_view text);

// Breaks text at blanks into lines of at most `columns` places, all but the first indented; a
// longer word keeps a line of its own. 0 columns: one line.
std::string WrapText(absl::string_view text, int columns, int indent = 0);

// Prints a sentence and ends its line; it is broken where the screen ends.
void PrintSentence(std::ostream& out, absl::string_view text);

}  // namespace polyest::internal
