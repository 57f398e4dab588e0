// Makes whole models, and tied parameters, of arbitrary bytes. None may crash the library, hang it
// or make it ask for more memory than its limits allow.
//
// Each line of the input is an entry of the specification, by its first character:
//   s name=text   a state          o name=text   an output     i name=text   an intermediate
//   p name        a parameter      u name        an input      d name=unit   a unit
//   l numbers     a linear table f of these values             c numbers     a spline g likewise
// Any other line is an output.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/common/check.h"
#include "core/model/equations/equation_model.h"
#include "core/model/equations/expressions.h"

namespace {

using polyest::EquationSpecification;
using polyest::LookupTable;

LookupTable Table(std::string_view numbers, bool spline) {
  LookupTable table{.spline = spline};
  for (const char c : numbers) {
    table.x.push_back(static_cast<double>(table.x.size()));
    table.value.push_back(static_cast<double>(c));
  }
  return table;
}

void AddLine(std::string_view line, EquationSpecification& equations) {
  const std::string_view rest = line.size() > 2 ? line.substr(2) : std::string_view();
  const size_t equals = rest.find('=');
  const std::string name(rest.substr(0, equals));
  const std::string text(equals == rest.npos ? std::string_view() : rest.substr(equals + 1));
  switch (line.empty() ? ' ' : line[0]) {
    case 's':
      equations.states[name] = text;
      return;
    case 'o':
      equations.outputs[name] = text;
      return;
    case 'i':
      equations.intermediates[name] = text;
      return;
    case 'p':
      equations.parameters[name] = 1;
      return;
    case 'u':
      equations.inputs.push_back(name);
      return;
    case 'd':
      equations.units[name] = text;
      return;
    case 'l':
      equations.tables["f"] = Table(rest, false);
      return;
    case 'c':
      equations.tables["g"] = Table(rest, true);
      return;
    default:
      equations.outputs["y" + std::to_string(equations.outputs.size())] = line;
  }
}

void Evaluate(const polyest::StateSpaceModel& model) {
  constexpr Eigen::Index kRows = 64;
  const polyest::ModelDescription& description = model.description();
  const auto varied = [](size_t columns) -> Eigen::ArrayXXd {
    return Eigen::ArrayXXd::Random(kRows, static_cast<Eigen::Index>(columns));
  };
  const Eigen::ArrayXXd parameters = varied(description.parameters.size());
  const Eigen::ArrayXXd inputs = varied(description.inputs.size());
  Eigen::ArrayXXd states = varied(description.states.size());
  Eigen::ArrayXXd rates(kRows, states.cols()), jacobian(kRows, states.cols() * states.cols());
  Eigen::ArrayXXd outputs = varied(description.outputs.size());
  model.Derivatives(0.5, states, parameters, inputs, rates);
  model.Outputs(0.5, states, parameters, inputs, outputs);
  if (model.has_state_jacobian()) {
    model.StateJacobian(0.5, states, parameters, inputs, jacobian);
  }
  model.InitialStates(parameters, states);
}

// Ties parameters by the expressions of the intermediates.
void Tie(const EquationSpecification& equations) {
  const auto expressions = polyest::internal::Expressions::Make("derived", equations.intermediates,
                                                                {"k1", "m", "u.delay"});
  if (!expressions.ok()) return;
  const polyest::Matrix variables = polyest::Matrix::Random(5, 3);
  polyest::Matrix results(5, std::ssize(expressions->names()));
  expressions->Evaluate(variables, results);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  EquationSpecification equations;
  for (size_t begin = 0; begin <= bytes.size();) {
    const size_t end = std::min(bytes.find('\n', begin), bytes.size());
    AddLine(bytes.substr(begin, end - begin), equations);
    begin = end + 1;
  }
  const auto model = polyest::MakeEquationModel(equations);
  POLYEST_CHECK(model.ok() == polyest::internal::CheckEquations(equations).empty());
  if (model.ok()) Evaluate(**model);
  Tie(equations);
  return 0;
}
