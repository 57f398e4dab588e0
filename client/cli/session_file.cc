#include "client/cli/session_file.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "client/cpp/file_kind.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr char kFirstLine[] = "polyest session 2\n";
constexpr char kFirstLineBefore[] = "polyest session 1\n";
constexpr size_t kLineBytes = sizeof(kFirstLine) - 1;
constexpr size_t kNumberBytes = 4;

uint32_t ChecksumOf(const std::string& bytes) {
  return static_cast<uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

// Appends a number, the lowest byte first.
void AppendNumber(uint32_t number, std::string& bytes) {
  for (size_t i = 0; i < kNumberBytes; ++i) {
    bytes.push_back(static_cast<char>(number >> (8 * i) & 0xff));
  }
}

std::optional<uint32_t> ReadNumber(std::istream& in) {
  std::array<char, kNumberBytes> bytes{};
  if (!in.read(bytes.data(), bytes.size())) return std::nullopt;
  uint32_t number = 0;
  for (size_t i = bytes.size(); i-- > 0;) {
    number = number << 8 | static_cast<unsigned char>(bytes[i]);
  }
  return number;
}

// Reads so many bytes, or as many as there are: a length that is damaged asks for no memory.
std::string ReadBytes(std::istream& in, size_t count) {
  constexpr size_t kAtOnce = size_t{1} << 20;
  std::string bytes;
  while (bytes.size() < count && in) {
    const size_t begin = bytes.size(), part = std::min(kAtOnce, count - begin);
    bytes.resize(begin + part);
    in.read(bytes.data() + begin, static_cast<std::streamsize>(part));
    bytes.resize(begin + static_cast<size_t>(in.gcount()));
  }
  return bytes;
}

}  // namespace

absl::StatusOr<std::unique_ptr<SessionFileWriter>> SessionFileWriter::Open(
    const std::string& file) {
  constexpr mode_t kAnybody = 0666;
  POLYEST_ASSIGN_OR_RETURN(auto draft, DraftFile::Open(file, kAnybody));
  POLYEST_RETURN_IF_ERROR(draft->Write(kFirstLine));
  return std::unique_ptr<SessionFileWriter>(new SessionFileWriter(std::move(draft)));
}

absl::Status SessionFileWriter::Write(const v1::SessionRecord& record) {
  const std::string encoded = record.SerializeAsString();
  std::string bytes;
  AppendNumber(static_cast<uint32_t>(encoded.size()), bytes);
  AppendNumber(ChecksumOf(encoded), bytes);
  return draft_->Write(bytes + encoded);
}

absl::Status SessionFileWriter::Finish() { return draft_->Replace(); }

absl::StatusOr<std::unique_ptr<SessionFileReader>> SessionFileReader::Open(
    const std::string& file) {
  POLYEST_RETURN_IF_ERROR(CheckIsNoFolder(file));
  std::unique_ptr<SessionFileReader> reader(new SessionFileReader(file));
  if (!reader->in_) {
    return absl::InvalidArgumentError(
        absl::StrFormat("%s: cannot be read: %s", file, std::strerror(errno)));
  }
  const std::string line = ReadBytes(reader->in_, kLineBytes);
  if (line == kFirstLineBefore) {
    reader->unchecked_ = std::make_unique<google::protobuf::io::IstreamInputStream>(&reader->in_);
  } else if (line != kFirstLine) {
    return absl::InvalidArgumentError(
        absl::StrFormat("%s: is not a session file written by polyest export", file));
  }
  return reader;
}

absl::Status SessionFileReader::Error(const std::string& what) const {
  return absl::InvalidArgumentError(absl::StrFormat("%s: record %d %s", file_, record_, what));
}

absl::StatusOr<std::optional<v1::SessionRecord>> SessionFileReader::ReadUnchecked() {
  v1::SessionRecord record;
  if (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&record, unchecked_.get(),
                                                               &ended_)) {
    return record;
  }
  if (!ended_) return Error("is cut off or damaged");
  record.Clear();
  record.mutable_end();
  return record;
}

absl::StatusOr<std::optional<v1::SessionRecord>> SessionFileReader::Read() {
  if (ended_) return std::nullopt;
  ++record_;
  if (unchecked_ != nullptr) return ReadUnchecked();
  const std::optional<uint32_t> length = ReadNumber(in_);
  const std::optional<uint32_t> checksum = ReadNumber(in_);
  const std::string encoded = length ? ReadBytes(in_, *length) : "";
  if (!length || !checksum || encoded.size() < *length) {
    return Error("is cut off or missing: the file is incomplete");
  }
  v1::SessionRecord record;
  if (ChecksumOf(encoded) != *checksum || !record.ParseFromString(encoded)) {
    return Error("is damaged: its checksum is not that of its bytes");
  }
  ended_ = record.has_end();
  if (ended_ && in_.peek() != std::ifstream::traits_type::eof()) {
    return Error("is the end, but more follows: the file is damaged");
  }
  return record;
}

}  // namespace polyest::internal
