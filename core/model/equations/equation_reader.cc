#include "core/model/equations/equation_reader.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/common/field_error.h"
#include "core/model/equations/functions.h"
#include "core/model/equations/limits.h"
#include "core/model/equations/text_error.h"

namespace polyest::internal::equations {
namespace {

FieldPath Path(const char* member) { return {"model", "equations", member}; }

FieldPath Path(const char* member, const std::string& name) {
  return Path(member).Then(
      {IsName(name) ? FieldStep::Key(name) : FieldStep(FieldStep::Kind::kIndex, Quoted(name))});
}

class Reader {
 public:
  Reader(const EquationSpecification& specification, std::vector<absl::Status>& problems)
      : specification_(specification), problems_(problems) {}

  ReadEquations Run() {
    CheckSizes();
    if (!problems_.empty()) return {};
    ReadTables();
    Declare();
    if (specification_.outputs.empty()) Wrong(Path("outputs"), "there must be at least one");
    ReadAll("states", specification_.states, read_.states);
    ReadAll("intermediates", specification_.intermediates, read_.intermediates);
    ReadAll("outputs", specification_.outputs, read_.outputs);
    if (absl::Status status = SortByDependency(read_.intermediates); !status.ok()) {
      problems_.push_back(std::move(status));
    }
    ReadParameters();
    CheckUnitNames();
    return std::move(read_);
  }

 private:
  void CheckSizes();
  void CheckSize(const FieldPath& path, size_t size, size_t most, const char* what = "");
  void ReadTables();
  void Declare();
  void Declare(const FieldPath& path, const char* member, const std::string& name,
               const std::string& what);
  void DeclareOutput(const std::string& name);
  void ReadAll(const char* member, const std::map<std::string, std::string>& texts,
               std::vector<Definition>& definitions);
  void ReadNames(const Syntax& syntax);
  void ReadParameters();
  void CheckUnitNames();

  void Wrong(const FieldPath& path, const std::string& rule) {
    problems_.push_back(InvalidField(path, rule));
  }

