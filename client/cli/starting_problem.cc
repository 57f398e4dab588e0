#include "client/cli/starting_problem.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "client/cli/number_format.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

// File to which `polyest schema > problem.schema.json` writes the schema, beside the problem.
constexpr char kSchema[] = "./problem.schema.json";
constexpr size_t kMaxUnknowns = 2;
constexpr double kPriorHalfWidth = 0.3;  // as a part of the default

// Returns a name as a JSON string: the names of an FMU may contain any characters.
std::string Quoted(const std::string& name) {
  google::protobuf::Value value;
  value.set_string_value(name);
  std::string json;
  POLYEST_CHECK(google::protobuf::util::MessageToJsonString(value, &json).ok());
  return json;
}

bool IsInitialState(const Quantity& parameter) {
  return absl::StartsWith(parameter.meaning, "initial");
}

// Returns whether a parameter is a mass, a length or an inertia, which are easily measured. Other
// parameters are seldom known.
bool IsEasilyMeasured(const Quantity& parameter) {
  static const std::set<std::string> units = {"kg", "m", "kg m^2"};
  return units.contains(parameter.unit);
}

std::vector<Quantity> ChooseUnknowns(const ModelDescription& model) {
  std::vector<Quantity> unknowns;
  std::vector<Quantity> others;
  for (const Quantity& parameter : model.parameters) {
    if (IsInitialState(parameter) || !std::isfinite(parameter.default_value)) continue;
    const bool typical = parameter.default_value != 0 && !IsEasilyMeasured(parameter);
    (typical ? unknowns : others).push_back(parameter);
  }
  if (unknowns.empty() && !others.empty()) unknowns.push_back(others.front());
  if (unknowns.size() > kMaxUnknowns) unknowns.resize(kMaxUnknowns);
  return unknowns;
}

// Returns a bound of a prior.
std::string Bound(double value) { return FormatExact(Rounded(value, 4)); }

std::string Uncertain(const Quantity& parameter) {
  const double half_width =
      parameter.default_value == 0 ? 1 : kPriorHalfWidth * std::abs(parameter.default_value);
  return absl::StrCat("{\"name\": ", Quoted(parameter.name),
                      ", \"uniform\": {\"lower\": ", Bound(parameter.default_value - half_width),
                      ", \"upper\": ", Bound(parameter.default_value + half_width), "}}");
}

// Returns the parameters that are fixed at their defaults. In a model without inputs, the first
// initial state is not 0, so that the model moves.
std::vector<std::string> Fixed(const ModelDescription& model,
                               const std::vector<Quantity>& unknowns) {
  std::vector<std::string> fixed;
  bool at_rest = model.inputs.empty();
  for (const Quantity& parameter : model.parameters) {
    const bool unknown = std::any_of(unknowns.begin(), unknowns.end(), [&](const Quantity& other) {
      return other.name == parameter.name;
    });
    if (unknown || !std::isfinite(parameter.default_value)) continue;
    double value = parameter.default_value;
    if (at_rest && IsInitialState(parameter)) {
      at_rest = false;
      if (value == 0) value = 0.5;
    }
    fixed.push_back(absl::StrCat(Quoted(parameter.name), ": ", FormatExact(value)));
  }
  return fixed;
}

// Returns an input with a signal of the size that is usual for its unit. The bumps of successive
// inputs follow one another.
std::string Input(const Quantity& input, int index) {
  std::string signal = R"("sinusoid": {"amplitude": 1, "frequencyHz": 1})";
  if (input.unit == "m") {
    signal = absl::StrCat(R"("halfSineBump": {"amplitude": 0.05, "startS": )",
                          FormatNumber(0.5 + 0.6 * index), R"(, "durationS": 0.2})");
  } else if (input.unit == "m/s") {
    signal = R"("constant": {"amplitude": 20})";
  } else if (input.unit == "rad") {
    signal = R"("sinusoid": {"amplitude": 0.02, "frequencyHz": 0.5})";
  }
  return absl::StrCat("{\"name\": ", Quoted(input.name), ", ", signal, "}");
}

std::string Measured(const Quantity& output) {
  static const std::map<std::string, double> noises = {
      {"m", 0.001}, {"rad", 0.001}, {"m/s^2", 0.1}};
  const auto noise = noises.find(output.unit);
  return absl::StrCat("{\"output\": ", Quoted(output.name), ", \"noise\": {\"absolute\": ",
                      noise == noises.end() ? "0.01" : FormatNumber(noise->second), "}}");
}

