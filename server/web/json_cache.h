#pragma once

// Turns messages into JSON once when many clients get the same one: all who watch a session are
// sent each of its estimates.

#include <google/protobuf/descriptor.h>

#include <array>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>

namespace polyest::internal {

// Thread-safe.
class JsonCache {
 public:
  using Text = std::shared_ptr<const std::string>;

  // Returns ToJsonText of the message. Of several threads that ask for the same text at once, one
  // makes it and the others wait.
  Text ToJson(const std::string& bytes, const google::protobuf::Descriptor& type);

 private:
  // A message and, once it is made, its text.
  struct Entry {
    Entry(const std::string& message, const google::protobuf::Descriptor& message_type)
        : bytes(message), type(message_type) {}

    const std::string bytes;
    const google::protobuf::Descriptor& type;
    std::once_flag once;
    Text text;
  };

  std::shared_ptr<Entry> Find(const std::string& bytes, const google::protobuf::Descriptor& type);

  std::mutex mutex_;
  std::array<std::shared_ptr<Entry>, 32> entries_;  // each in the place of its hash
};

}  // namespace polyest::internal