  const EquationSpecification& specification_;
  std::vector<absl::Status>& problems_;
  ReadEquations read_;
  std::map<std::string, std::string> declared_;  // what each name is: "a state"
  std::map<std::string, int> table_arguments_;
  std::set<std::string> free_;  // undeclared names that become parameters
  bool all_read_ = true;        // false: an expression that cannot be read may have more of them
};

// Refuses more than `most` items with ResourceExhausted. In the message `what` follows the number
// of items.
void Reader::CheckSize(const FieldPath& path, size_t size, size_t most, const char* what) {
  if (size <= most) return;
  problems_.push_back(
      FieldError(absl::StatusCode::kResourceExhausted, path,
                 absl::StrFormat("there are %d%s; at most %d are allowed", size, what, most)));
}

void Reader::CheckSizes() {
  const auto& [states, outputs, intermediates, parameters, inputs, units, tables] = specification_;
  CheckSize(Path("states"), states.size(), kMaxStates);
  CheckSize("model.equations", states.size() + outputs.size() + intermediates.size(),
            kMaxExpressions);
  CheckSize(Path("parameters"), parameters.size(), kMaxNames);
  CheckSize(Path("inputs"), inputs.size(), kMaxNames);
  CheckSize(Path("units"), units.size(), kMaxNames);
  CheckSize(Path("tables"), tables.size(), kMaxTables);
  size_t text = 0, values = 0;
  for (const auto* texts : {&states, &outputs, &intermediates}) {
    for (const auto& [name, expression] : *texts) text += expression.size();
  }
  if (text > kMaxTextInAll) {
    problems_.push_back(FieldError(
        absl::StatusCode::kResourceExhausted, "model.equations",
        absl::StrFormat("the expressions have %d bytes in all; at most %d", text, kMaxTextInAll)));
  }
  for (const auto& [name, table] : tables) {
    const size_t size = std::max({table.value.size(), table.x.size(), table.y.size()});
    CheckSize(Path("tables", name), size, kMaxTableValues, " values");
    values += size;
  }
  CheckSize(Path("tables"), values, kMaxTableValuesInAll, " values in all");
}

void Reader::ReadTables() {
  for (const auto& [name, table] : specification_.tables) {
    table_arguments_[name] = table.y.empty() ? 1 : 2;
    if (const absl::Status problem = CheckTable(table); !problem.ok()) {
      problems_.push_back(Within(Path("tables", name), problem));
      continue;
    }
    read_.table_index[name] = static_cast<int>(read_.tables.size());
    read_.tables.emplace_back(table);
  }
}

void Reader::Declare(const FieldPath& path, const char* member, const std::string& name,
                     const std::string& what) {
  if (!IsName(name)) {
    return Wrong(Path(member),
                 absl::StrFormat("%s is not a name: a letter, then letters, digits and _, at most "
                                 "%d of them",
                                 Quoted(name), kMaxNameLength));
  }
  if (IsReserved(name)) {
    return Wrong(path, absl::StrFormat("%s means something else in an expression: t, pi and the "
                                       "names of functions are reserved",
                                       name));
  }
  const auto [other, is_new] = declared_.emplace(name, what);
  if (!is_new) Wrong(path, absl::StrFormat("%s is %s already", name, other->second));
}

void Reader::Declare() {
  const EquationSpecification& s = specification_;
  for (const auto& [name, text] : s.states)
    Declare(Path("states", name), "states", name, "a state");
  for (size_t i = 0; i < s.inputs.size(); ++i) {
    Declare(Path("inputs").Then({i}), "inputs", s.inputs[i], "an input");
  }
  for (const auto& [name, text] : s.intermediates) {
    Declare(Path("intermediates", name), "intermediates", name, "an intermediate");
  }
  for (const auto& [name, table] : s.tables)
    Declare(Path("tables", name), "tables", name, "a table");
  for (const auto& [name, value] : s.parameters) {
    Declare(Path("parameters", name), "parameters", name, "a parameter");
  }
  for (const auto& [name, text] : s.states) {
    const std::string initial = InitialName(name);
    const auto found = declared_.find(initial);
    if (found == declared_.end()) {
      declared_[initial] = "the initial value of the state " + name;
    } else if (found->second != "a parameter") {
      Wrong(Path("states", name),
            absl::StrFormat("its initial value is named %s, which is %s", initial, found->second));
    }
  }
  for (const auto& [name, text] : s.outputs) DeclareOutput(name);
}

// An output may share its name with a state or an intermediate, since it usually equals that one.
// In expressions the name means the state or the intermediate.
void Reader::DeclareOutput(const std::string& name) {
  const auto found = declared_.find(name);
  const bool shared = found != declared_.end() &&
                      (found->second == "a state" || found->second == "an intermediate");
  if (!shared) Declare(Path("outputs", name), "outputs", name, "an output");
}

void Reader::ReadAll(const char* member, const std::map<std::string, std::string>& texts,
                     std::vector<Definition>& definitions) {
  for (const auto& [name, text] : texts) {
    absl::StatusOr<Syntax> syntax = Parse(Path(member, name), text, table_arguments_);
    if (!syntax.ok()) {
      problems_.push_back(std::move(syntax).status());
      all_read_ = false;
      continue;
    }
    ReadNames(*syntax);
    definitions.push_back({name, *std::move(syntax)});
  }
}

void Reader::ReadNames(const Syntax& syntax) {
  for (const SyntaxNode& node : syntax.nodes) {
    if (node.operation != Operation::kVariable || node.name == "t") continue;
    const auto found = declared_.find(node.name);
    if (found == declared_.end() && !IsName(node.name)) {
      problems_.push_back(ErrorAt(
          syntax.field, syntax.text, node.offset,
          absl::StrFormat("%s is not a name of a model; those with a point are of its channels",
                          node.name)));
      return;
    }
    if (found == declared_.end()) {
      free_.insert(node.name);
    } else if (found->second == "an output") {
      problems_.push_back(ErrorAt(
          syntax.field, syntax.text, node.offset,
          absl::StrFormat("%s is an output; what others use is an intermediate", node.name)));
      return;
    }
  }
}

void Reader::ReadParameters() {
  const auto& defaults = specification_.parameters;
  const auto unit = [this](const std::string& name) {
    const auto found = specification_.units.find(name);
    return found == specification_.units.end() ? std::string() : found->second;
  };
  std::set<std::string> names = free_;
  for (const auto& [name, value] : defaults) {
    names.insert(name);
    if (!std::isfinite(value)) {
      Wrong(Path("parameters", name), absl::StrFormat("is %g; it must be finite", value));
    }
  }
  for (const auto& [state, text] : specification_.states) names.erase(InitialName(state));
  CheckSize(Path("parameters"), names.size(), kMaxNames);
  for (const std::string& name : names) {
    const auto found = defaults.find(name);
    const bool has_default = found != defaults.end();
    read_.parameters.push_back(
        {name, unit(name), "", has_default ? found->second : 0.0, has_default});
  }
  for (const auto& [state, text] : specification_.states) {
    const std::string name = InitialName(state);
    const auto found = defaults.find(name);
    read_.parameters.push_back({name, unit(specification_.units.contains(state) ? state : name),
                                "initial value of " + state,
                                found == defaults.end() ? 0.0 : found->second});
  }
  read_.inputs = specification_.inputs;
}

void Reader::CheckUnitNames() {
  for (const auto& [name, unit] : specification_.units) {
    const auto found = declared_.find(name);
    const bool known =
        found == declared_.end() ? !all_read_ || free_.contains(name) : found->second != "a table";
    if (known) continue;
    Wrong(Path("units"), absl::StrFormat("%s is not a name in these equations", Quoted(name)));
  }
}

}  // namespace

std::string InitialName(const std::string& state) { return state + "_0"; }

ReadEquations Read(const EquationSpecification& specification,
                   std::vector<absl::Status>& problems) {
  return Reader(specification, problems).Run();
}

}  // namespace polyest::internal::equations
