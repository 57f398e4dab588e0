// Reads arbitrary bytes as a data file. Whatever is read is finite and in the order of time, is the
// same row by row from a slow pipe as at once, and every message is one line of UTF-8.
//
// The first byte chooses the options, the rest is the file.

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <istream>
#include <limits>
#include <optional>
#include <streambuf>
#include <string>

#include "core/common/check.h"
#include "core/common/utf8.h"
#include "polyest/data_file.h"

namespace {

using polyest::DataColumns;
using polyest::DataFileOptions;
using polyest::DataReader;
using polyest::v1::Measurements;

// Gives a text in pieces.
class Pieces : public std::streambuf {
 public:
  Pieces(std::string text, size_t piece) : text_(std::move(text)), piece_(piece) {}

 protected:
  int_type underflow() override {
    if (at_ == text_.size()) return traits_type::eof();
    const size_t size = std::min(piece_, text_.size() - at_);
    setg(text_.data() + at_, text_.data() + at_, text_.data() + at_ + size);
    at_ += size;
    return traits_type::to_int_type(*gptr());
  }

 private:
  std::string text_;
  const size_t piece_;
  size_t at_ = 0;
};

DataColumns Columns(std::uint8_t choice) {
  DataColumns columns;
  columns.measured = {"x", "acceleration"};
  if ((choice & 1) != 0) columns.streamed = {"F"};
  if ((choice & 2) != 0) columns.units = {{"x", "m"}, {"acceleration", "m/s^2"}, {"F", "N"}};
  if ((choice & 4) != 0) columns.sources["x"] = {"Disp", "mm"};
  if ((choice & 8) != 0) columns.options.time_zero = DataFileOptions::TimeZero::kFirst;
  if ((choice & 16) != 0) columns.options.decimal = ',';
  if ((choice & 32) != 0) columns.options.date_order = DataFileOptions::DateOrder::kDayFirst;
  return columns;
}

struct Result {
  Measurements rows;
  std::string text;  // what was found, and all messages
};

void AddMessage(const std::string& message, Result& result) {
  POLYEST_CHECK(polyest::internal::IsUtf8(message));
  POLYEST_CHECK(message.find('\n') == message.npos);
  absl::StrAppend(&result.text, message, "\n");
}

void Append(const Measurements& batch, Measurements& rows) {
  const int before = rows.time_s_size();
  rows.mutable_time_s()->MergeFrom(batch.time_s());
  rows.mutable_run()->MergeFrom(batch.run());
  for (int i = 0; i < batch.channels_size(); ++i) {
    if (rows.channels_size() <= i) rows.add_channels()->set_name(batch.channels(i).name());
    auto& channel = *rows.mutable_channels(i);
    channel.mutable_values()->MergeFrom(batch.channels(i).values());
    for (const int row : batch.channels(i).missing()) channel.add_missing(before + row);
  }
}

Result Read(const std::string& text, const DataColumns& columns, size_t piece, int64_t batch) {
  Result result;
  const auto refused = [&](const absl::Status& refusal) {
    AddMessage(std::string(refusal.message()), result);
    return absl::OkStatus();
  };
  Pieces pieces(text, piece);
  std::istream in(&pieces);
  auto reader = DataReader::Open(in, "data.csv", columns, refused);
  absl::Status status = reader.status();
  while (status.ok()) {
    auto rows = reader->Read(batch, refused);
    status = rows.status();
    if (!rows.ok() || rows->time_s().empty()) break;
    Append(*rows, result.rows);
  }
  if (!status.ok()) AddMessage(std::string(status.message()), result);
  if (reader.ok()) AddMessage(reader->Found(), result);
  return result;
}

void CheckRows(const Measurements& rows) {
  for (int i = 0; i < rows.time_s_size(); ++i) {
    POLYEST_CHECK(std::isfinite(rows.time_s(i)) && rows.time_s(i) >= 0);
    const bool follows = i > 0 && (rows.run().empty() || rows.run(i) == rows.run(i - 1));
    POLYEST_CHECK(!follows || rows.time_s(i) > rows.time_s(i - 1));
  }
  for (const Measurements::Channel& channel : rows.channels()) {
    POLYEST_CHECK(channel.values_size() == rows.time_s_size());
    for (const double value : channel.values()) POLYEST_CHECK(std::isfinite(value));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const DataColumns columns = Columns(data[0]);
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Result whole = Read(text, columns, size, std::numeric_limits<int64_t>::max());
  CheckRows(whole.rows);
  const Result pieces = Read(text, columns, 1 + data[0] % 7, 1);
  POLYEST_CHECK(pieces.rows.SerializeAsString() == whole.rows.SerializeAsString());
  POLYEST_CHECK(pieces.text == whole.text);
  return 0;
}
