#pragma once

// SHA-256 of bytes and of messages: batches and tokens are known again by it.

#include <google/protobuf/message.h>

#include <array>
#include <string>
#include <string_view>

namespace polyest::internal {

using Sha256Digest = std::array<unsigned char, 32>;

Sha256Digest Sha256(std::string_view bytes);

// Returns the digest as a text of 32 bytes, as the journal keeps it: two batches with the same one
// are the same batch.
std::string Digest(std::string_view bytes);

// Returns bytes that are the same for equal messages, in this and any later run of the program.
std::string DeterministicBytes(const google::protobuf::Message& message);

}  // namespace polyest::internal
