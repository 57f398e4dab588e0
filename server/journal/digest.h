#pragma once

// By what a batch is known again.

#include <google/protobuf/message.h>

#include <string>
#include <string_view>

namespace polyest {

// The same for equal messages, in this and any later run of the program.
std::string DeterministicBytes(const google::protobuf::Message& message);

// SHA-256, 32 bytes: two batches with the same digest are the same batch.
std::string Digest(std::string_view bytes);

}  // namespace polyest
