#include "core/model/equations/equation_model.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <optional>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/model/equations/differentiate.h"
#include "core/model/equations/equation_reader.h"
#include "core/model/equations/equation_units.h"
#include "core/model/equations/limits.h"
#include "core/model/equations/program.h"
#include "core/model/equations/structure.h"
#include "core/model/equations/switches.h"
#include "core/model/switching_model.h"

namespace polyest::internal {
namespace equations {
namespace {

enum BlockNumber { kStatesBlock, kParametersBlock, kInputsBlock, kModesBlock };
constexpr int kTimeVariable = 0;  // index of the variable t

// The programs of equations that switch, with frozen modes.
struct SwitchingPrograms {
  std::vector<SwitchKind> kinds;
  bool changes_at_rest = false;
  Program derivatives, outputs, arguments, slopes;
};

struct Programs {
  Program initial, derivatives, outputs;
  std::optional<Program> jacobian;
  Structure structure;  // of the derivatives
  std::vector<VariablePlace> places;
  SwitchingPrograms switching;
};

class EquationModel final : public StateSpaceModel, public SwitchingModel {
 public:
  EquationModel(ModelDescription description, std::vector<Lookup> tables)
      : description_(std::move(description)), tables_(std::move(tables)) {}

  const std::vector<Lookup>& tables() const { return tables_; }
  void set_programs(Programs programs) { programs_ = std::move(programs); }

  const ModelDescription& description() const override { return description_; }

  void InitialStates(const ConstBlock& parameters, Block states) const override {
    Run(programs_.initial, 0, parameters, parameters, parameters, states);
  }

  void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock& inputs, Block derivatives) const override {
    CheckShapes(states, parameters, inputs);
    Run(programs_.derivatives, time_s, states, parameters, inputs, derivatives);
  }

  void Outputs(double time_s, const ConstBlock& states, const ConstBlock& parameters,
               const ConstBlock& inputs, Block outputs) const override {
    CheckShapes(states, parameters, inputs);
    POLYEST_CHECK(outputs.rows() == parameters.rows());
    Run(programs_.outputs, time_s, states, parameters, inputs, outputs);
  }

  bool uses_time() const override { return programs_.structure.Uses(kTimeVariable); }

  bool IsLinear(const std::vector<bool>& zero_parameters,
                const std::vector<bool>& constant_inputs) const override {
    const auto form_of = [&](const VariablePlace& place) {
      const auto column = static_cast<size_t>(place.column);
      switch (place.block) {
        case kStatesBlock:
          return Form::kLinear;
        case kParametersBlock:
          return zero_parameters[column] ? Form::kZero : Form::kFixed;
        case kInputsBlock:
          return constant_inputs[column] ? Form::kFixed : Form::kLinear;
        default:  // the time
          return Form::kOther;
      }
    };
    std::vector<Form> forms;
    for (const VariablePlace& place : programs_.places) forms.push_back(form_of(place));
    return programs_.structure.Highest(forms) <= Form::kLinear;
  }

  bool has_state_jacobian() const override { return programs_.jacobian.has_value(); }

  void StateJacobian(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                     const ConstBlock& inputs, Block jacobian) const override {
    POLYEST_CHECK(has_state_jacobian());
    CheckShapes(states, parameters, inputs);
    Run(*programs_.jacobian, time_s, states, parameters, inputs, jacobian);
  }

  std::span<const SwitchKind> switches() const override { return programs_.switching.kinds; }
  bool changes_at_rest() const override { return programs_.switching.changes_at_rest; }
  void FrozenDerivatives(const SwitchingPoint& at, Block derivatives) const override {
    RunFrozen(programs_.switching.derivatives, at, derivatives);
  }
  void FrozenOutputs(const SwitchingPoint& at, Block outputs) const override {
    RunFrozen(programs_.switching.outputs, at, outputs);
  }
  void Arguments(const SwitchingPoint& at, Block arguments) const override {
    RunFrozen(programs_.switching.arguments, at, arguments);
  }
  void ArgumentSlopes(const SwitchingPoint& at, Block slopes) const override {
    RunFrozen(programs_.switching.slopes, at, slopes);
  }

 private:
  // A block without columns may have any number of rows, since none of it is read.
  void CheckShapes(const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock& inputs) const {
    const auto fits = [&parameters](const ConstBlock& block, size_t columns) {
      return block.cols() == static_cast<Eigen::Index>(columns) &&
             (columns == 0 || block.rows() == parameters.rows());
    };
    POLYEST_CHECK(fits(states, description_.states.size()));
    POLYEST_CHECK(fits(parameters, description_.parameters.size()));
    POLYEST_CHECK(fits(inputs, description_.inputs.size()));
  }

