#pragma once

// How this process talks to the workers that run an FMU (messages.h).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <span>
#include <string>
#include <vector>

#include "core/fmu/fmu_model.h"
#include "core/fmu/messages.h"
#include "core/fmu/worker_process.h"
#include "core/propagation/trajectory_ensemble.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns what a worker must know of these rows of an ensemble but for its inputs and blocks.
StartMessage StartOf(const UnpackedFmu& fmu, const EnsembleSpecification& specification,
                     const std::vector<int>& rows);

// Returns those rows of the matrix; an empty matrix of an empty one.
Matrix RowsOf(const Matrix& matrix, const std::vector<int>& rows);

// Exchanges data until each of the workers has given the answer that it owes. Fails on a stop
// request, or if a worker is lost.
absl::Status Converse(std::span<WorkerProcess* const> workers, const Stop& stop);

// Returns the error of a worker's answer that cannot be one.
absl::Status DamagedAnswer(const std::string& fmu);

// Reads the answer of a worker that was started with `rows` rows. Returns FailedPrecondition with
// the worker's error, or if the answer is none. Texts of the FMU are cleaned.
absl::StatusOr<ResultMessage> ReadResult(const std::string& fmu, WorkerProcess& worker,
                                         Eigen::Index rows);

}  // namespace polyest::internal