std::string StreamedInput(const Quantity& input) {
  return absl::StrCat("{\"name\": ", Quoted(input.name), ", \"streamed\": {}}");
}

std::string MeasuredWithUnknownNoise(const Quantity& output) {
  return absl::StrCat("{\"output\": ", Quoted(output.name), ", \"noise\": {\"unknown\": true}}");
}

std::string Lines(const char* open, const std::vector<std::string>& elements, const char* close) {
  return absl::StrCat(open, "\n    ", absl::StrJoin(elements, ",\n    "), "\n  ", close);
}

template <typename Write>
std::vector<std::string> Each(const std::vector<Quantity>& quantities, Write write) {
  std::vector<std::string> texts;
  for (const Quantity& quantity : quantities) texts.push_back(write(quantity));
  return texts;
}

std::vector<std::string> WithColumn(const std::vector<Quantity>& quantities,
                                    const ProposedColumns& proposed,
                                    std::string (*write)(const Quantity&)) {
  std::vector<std::string> texts;
  for (const Quantity& quantity : quantities) {
    if (proposed.headers.contains(quantity.name)) texts.push_back(write(quantity));
  }
  return texts;
}

// Returns the entries of `columns`. A column with the quantity's own name needs none.
std::vector<std::string> Sources(const ProposedColumns& proposed) {
  std::vector<std::string> sources;
  for (const auto& [quantity, header] : proposed.headers) {
    if (quantity == header) continue;
    sources.push_back(absl::StrCat(Quoted(quantity), ": {\"from\": ", Quoted(header), "}"));
  }
  return sources;
}

}  // namespace

std::string StartingProblem(const ModelDescription& model, const char* source,
                            const ProposedColumns* proposed) {
  const std::vector<Quantity> unknowns = ChooseUnknowns(model);
  std::vector<std::string> members = {
      absl::StrCat("\"$schema\": ", Quoted(kSchema)),
      absl::StrCat("\"model\": {", Quoted(source), ": ", Quoted(model.name), "}")};
  const auto add = [&members](const char* name, const char* open,
                              const std::vector<std::string>& elements, const char* close) {
    if (elements.empty()) return;
    members.push_back(absl::StrCat(Quoted(name), ": ", Lines(open, elements, close)));
  };
  add("fixed", "{", Fixed(model, unknowns), "}");
  add("uncertain", "[", Each(unknowns, Uncertain), "]");
  int index = 0;
  const auto input = [&index](const Quantity& quantity) { return Input(quantity, index++); };
  if (proposed == nullptr) {
    add("inputs", "[", Each(model.inputs, input), "]");
    add("measured", "[", Each(model.outputs, Measured), "]");
  } else {
    add("columns", "{", Sources(*proposed), "}");
    add("inputs", "[", WithColumn(model.inputs, *proposed, StreamedInput), "]");
    add("measured", "[", WithColumn(model.outputs, *proposed, MeasuredWithUnknownNoise), "]");
  }
  members.emplace_back(R"("expansion": {"order": "AUTO", "pointsPerTerm": 2})");
  return absl::StrCat("{\n  ", absl::StrJoin(members, ",\n  "), "\n}\n");
}

const char kStartingEquations[] = R"({
  "$schema": "./problem.schema.json",
  "model": {
    "equations": {
      "states": {
        "x": "v",
        "v": "(force - spring - c*v)/m"
      },
      "intermediates": {"spring": "k*x + k3*x^3"},
      "outputs": {"x": "x"},
      "inputs": ["force"],
      "parameters": {"m": 1, "c": 0.2, "k": 40, "k3": 0},
      "units": {"x": "m", "v": "m/s", "force": "N", "m": "kg", "c": "N s/m", "k": "N/m", "k3": "N/m^3"}
    }
  },
  "fixed": {
    "m": 1,
    "k3": 0,
    "x_0": 0,
    "v_0": 0
  },
  "uncertain": [
    {"name": "k", "uniform": {"lower": 28, "upper": 52}},
    {"name": "c", "uniform": {"lower": 0.14, "upper": 0.26}}
  ],
  "inputs": [
    {"name": "force", "sinusoid": {"amplitude": 1, "frequencyHz": 1}}
  ],
  "measured": [
    {"output": "x", "noise": {"absolute": 0.001}}
  ],
  "expansion": {"order": "AUTO", "pointsPerTerm": 2}
}
)";

}  // namespace polyest::internal
