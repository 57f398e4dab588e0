#include "client/cli/session_file.h"

#include <absl/strings/str_format.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "client/cpp/file_kind.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr char kFirstLine[] = "polyest session 1";

}  // namespace

SessionFileWriter::SessionFileWriter(std::string file)
    : file_(std::move(file)), draft_(file_ + ".part"), out_(draft_, std::ios::binary) {}

absl::StatusOr<std::unique_ptr<SessionFileWriter>> SessionFileWriter::Open(
    const std::string& file) {
  std::unique_ptr<SessionFileWriter> writer(new SessionFileWriter(file));
  writer->out_ << kFirstLine << '\n';
  if (!writer->out_) return writer->Failed();
  return writer;
}

SessionFileWriter::~SessionFileWriter() { std::remove(draft_.c_str()); }

absl::Status SessionFileWriter::Failed() const {
  return absl::InvalidArgumentError(
      absl::StrFormat("%s: cannot be written: %s", draft_, std::strerror(errno)));
}

absl::Status SessionFileWriter::Write(const v1::SessionRecord& record) {
  if (google::protobuf::util::SerializeDelimitedToOstream(record, &out_)) return absl::OkStatus();
  return Failed();
}

absl::Status SessionFileWriter::Finish() {
  out_.close();
  if (!out_ || std::rename(draft_.c_str(), file_.c_str()) != 0) return Failed();
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<SessionFileReader>> SessionFileReader::Open(
    const std::string& file) {
  POLYEST_RETURN_IF_ERROR(CheckIsNoFolder(file));
  std::unique_ptr<SessionFileReader> reader(new SessionFileReader(file));
  if (!reader->in_) {
    return absl::InvalidArgumentError(
        absl::StrFormat("%s: cannot be read: %s", file, std::strerror(errno)));
  }
  // Reads no more bytes than the first line has.
  std::string line(sizeof(kFirstLine), '\0');
  reader->in_.read(line.data(), static_cast<std::streamsize>(line.size()));
  if (!reader->in_ || line != std::string(kFirstLine) + "\n") {
    return absl::InvalidArgumentError(
        absl::StrFormat("%s: is not a session file written by polyest export", file));
  }
  reader->input_ = std::make_unique<google::protobuf::io::IstreamInputStream>(&reader->in_);
  return reader;
}

absl::StatusOr<std::optional<v1::SessionRecord>> SessionFileReader::Read() {
  v1::SessionRecord record;
  bool end = false;
  if (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&record, input_.get(), &end)) {
    return record;
  }
  if (end) return std::nullopt;
  return absl::InvalidArgumentError(
      absl::StrFormat("%s: ends in the middle of a record (incomplete file)", file_));
}

}  // namespace polyest::internal
