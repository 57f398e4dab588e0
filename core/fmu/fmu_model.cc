#include "core/fmu/fmu_model.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <utility>

#include "core/common/status.h"
#include "core/fmu/archive.h"
#include "core/fmu/fmu_equations.h"
#include "core/fmu/worker_ensemble.h"

namespace polyest::internal {
namespace {

constexpr char kDescriptionEntry[] = "modelDescription.xml";
constexpr int64_t kLongestDescription = int64_t{64} << 20;

absl::StatusOr<FmuDescription> ReadDescription(const Archive& archive, const std::string& name) {
  POLYEST_ASSIGN_OR_RETURN(const std::string xml,
                           archive.Read(kDescriptionEntry, kLongestDescription));
  POLYEST_ASSIGN_OR_RETURN(FmuDescription description, ParseFmuDescription(name, xml));
  const std::string library = LibraryPath(description.interface);
  if (!archive.Contains(library)) {
    return absl::FailedPreconditionError(
        absl::StrCat("the archive has no ", library, ": export it for 64-bit Linux"));
  }
  description.model.identity =
      absl::StrFormat("%s %08x", description.interface.token, archive.Checksum());
  return description;
}

absl::Status Annotate(const std::string& name, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat("fmu ", name, ": ", status.message()));
}

absl::Status UnpackInto(const std::filesystem::path& file, UnpackedFmu& fmu) {
  // The file may have been replaced since its description was read, or may be just being copied.
  const absl::StatusOr<Archive> archive = Archive::Open(file);
  if (!archive.ok()) return absl::UnavailableError(archive.status().message());
  const std::string& name = fmu.description.interface.name;
  const absl::StatusOr<FmuDescription> now = ReadDescription(*archive, name);
  if (!now.ok()) return absl::UnavailableError(now.status().message());
  if (now->model.identity != fmu.description.model.identity) {
    return absl::UnavailableError("the file was replaced in the meantime; try again");
  }
  POLYEST_ASSIGN_OR_RETURN(fmu.folder, TemporaryFolder::Make());
  return archive->Unpack(fmu.folder->path());
}

// Whether the folder still has the library: what cleans up temporary folders may have removed it.
bool IsThere(const UnpackedFmu& fmu) {
  std::error_code error;
  return std::filesystem::exists(fmu.folder->path() / LibraryPath(fmu.description.interface),
                                 error);
}

}  // namespace

absl::StatusOr<std::shared_ptr<const FmuModel>> FmuModel::Read(const std::filesystem::path& file,
                                                               const std::string& name,
                                                               const WorkerLimits& limits) {
  const absl::StatusOr<Archive> archive = Archive::Open(file);
  if (!archive.ok()) return Annotate(name, archive.status());
  absl::StatusOr<FmuDescription> description = ReadDescription(*archive, name);
  if (!description.ok()) return Annotate(name, description.status());
  return std::shared_ptr<const FmuModel>(new FmuModel(file, *std::move(description), limits));
}

std::shared_ptr<const UnpackedFmu> FmuModel::Unpack() const {
  const std::lock_guard lock(mutex_);
  if (unpacked_ != nullptr && IsThere(*unpacked_)) return unpacked_;
  auto fmu = std::make_shared<UnpackedFmu>();
  fmu->description = description_;
  fmu->status = Annotate(description_.interface.name, UnpackInto(file_, *fmu));
  // A failure, such as a full disk, is not kept, so the next use tries again.
  if (fmu->status.ok()) unpacked_ = fmu;
  return fmu;
}

std::unique_ptr<TrajectoryEnsemble> FmuModel::StartEnsemble(EnsembleSpecification specification,
                                                            const InputSignals* inputs) const {
  return std::make_unique<WorkerEnsemble>(Unpack(), std::move(specification), inputs, limits_);
}

std::string FmuModel::WhyNotFiltered() const {
  const FmuInterface& interface = description_.interface;
  if (interface.kind == FmuKind::kCoSimulation) {
    return "is an FMU for Co-Simulation, whose states cannot be set; export it for Model Exchange";
  }
  if (interface.event_indicators > 0) {
    return absl::StrCat("is an FMU with ", interface.event_indicators,
                        " event indicators; filters need a model without events");
  }
  if (interface.needs_completed_step) {
    return "is an FMU that must be told of completed steps, at which it may have events";
  }
  return "";
}

std::shared_ptr<PointEquations> FmuModel::StartEquations(const EnsembleSpecification& specification,
                                                         const InputSignals* inputs,
                                                         int points_together) const {
  return std::make_shared<FmuEquations>(Unpack(), specification, inputs, points_together, limits_);
}

}  // namespace polyest::internal
