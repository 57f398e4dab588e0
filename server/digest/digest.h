#pragma once

// Computes SHA-256, by which batches and tokens are recognized.

#include <google/protobuf/message.h>

#include <array>
#include <string>
#include <string_view>

namespace polyest::internal {

using Sha256Digest = std::array<unsigned char, 32>;

Sha256Digest Sha256(std::string_view bytes);

// Returns the SHA-256 as a string of 32 bytes, as the journal keeps it. Batches with the same
// digest are the same batch.
std::string Digest(std::string_view bytes);

// Returns bytes that are the same for equal messages, in this and any later run of the program.
// Leaves out fields that this version does not know, wherever they are: they mean nothing here, and
// nobody counts what they hold.
std::string DeterministicBytes(const google::protobuf::Message& message);

}  // namespace polyest::internal
