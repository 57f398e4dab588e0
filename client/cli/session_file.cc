#include "client/cli/session_file.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "client/cpp/file_kind.h"
#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr char kFirstLine[] = "polyest session 1";

}  // namespace

absl::StatusOr<std::unique_ptr<SessionFileWriter>> SessionFileWriter::Open(
    const std::string& file) {
  constexpr mode_t kAnybody = 0666;
  POLYEST_ASSIGN_OR_RETURN(auto draft, DraftFile::Open(file, kAnybody));
  POLYEST_RETURN_IF_ERROR(draft->Write(absl::StrCat(kFirstLine, "\n")));
  return std::unique_ptr<SessionFileWriter>(new SessionFileWriter(std::move(draft)));
}

absl::Status SessionFileWriter::Write(const v1::SessionRecord& record) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    POLYEST_CHECK(google::protobuf::util::SerializeDelimitedToZeroCopyStream(record, &stream));
  }
  return draft_->Write(bytes);
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
