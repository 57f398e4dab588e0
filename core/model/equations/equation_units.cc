#include "core/model/equations/equation_units.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <optional>
#include <utility>

#include "core/common/field_error.h"
#include "core/model/equations/unit_check.h"
#include "core/model/units.h"

namespace polyest::internal::equations {
namespace {

class ModelUnits {
 public:
  ModelUnits(const EquationSpecification& specification, const ReadEquations& read,
             std::vector<absl::Status>& problems)
      : specification_(specification), read_(read), problems_(problems) {}

  std::map<std::string, std::string> Run() {
    // A specification without units is not checked: it may contain sin(t), although t is in s.
    if (specification_.units.empty()) return {};
    ReadGiven();
    if (!problems_.empty()) return {};
    SetInitialUnits();
    const Unit second = *ParseUnit("s");
    units_["t"] = second;
    for (const Definition& definition : read_.intermediates) {
      const std::optional<Unit> unit = Check(definition, Find(definition.name), "");
      if (unit) units_.emplace(definition.name, *unit);
    }
    for (const Definition& definition : read_.states) {
      const std::optional<Unit> unit = Find(definition.name);
      Check(definition, unit ? std::optional(*unit / second) : std::nullopt,
            absl::StrCat(", that of ", definition.name, " per s"));
    }
    std::map<std::string, std::string> outputs;
    for (const Definition& definition : read_.outputs) {
      const std::optional<Unit> unit = Check(definition, Find(definition.name), "");
      if (unit) outputs[definition.name] = InWords(definition.name, *unit);
    }
    return outputs;
  }

 private:
  void ReadGiven() {
    for (const auto& [name, text] : specification_.units) {
      absl::StatusOr<Unit> unit = ParseUnit(text);
      if (unit.ok()) {
        units_[name] = *unit;
      } else {
        Wrong(UnitOf(name), std::string(unit.status().message()));
      }
    }
  }

  void SetInitialUnits() {
    for (const Definition& state : read_.states) {
      const std::optional<Unit> unit = Find(state.name);
      if (!unit) continue;
      const std::string initial = InitialName(state.name);
      const auto [given, is_new] = units_.emplace(initial, *unit);
      if (is_new || SameUnit(given->second, *unit)) continue;
      Wrong(UnitOf(initial), absl::StrFormat("is \"%s\"; it must be that of its state %s, \"%s\"",
                                             specification_.units.at(initial), state.name,
                                             specification_.units.at(state.name)));
    }
  }

  std::optional<Unit> Find(const std::string& name) const {
    const auto found = units_.find(name);
    return found == units_.end() ? std::nullopt : std::optional(found->second);
  }

  // Returns the expected unit if it is known, else the unit of the expression. Reports a difference
  // between the two.
  std::optional<Unit> Check(const Definition& definition, const std::optional<Unit>& expected,
                            std::string_view reason) {
    const absl::StatusOr<std::optional<Unit>> unit = InferUnit(definition.syntax, units_);
    if (!unit.ok()) {
      problems_.push_back(unit.status());
      return expected;
    }
    if (expected && *unit && !SameUnit(**unit, *expected)) {
      Wrong(definition.syntax.field,
            absl::StrFormat("the expression has the unit %s; it must have %s%s", FormatUnit(**unit),
                            FormatUnit(*expected), reason));
    }
    return expected ? expected : *unit;
  }

  // Returns the unit as the user wrote it, for this name or for another of the same unit.
  std::string InWords(const std::string& name, const Unit& unit) const {
    if (const auto given = specification_.units.find(name); given != specification_.units.end()) {
      return given->second;
    }
    for (const auto& [other, text] : specification_.units) {
      if (SameUnit(units_.at(other), unit)) return text;
    }
    return FormatUnit(unit);
  }

  static FieldPath UnitOf(const std::string& name) {
    return {"model", "equations", "units", FieldStep::Key(name)};
  }

  void Wrong(const FieldPath& path, const std::string& rule) {
    problems_.push_back(InvalidField(path, rule));
  }

  const EquationSpecification& specification_;
  const ReadEquations& read_;
  std::vector<absl::Status>& problems_;
  std::map<std::string, Unit> units_;
};

}  // namespace

std::map<std::string, std::string> CheckUnits(const EquationSpecification& specification,
                                              const ReadEquations& read,
                                              std::vector<absl::Status>& problems) {
  return ModelUnits(specification, read, problems).Run();
}

}  // namespace polyest::internal::equations
