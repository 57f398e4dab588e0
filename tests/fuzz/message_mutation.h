#pragma once

// Small random changes of protobuf messages by reflection, which keep them messages of their type.

#include <google/protobuf/message.h>

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace polyest::internal {

class MessageMutation {
 public:
  // Changes bytes in place and returns their new number, as LLVMFuzzerMutate does.
  using MutateBytes = size_t (*)(uint8_t* data, size_t size, size_t most);

  MessageMutation(uint32_t seed, MutateBytes mutate_bytes)
      : random_(seed), mutate_bytes_(mutate_bytes) {}

  // Learns values that strings and messages may later be set to, beside random ones. The message
  // must outlive the object.
  void Learn(const google::protobuf::Message& message);

  // Changes one field of the message or of a message in it.
  void Mutate(google::protobuf::Message& message);

  // Sets the message to a copy of a learnt one of its type, if there is one.
  void Replace(google::protobuf::Message& message);

  void MutateBytesOf(std::string& bytes);

  // Returns a number in 0 … count − 1; requires count > 0.
  size_t Choose(size_t count) { return random_() % count; }

 private:
  using Message = google::protobuf::Message;
  using Field = google::protobuf::FieldDescriptor;

  const Field* ChooseField(const Message& message);
  void MutateSingular(Message& message, const Field& field);
  void MutateRepeated(Message& message, const Field& field);
  void MutateElement(Message& message, const Field& field, int index);
  void AddElement(Message& message, const Field& field);
  double Double(double now);
  int64_t Integer(int64_t now);
  int Enumerator(const Field& field);
  std::string Text(std::string now);

  std::mt19937 random_;
  const MutateBytes mutate_bytes_;
  std::vector<std::string> words_;
  std::vector<const Message*> messages_;
};

}  // namespace polyest::internal
