#pragma once

// Writes and reads session files, for `polyest export` and `polyest import`. A file has a first
// line that identifies its kind and then polyest.v1.SessionRecord messages, each after its length
// and its CRC-32, which are numbers of four bytes, the lowest first. The last message is the end.
// Files of the version before are read, too: they have messages after their lengths as protobuf
// delimits them, and neither checksums nor an end.

#include <absl/status/statusor.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>

#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "client/plot/draft_file.h"
#include "polyest/v1/session_service.pb.h"

namespace polyest::internal {

class SessionFileWriter {
 public:
  // Begins a draft of the file. INVALID_ARGUMENT if it cannot be written.
  static absl::StatusOr<std::unique_ptr<SessionFileWriter>> Open(const std::string& file);
  // Appends the record. Fails as Open.
  absl::Status Write(const v1::SessionRecord& record);
  // Replaces the file by the draft and returns when that is on the disk. Fails as Open.
  absl::Status Finish();

 private:
  explicit SessionFileWriter(std::unique_ptr<DraftFile> draft) : draft_(std::move(draft)) {}

  const std::unique_ptr<DraftFile> draft_;
};

class SessionFileReader {
 public:
  // Opens a file. INVALID_ARGUMENT if it cannot be read or is not a session file.
  static absl::StatusOr<std::unique_ptr<SessionFileReader>> Open(const std::string& file);

  // Returns the next record; none after the end. INVALID_ARGUMENT names a record that is damaged or
  // missing, and says if more follows the end.
  absl::StatusOr<std::optional<v1::SessionRecord>> Read();

 private:
  explicit SessionFileReader(const std::string& file) : file_(file), in_(file, std::ios::binary) {}
  absl::StatusOr<std::optional<v1::SessionRecord>> ReadUnchecked();
  absl::Status Error(const std::string& what) const;

  const std::string file_;
  std::ifstream in_;
  int64_t record_ = 0;  // the number of the record read last, from 1
  bool ended_ = false;
  // Set for a file of the version before.
  std::unique_ptr<google::protobuf::io::IstreamInputStream> unchecked_;
};

}  // namespace polyest::internal
