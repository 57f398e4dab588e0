#include "client/cpp/data/text_lines.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr std::streamsize kBlockBytes = 1 << 18;

size_t Find(const std::string& text, size_t begin, size_t end, char wanted) {
  const void* const found = std::memchr(text.data() + begin, wanted, end - begin);
  return found == nullptr ? end
                          : static_cast<size_t>(static_cast<const char*>(found) - text.data());
}

}  // namespace

TextLines::TextLines(std::istream& in, std::string name) : in_(&in), name_(std::move(name)) {}

absl::Status TextLines::Error(absl::string_view message) const {
  return absl::InvalidArgumentError(absl::StrCat(name_, ":", line_, ": ", message));
}

// Appends what is there already, or else waits for something; returns the number of bytes, 0 at the
// end.
absl::StatusOr<size_t> TextLines::ReadAvailable(std::string& bytes) {
  const auto available = [this] { return in_->good() ? in_->rdbuf()->in_avail() : 0; };
  std::streamsize room = available();
  if (room <= 0 && in_->peek() != std::istream::traits_type::eof()) {
    room = std::max<std::streamsize>(available(), 1);
  }
  room = std::clamp<std::streamsize>(room, 0, kBlockBytes);
  const size_t size = bytes.size();
  bytes.resize(size + static_cast<size_t>(room));
  if (room > 0 && in_->readsome(bytes.data() + size, room) == 0) in_->read(bytes.data() + size, 1);
  const auto count = room > 0 ? static_cast<size_t>(in_->gcount()) : 0;
  bytes.resize(size + count);
  if (in_->bad()) return absl::InvalidArgumentError(absl::StrCat(name_, ": cannot be read"));
  return count;
}

// Appends more of the text to text_; false at its end.
absl::StatusOr<bool> TextLines::Fill() {
  text_.erase(0, begin_);
  searched_ -= std::min(searched_, begin_);
  begin_ = 0;
  std::string& target = found_.encoding == Encoding::kUtf8 && begun_ ? text_ : bytes_;
  POLYEST_ASSIGN_OR_RETURN(const size_t count, ReadAvailable(target));
  ended_ = count == 0;
  if (!begun_) Begin();
  if (begun_ && &target == &bytes_) Decode();
  if (ended_ && decoder_ && decoder_->ends_within()) text_ += "\xEF\xBF\xBD";
  return !ended_;
}

// Finds the encoding as soon as there are enough bytes for it.
void TextLines::Begin() {
  if (bytes_.size() < kEncodingBytes && !ended_) return;
  begun_ = true;
  found_ = FindEncoding(bytes_);
  bytes_.erase(0, found_.mark_bytes);
  if (found_.encoding != Encoding::kUtf8) decoder_.emplace(found_.encoding == Encoding::kUtf16Big);
}

void TextLines::Decode() {
  if (decoder_) {
    decoder_->Append(bytes_, text_);
  } else {
    text_ += bytes_;
  }
  bytes_.clear();
}

// Returns where the next line ends; the end of text_ if its end has not been read yet. LF is looked
// for no more than once in each part of the text, also if lines end with CR.
size_t TextLines::FindEnd() {
  searched_ = std::max(searched_, begin_);
  if (searched_ >= text_.size() || text_[searched_] != '\n') {
    searched_ = Find(text_, searched_, text_.size(), '\n');
  }
  return Find(text_, begin_, searched_, '\r');
}

absl::StatusOr<bool> TextLines::Next(absl::string_view& line) {
  if (!put_back_.empty()) {
    line_ = put_back_.front().number;
    put_back_line_ = std::move(put_back_.front().text);
    put_back_.pop_front();
    line = put_back_line_;
    return true;
  }
  size_t end = 0;
  while (true) {
    if (skip_feed_ && begin_ < text_.size()) {
      if (text_[begin_] == '\n') ++begin_;
      skip_feed_ = false;
    }
    end = FindEnd();
    if (end < text_.size() || end - begin_ > kMaxLineBytes || ended_) break;
    POLYEST_RETURN_IF_ERROR(Fill().status());
  }
  if (end == text_.size() && begin_ == end) return false;
  line_ = next_line_++;
  if (end - begin_ > kMaxLineBytes) {
    return Error(absl::StrCat("the line is longer than ", kMaxLineBytes, " bytes"));
  }
  line = absl::string_view(text_).substr(begin_, end - begin_);
  cut_off_ = end == text_.size();
  skip_feed_ = !cut_off_ && text_[end] == '\r';
  begin_ = cut_off_ ? end : end + 1;
  return true;
}

}  // namespace polyest::internal
