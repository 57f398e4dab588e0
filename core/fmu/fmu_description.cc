#include "core/fmu/fmu_description.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <pugixml.hpp>

#include "core/common/status.h"
#include "core/external/clean_text.h"
#include "core/fmu/variable_list.h"

namespace polyest::internal {
namespace {

absl::StatusOr<int> Version(const pugi::xml_node& root) {
  const std::string version = root.attribute("fmiVersion").value();
  if (absl::StartsWith(version, "2.0")) return 2;
  if (absl::StartsWith(version, "3.0")) return 3;
  return WrongDescription(
      absl::StrFormat("fmiVersion \"%s\" is not supported; 2.0 and 3.0 are", version));
}

bool IsIdentifier(const std::string& name) {
  if (name.empty() || name.size() > 255) return false;
  for (const char c : name) {
    if (!absl::ascii_isalnum(static_cast<unsigned char>(c)) && c != '_') return false;
  }
  return true;
}

absl::Status ReadKind(const pugi::xml_node& root, FmuInterface& interface) {
  const pugi::xml_node exchange = root.child("ModelExchange");
  const pugi::xml_node simulation = root.child("CoSimulation");
  if (!exchange && !simulation) {
    return WrongDescription("the FMU offers neither Model Exchange nor Co-Simulation");
  }
  interface.kind = exchange ? FmuKind::kModelExchange : FmuKind::kCoSimulation;
  const pugi::xml_node element = exchange ? exchange : simulation;
  interface.identifier = element.attribute("modelIdentifier").value();
  if (!IsIdentifier(interface.identifier)) {
    return WrongDescription(absl::StrFormat("modelIdentifier \"%s\" must be a C identifier",
                                            CleanText(interface.identifier, 64)));
  }
  if (element.attribute("needsExecutionTool").as_bool()) {
    return WrongDescription("the FMU needs the tool that it was made with, which is not supported");
  }
  const bool is_2 = interface.version == 2;
  interface.needs_completed_step =
      is_2 ? !element.attribute("completedIntegratorStepNotNeeded").as_bool()
           : element.attribute("needsCompletedIntegratorStep").as_bool();
  interface.once_per_process = element.attribute("canBeInstantiatedOnlyOncePerProcess").as_bool();
  interface.can_save_state =
      element.attribute(is_2 ? "canGetAndSetFMUstate" : "canGetAndSetFMUState").as_bool();
  interface.can_interpolate_inputs = is_2 && element.attribute("canInterpolateInputs").as_bool();
  interface.can_vary_step = element.attribute("canHandleVariableCommunicationStepSize").as_bool();
  return absl::OkStatus();
}

absl::Status ReadCommunicationStep(const pugi::xml_node& root, FmuInterface& interface) {
  const pugi::xml_attribute step = root.child("DefaultExperiment").attribute("stepSize");
  const pugi::xml_attribute fixed = root.child("CoSimulation").attribute("fixedInternalStepSize");
  interface.communication_step_s = kDefaultCommunicationStep;
  if (step) interface.communication_step_s = step.as_double();
  if (!step && fixed) interface.communication_step_s = fixed.as_double();
  if (!(interface.communication_step_s > 1e-12 && interface.communication_step_s < 1e12)) {
    return WrongDescription(absl::StrFormat("stepSize \"%s\" must be above 0", step.value()));
  }
  return absl::OkStatus();
}

std::string SourceInWords(const pugi::xml_node& root) {
  std::string source = absl::StrCat("FMU ", root.attribute("modelName").value());
  const auto append = [&](const char* words, const char* attribute) {
    const std::string value = root.attribute(attribute).value();
    if (!value.empty()) absl::StrAppend(&source, words, value);
  };
  append(" version ", "version");
  append(" by ", "author");
  append(", exported with ", "generationTool");
  append(", ", "generationDateAndTime");
  return CleanText(source);
}

std::string Limitations(const FmuInterface& interface, const std::vector<std::string>& kept) {
  std::string text = KindInWords(interface);
  if (interface.kind == FmuKind::kCoSimulation) {
    absl::StrAppendFormat(&text, ", communication steps of at most %g s",
                          interface.communication_step_s);
  }
  if (kept.empty()) return text;
  constexpr size_t kMaxNamed = 8;
  const size_t named = std::min(kept.size(), kMaxNamed);
  absl::StrAppend(&text, "; these keep their start values: ",
                  absl::StrJoin(kept.begin(), kept.begin() + static_cast<ptrdiff_t>(named), ", "),
                  kept.size() > named ? absl::StrCat(" and ", kept.size() - named, " more") : "");
  return text;
}

}  // namespace

absl::StatusOr<FmuDescription> ParseFmuDescription(const std::string& name,
                                                   const std::string& xml) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(xml.data(), xml.size());
  if (!parsed) {
    return WrongDescription(absl::StrFormat("%s at byte %d", parsed.description(), parsed.offset));
  }
  const pugi::xml_node root = document.child("fmiModelDescription");
  if (!root) return WrongDescription("the root must be fmiModelDescription");
  FmuDescription description;
  FmuInterface& interface = description.interface;
  interface.name = name;
  POLYEST_ASSIGN_OR_RETURN(interface.version, Version(root));
  interface.token = root.attribute(interface.version == 2 ? "guid" : "instantiationToken").value();
  POLYEST_RETURN_IF_ERROR(ReadKind(root, interface));
  POLYEST_RETURN_IF_ERROR(ReadCommunicationStep(root, interface));
  POLYEST_ASSIGN_OR_RETURN(const VariableList variables,
                           VariableList::Read(root, interface.version));
  POLYEST_ASSIGN_OR_RETURN(const std::vector<std::string> kept,
                           variables.Sort(interface.kind, description));
  description.model.name = name;
  description.model.summary = CleanText(root.attribute("description").value());
  if (description.model.summary.empty()) {
    description.model.summary = CleanText(root.attribute("modelName").value());
  }
  description.model.equations = Limitations(interface, kept);
  description.model.source = SourceInWords(root);
  return description;
}

std::string LibraryPath(const FmuInterface& interface) {
  return absl::StrCat("binaries/", interface.version == 2 ? "linux64/" : "x86_64-linux/",
                      interface.identifier, ".so");
}

std::string KindInWords(const FmuInterface& interface) {
  return absl::StrCat(
      "FMI ", interface.version, ".0 ",
      interface.kind == FmuKind::kModelExchange ? "Model Exchange" : "Co-Simulation");
}

}  // namespace polyest::internal
