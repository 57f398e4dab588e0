#pragma once

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>
#include <string>

#include "client/paper/experiments.h"

namespace polyest::internal {

// Returns the result of a figure's experiment, which runs once per program.
inline const ExperimentResult& Rerun(const std::string& figure) {
  static std::map<std::string, ExperimentResult> results;
  const auto known = results.find(figure);
  if (known != results.end()) return known->second;
  absl::StatusOr<Experiment> experiment = MakeExperiment(figure);
  if (!experiment.ok()) throw std::runtime_error(experiment.status().ToString());
  absl::StatusOr<ExperimentResult> result = RunExperiment(*experiment, 1);
  if (!result.ok()) throw std::runtime_error(result.status().ToString());
  return results.emplace(figure, *std::move(result)).first->second;
}

inline bool HasDiagnostic(const Estimate& estimate, DiagnosticCode code) {
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    if (diagnostic.code == code) return true;
  }
  return false;
}

}  // namespace polyest::internal
