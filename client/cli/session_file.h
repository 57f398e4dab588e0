#pragma once

// A session in a file, as `polyest export` writes and `polyest import` reads it: a line that says
// what it is, then polyest.v1.SessionRecord messages, each after its length as a varint.

#include <absl/status/statusor.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>

#include <fstream>
#include <memory>
#include <optional>
#include <string>

#include "polyest/v1/session_service.pb.h"

namespace polyest::internal {

class SessionFileWriter {
 public:
  // Writes beside the file first, so that an export that fails leaves what was there.
  // INVALID_ARGUMENT when that cannot be written.
  static absl::StatusOr<std::unique_ptr<SessionFileWriter>> Open(const std::string& file);
  // Removes what was not finished.
  ~SessionFileWriter();
  SessionFileWriter(const SessionFileWriter&) = delete;
  SessionFileWriter& operator=(const SessionFileWriter&) = delete;

  absl::Status Write(const v1::SessionRecord& record);
  absl::Status Finish();

 private:
  explicit SessionFileWriter(std::string file);
  absl::Status Failed() const;

  const std::string file_;
  const std::string draft_;
  std::ofstream out_;
};

class SessionFileReader {
 public:
  // INVALID_ARGUMENT when the file cannot be read or is something else.
  static absl::StatusOr<std::unique_ptr<SessionFileReader>> Open(const std::string& file);

  // Returns none at the end of the file; INVALID_ARGUMENT where it breaks off.
  absl::StatusOr<std::optional<v1::SessionRecord>> Read();

 private:
  explicit SessionFileReader(const std::string& file) : file_(file), in_(file, std::ios::binary) {}

  const std::string file_;
  std::ifstream in_;
  std::unique_ptr<google::protobuf::io::IstreamInputStream> input_;
};

}  // namespace polyest::internal