  static void Run(const Program& program, double time_s, const ConstBlock& states,
                  const ConstBlock& parameters, const ConstBlock& inputs, Block& results) {
    POLYEST_CHECK(results.cols() == program.results());
    POLYEST_CHECK(results.cols() == 0 || results.rows() == parameters.rows());
    const std::array<const ConstBlock*, 3> blocks = {&states, &parameters, &inputs};
    program.Run(time_s, blocks, results);
  }

  void RunFrozen(const Program& program, const SwitchingPoint& at, Block& results) const {
    CheckShapes(at.states, at.parameters, at.inputs);
    POLYEST_CHECK(at.modes.cols() == 1 + std::ssize(programs_.switching.kinds));
    POLYEST_CHECK(at.modes.rows() == results.rows() && results.cols() == program.results());
    const std::array<const ConstBlock*, 4> blocks = {&at.states, &at.parameters, &at.inputs,
                                                     &at.modes};
    program.Run(0, blocks, results);  // the time is in the first column of the modes
  }

  const ModelDescription description_;
  const std::vector<Lookup> tables_;
  Programs programs_;
};

// Builds the graph of all expressions of a model and compiles the programs.
class Assembly {
 public:
  explicit Assembly(const ReadEquations& read) : read_(read) {}

  absl::Status Assemble();
  Programs Compile(const std::vector<Lookup>& tables);

 private:
  NodeId Variable(const std::string& name, VariablePlace place);
  absl::StatusOr<std::vector<NodeId>> LowerAll(const std::vector<Definition>& definitions);
  SwitchingPrograms CompileSwitching(const std::vector<Lookup>& tables) const;

