#pragma once

// Writes and reads session files, for `polyest export` and `polyest import`. A file has a first
// line that identifies its kind and then polyest.v1.SessionRecord messages, each after its length
// as a varint.

#include <absl/status/statusor.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>

#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "client/cli/draft_file.h"
#include "polyest/v1/session_service.pb.h"

namespace polyest::internal {

class SessionFileWriter {
 public:
  // Begins a draft of the file. INVALID_ARGUMENT if it cannot be written.
  static absl::StatusOr<std::unique_ptr<SessionFileWriter>> Open(const std::string& file);
  // Appends the record. Fails as Open.
  absl::Status Write(const v1::SessionRecord& record);
  // Replaces the file by the draft, and returns when that is on the disk.
  absl::Status Finish();

 private:
  explicit SessionFileWriter(std::unique_ptr<DraftFile> draft) : draft_(std::move(draft)) {}

  const std::unique_ptr<DraftFile> draft_;
};

class SessionFileReader {
 public:
  // Opens a file. INVALID_ARGUMENT if it cannot be read or is not a session file.
  static absl::StatusOr<std::unique_ptr<SessionFileReader>> Open(const std::string& file);

  // Returns the next record; none at the end of the file. INVALID_ARGUMENT if the file ends within
  // a record.
  absl::StatusOr<std::optional<v1::SessionRecord>> Read();

 private:
  explicit SessionFileReader(const std::string& file) : file_(file), in_(file, std::ios::binary) {}

  const std::string file_;
  std::ifstream in_;
  std::unique_ptr<google::protobuf::io::IstreamInputStream> input_;
};

}  // namespace polyest::internal
