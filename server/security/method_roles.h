#pragma once

// Says which role each method needs.

#include <google/protobuf/descriptor.h>

#include <string>
#include <string_view>
#include <vector>

#include "server/security/caller.h"

namespace polyest::internal {

// Is an entry of the one table of the services' methods, whose names no two services share. A
// method that is not in the table cannot be served: naming it does not compile, and the daemon does
// not start while one is missing.
//
// The methods of operations need no higher role than the computations that operations are. Whoever
// may start operations may also end them, because they could otherwise not make room for new ones.
struct MethodRole {
  std::string_view method;
  Role needed;
};

inline constexpr MethodRole kMethodRoles[] = {
    {"ListModels", Role::kReader},
    {"GetModel", Role::kReader},
    {"CheckProblem", Role::kReader},
    {"GetProblemSchema", Role::kReader},
    {"CreateSession", Role::kWriter},
    {"GetSession", Role::kReader},
    {"ListSessions", Role::kReader},
    {"DeleteSession", Role::kAdmin},
    {"ExportSession", Role::kAdmin},
    {"ImportSession", Role::kAdmin},
    {"AddMeasurements", Role::kWriter},
    {"GetEstimate", Role::kReader},
    {"GetHistory", Role::kReader},
    {"StreamMeasurements", Role::kWriter},
    {"WatchSession", Role::kReader},
    {"ComputeEstimate", Role::kReader},
    {"ComputePropagation", Role::kReader},
    {"ComputeCostGrid", Role::kReader},
    {"ComputeSensitivity", Role::kReader},
    {"ComputeExperimentDesign", Role::kReader},
    {"ComputePosterior", Role::kReader},
    {"ComputeCostProfiles", Role::kReader},
    {"ComputeLogDensity", Role::kReader},
    {"ComputeRegularizationSweep", Role::kReader},
    {"Predict", Role::kReader},
    {"StartComputation", Role::kReader},
    {"GetOperation", Role::kReader},
    {"ListOperations", Role::kReader},
    {"CancelOperation", Role::kReader},
    {"DeleteOperation", Role::kReader},
    {"GetStatus", Role::kReader},
    {"ListNodes", Role::kAdmin},
    {"DrainNode", Role::kOperator},
    {"DownloadBackup", Role::kOperator},
};

// Returns the entry of a method; null when there is none.
constexpr const MethodRole* FindMethodRole(std::string_view name) {
  for (const MethodRole& entry : kMethodRoles) {
    if (entry.method == name) return &entry;
  }
  return nullptr;
}

// Names a method of the contract, which is looked up while compiling.
class Method {
 public:
  // NOLINTNEXTLINE: implicit, so that a call reads Authorize(context, "GetModel").
  consteval Method(const char* name) : entry_(*FindMethodRole(name)) {}

  constexpr std::string_view name() const { return entry_.method; }
  constexpr Role needed() const { return entry_.needed; }

 private:
  const MethodRole& entry_;
};

using ServiceDescriptors = std::vector<const google::protobuf::ServiceDescriptor*>;

// Returns the services of polyest.v1.
ServiceDescriptors Services();

// Returns the path by which gRPC calls a method: "/polyest.v1.SessionService/GetSession".
std::string PathOf(Method method);
std::string PathOf(const google::protobuf::MethodDescriptor& method);

// Returns whether the table has one entry for every method of the services, and no others.
bool CoversAllMethods(const ServiceDescriptors& services);

}  // namespace polyest::internal
