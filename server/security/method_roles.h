#pragma once

// Which role a call needs.

#include <google/protobuf/descriptor.h>

#include <string_view>

#include "server/security/caller.h"

namespace polyest {

// The one table of the service's methods. A method that is not in it cannot be served: naming it
// does not compile, and the daemon does not start while one is missing.
struct MethodRole {
  std::string_view method;
  Role needed;
};

inline constexpr MethodRole kMethodRoles[] = {
    {"ListModels", Role::kReader},       {"GetModel", Role::kReader},
    {"Estimate", Role::kReader},         {"Propagate", Role::kReader},
    {"EvaluateCost", Role::kReader},     {"AnalyzeSensitivity", Role::kReader},
    {"DesignExperiment", Role::kReader}, {"GetSession", Role::kReader},
    {"ListSessions", Role::kReader},     {"GetEstimate", Role::kReader},
    {"WatchSession", Role::kReader},     {"GetPosterior", Role::kReader},
    {"ProfileCost", Role::kReader},      {"SweepRegularization", Role::kReader},
    {"GetStatus", Role::kReader},        {"CreateSession", Role::kWriter},
    {"AddMeasurements", Role::kWriter},  {"StreamMeasurements", Role::kWriter},
    {"DeleteSession", Role::kAdmin},     {"ExportSession", Role::kAdmin},
    {"ImportSession", Role::kAdmin},
};

// Null when there is no such method.
constexpr const MethodRole* FindMethodRole(std::string_view name) {
  for (const MethodRole& entry : kMethodRoles) {
    if (entry.method == name) return &entry;
  }
  return nullptr;
}

// A method by its name in the contract, looked up while compiling.
class Method {
 public:
  // NOLINTNEXTLINE: implicit, so that a call reads Authorize(context, "GetModel").
  consteval Method(const char* name) : entry_(*FindMethodRole(name)) {}

  constexpr std::string_view name() const { return entry_.method; }
  constexpr Role needed() const { return entry_.needed; }

 private:
  const MethodRole& entry_;
};

// Whether the table has an entry for every method of the service, and no others.
bool CoversAllMethods(const google::protobuf::ServiceDescriptor& service);

}  // namespace polyest
