#pragma once

// Checks the style of polyest.v1, as rules over its descriptors.

#include <google/protobuf/descriptor.h>

#include <set>
#include <string>
#include <vector>

namespace polyest::internal {

// Walks through files that were read with their comments and notes what breaks a rule.
class ContractStyle {
 public:
  // The fields that a rule would rename or forbid and that stay, by full name without the package.
  using Exceptions = std::set<std::string>;

  explicit ContractStyle(Exceptions exceptions) : exceptions_(std::move(exceptions)) {}

  void Check(const google::protobuf::FileDescriptor& file);

  // Returns a line for each breach: "Session.idle_time: …".
  const std::vector<std::string>& breaches() const { return breaches_; }
  // Returns the exceptions that no rule has asked for.
  Exceptions Unused() const;

 private:
  void CheckMessage(const google::protobuf::Descriptor& message);
  void CheckField(const google::protobuf::FieldDescriptor& field);
  void CheckEnum(const google::protobuf::EnumDescriptor& enumeration);
  void CheckService(const google::protobuf::ServiceDescriptor& service);
  void CheckMethod(const google::protobuf::MethodDescriptor& method);
  void CheckStreamed(const google::protobuf::Descriptor& message,
                     std::set<const google::protobuf::Descriptor*>& seen);

  template <typename Element>
  void CheckComment(const Element& element, const std::string& name);
  void Note(const std::string& name, const std::string& breach);
  void NoteUnlessExcepted(const std::string& name, const std::string& breach);

  const Exceptions exceptions_;
  Exceptions used_;
  std::set<std::string> methods_;
  std::vector<std::string> breaches_;
};

}  // namespace polyest::internal