  const ReadEquations& read_;
  Graph graph_{kMaxNodes};
  std::map<std::string, NodeId> names_;
  std::vector<VariablePlace> places_;
  std::vector<NodeId> states_, initial_, derivatives_, outputs_;
};

NodeId Assembly::Variable(const std::string& name, VariablePlace place) {
  places_.push_back(place);
  return names_[name] = graph_.Variable(static_cast<int>(places_.size()) - 1);
}

absl::StatusOr<std::vector<NodeId>> Assembly::LowerAll(const std::vector<Definition>& definitions) {
  std::vector<NodeId> nodes;
  for (const Definition& definition : definitions) {
    POLYEST_ASSIGN_OR_RETURN(const NodeId node,
                             Lower(definition.syntax, names_, read_.table_index, graph_));
    nodes.push_back(node);
  }
  return nodes;
}

absl::Status Assembly::Assemble() {
  Variable("t", {VariablePlace::kTime, 0});
  Eigen::Index column = 0;
  for (const Definition& state : read_.states) {
    states_.push_back(Variable(state.name, {kStatesBlock, column++}));
  }
  column = 0;
  for (const std::string& input : read_.inputs) Variable(input, {kInputsBlock, column++});
  column = 0;
  for (const Quantity& parameter : read_.parameters) {
    Variable(parameter.name, {kParametersBlock, column++});
  }
  for (const Definition& state : read_.states) {
    initial_.push_back(names_.at(InitialName(state.name)));
  }
  for (const Definition& intermediate : read_.intermediates) {
    POLYEST_ASSIGN_OR_RETURN(names_[intermediate.name],
                             Lower(intermediate.syntax, names_, read_.table_index, graph_));
  }
  POLYEST_ASSIGN_OR_RETURN(derivatives_, LowerAll(read_.states));
  POLYEST_ASSIGN_OR_RETURN(outputs_, LowerAll(read_.outputs));
  return absl::OkStatus();
}

Programs Assembly::Compile(const std::vector<Lookup>& tables) {
  Programs programs{Program(graph_, initial_, places_, tables),
                    Program(graph_, derivatives_, places_, tables, kParametersBlock),
                    Program(graph_, outputs_, places_, tables, kParametersBlock),
                    std::nullopt,
                    Structure(graph_, derivatives_),
                    places_,
                    CompileSwitching(tables)};
  if (states_.empty()) return programs;
  graph_.set_most_nodes(kMaxJacobianNodes);
  const std::vector<NodeId> jacobian = Differentiate(graph_, derivatives_, states_);
  if (graph_.exhausted()) return programs;
  programs.jacobian = Program(graph_, jacobian, places_, tables, kParametersBlock);
  if (programs.jacobian->registers() > kMaxRegisters) programs.jacobian.reset();
  return programs;
}

// Compiles the programs with frozen modes. Equations too large for that are integrated as if they
// were smooth, as are those that do not switch.
SwitchingPrograms Assembly::CompileSwitching(const std::vector<Lookup>& tables) const {
  if (states_.empty() || !MaySwitch(graph_, derivatives_)) return {};
  Graph graph = graph_;
  graph.set_most_nodes(kMaxJacobianNodes);
  std::vector<VariablePlace> places = places_;
  const auto add_mode = [&graph, &places] {
    Eigen::Index column = 0;
    for (const VariablePlace& place : places) column += place.block == kModesBlock ? 1 : 0;
    places.push_back({kModesBlock, column});
    return graph.Variable(static_cast<int>(places.size()) - 1);
  };
  std::vector<NodeId> variables = {add_mode()};  // of the arguments: time, states, inputs
  std::vector<NodeId> parameters;
  for (const Quantity& parameter : read_.parameters)
    parameters.push_back(names_.at(parameter.name));
  SwitchFreezer freezer(graph, names_.at("t"), variables.front(), parameters, add_mode);
  const std::vector<NodeId> derivatives = freezer.Freeze(derivatives_, true);
  const std::vector<NodeId> outputs = freezer.Freeze(outputs_, false);
  variables.insert(variables.end(), states_.begin(), states_.end());
  for (const std::string& input : read_.inputs) variables.push_back(names_.at(input));
  const std::vector<NodeId> slopes = Differentiate(graph, freezer.arguments(), variables);
  if (graph.exhausted() || freezer.kinds().size() > kMaxSwitches) return {};
  const auto compile = [&](const std::vector<NodeId>& roots) {
    return Program(graph, roots, places, tables, kParametersBlock);
  };
  SwitchingPrograms programs{
      freezer.kinds(), false, compile(derivatives), compile(outputs), compile(freezer.arguments()),
      compile(slopes)};
  // The arguments of the switches may depend on the time where the frozen derivatives do not.
  const NodeId time = names_.at("t");
  programs.changes_at_rest = !read_.inputs.empty() || DependOn(graph_, derivatives_, time);
  for (const Program* program :
       {&programs.derivatives, &programs.outputs, &programs.arguments, &programs.slopes}) {
    if (program->registers() > kMaxRegisters) return {};
  }
  return programs;
}

ModelDescription Describe(const EquationSpecification& specification, const ReadEquations& read,
                          const std::map<std::string, std::string>& output_units) {
  const auto unit = [&specification](const std::string& name) {
    const auto found = specification.units.find(name);
    return found == specification.units.end() ? std::string() : found->second;
  };
  ModelDescription description;
  description.name = "equations";
  description.summary = "Equations given as text";
  const auto append = [&description](const std::string& left, const std::string& right) {
    absl::StrAppend(&description.equations, description.equations.empty() ? "" : "; ", left, " = ",
                    right);
  };
  for (const Definition& state : read.states) {
    description.states.push_back({state.name, unit(state.name), ""});
    append("d" + state.name + "/dt", state.syntax.text);
  }
  for (const Definition& intermediate : read.intermediates) {
    append(intermediate.name, intermediate.syntax.text);
  }
  for (const Definition& output : read.outputs) {
    const auto output_unit = output_units.find(output.name);
    description.outputs.push_back(
        {output.name, output_unit == output_units.end() ? "" : output_unit->second, ""});
    append(output.name, output.syntax.text);
  }
  for (const std::string& input : read.inputs) {
    description.inputs.push_back({input, unit(input), ""});
  }
  description.parameters = read.parameters;
  return description;
}

std::shared_ptr<const StateSpaceModel> Make(const EquationSpecification& specification,
                                            std::vector<absl::Status>& problems) {
  const ReadEquations read = Read(specification, problems);
  if (!problems.empty()) return nullptr;
  const std::map<std::string, std::string> output_units = CheckUnits(specification, read, problems);
  Assembly assembly(read);
  if (absl::Status status = assembly.Assemble(); !status.ok()) {
    problems.push_back(std::move(status));
  }
  if (!problems.empty()) return nullptr;
  auto model =
      std::make_shared<EquationModel>(Describe(specification, read, output_units), read.tables);
  Programs programs = assembly.Compile(model->tables());
  const int registers = std::max(programs.derivatives.registers(), programs.outputs.registers());
  if (registers > kMaxRegisters) {
    problems.push_back(
        FieldError(absl::StatusCode::kResourceExhausted, "model.equations",
                   absl::StrCat("needs ", registers, " intermediate values at once; at most ",
                                kMaxRegisters, " are allowed")));
    return nullptr;
  }
  model->set_programs(std::move(programs));
  return model;
}

}  // namespace
}  // namespace equations

std::vector<absl::Status> CheckEquations(const EquationSpecification& specification) {
  std::vector<absl::Status> problems;
  equations::Make(specification, problems);
  return problems;
}

}  // namespace polyest::internal

namespace polyest {

using namespace internal;

absl::StatusOr<std::shared_ptr<const StateSpaceModel>> MakeEquationModel(
    const EquationSpecification& specification) {
  std::vector<absl::Status> problems;
  std::shared_ptr<const StateSpaceModel> model = equations::Make(specification, problems);
  if (!problems.empty()) return problems.front();
  return model;
}

}  // namespace polyest
