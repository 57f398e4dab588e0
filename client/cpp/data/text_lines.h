#pragma once

// Reads the lines of a text as UTF-8, without waiting for more of it than the next line.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <deque>
#include <istream>
#include <optional>
#include <string>

#include "client/cpp/data/text_encoding.h"

namespace polyest::internal {

// A line ends with LF, CR LF or CR. Line numbers begin with 1.
class TextLines {
 public:
  // Longer lines are refused, so that a file without line ends is not read into memory whole.
  static constexpr size_t kMaxLineBytes = (1 << 16) - 1;

  // Messages call the text `name`. `in` must outlive the object.
  TextLines(std::istream& in, std::string name);

  // Gets the next line, without its end; returns false at the end of the text. The line is valid
  // until the next call. INVALID_ARGUMENT if the text cannot be read or the line is too long; the
  // object must not be used any more then.
  absl::StatusOr<bool> Next(absl::string_view& line);
  // Makes Next return `line` again, which has the number `number`, before what follows. Lines put
  // back are returned in the order in which they have been put back.
  void PutBack(std::string line, int64_t number) { put_back_.push_back({std::move(line), number}); }

  const std::string& name() const { return name_; }
  int64_t line() const { return line_; }     // number of the last line
  bool cut_off() const { return cut_off_; }  // whether the last line had no end
  Encoding encoding() const { return found_.encoding; }
  // Returns INVALID_ARGUMENT with the name, the number of the last line and the message.
  absl::Status Error(absl::string_view message) const;

 private:
  struct Line {
    std::string text;
    int64_t number;
  };

  absl::StatusOr<bool> Fill();
  absl::StatusOr<size_t> ReadAvailable(std::string& bytes);
  void Begin();
  void Decode();
  size_t FindEnd();

  std::istream* in_;
  std::string name_;
  std::string bytes_;       // read, but not decoded yet; only for UTF-16
  std::string text_;        // UTF-8
  size_t begin_ = 0;        // of the next line in text_
  size_t searched_ = 0;     // before here, there is no LF after begin_
  bool skip_feed_ = false;  // an LF at begin_ belongs to the CR before it
  bool begun_ = false;
  bool ended_ = false;
  EncodingFound found_;
  std::optional<Utf16Decoder> decoder_;
  std::deque<Line> put_back_;
  std::string put_back_line_;
  int64_t line_ = 0;
  int64_t next_line_ = 1;
  bool cut_off_ = false;
};

}  // namespace polyest::internal
