#include "core/model/equations/functions.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>

#include "core/common/nearest_name.h"
#include "core/model/equations/limits.h"

namespace polyest::internal::equations {
namespace {

constexpr Function kFunctions[] = {
    {"abs", Operation::kAbsolute, 1, 1},
    {"acos", Operation::kArcCosine, 1, 1},
    {"asin", Operation::kArcSine, 1, 1},
    {"atan", Operation::kArcTangent, 1, 1},
    {"atan2", Operation::kArcTangent2, 2, 2},
    {"ceil", Operation::kCeiling, 1, 1},
    {"cos", Operation::kCosine, 1, 1},
    {"cosh", Operation::kHyperbolicCosine, 1, 1},
    {"exp", Operation::kExponential, 1, 1},
    {"floor", Operation::kFloor, 1, 1},
    {"hypot", Operation::kHypotenuse, 2, 2},
    {"if", Operation::kSelect, 3, 3},
    {"log", Operation::kLogarithm, 1, 1},
    {"log10", Operation::kLogarithm10, 1, 1},
    {"max", Operation::kMaximum, 2, kMaxArguments},
    {"min", Operation::kMinimum, 2, kMaxArguments},
    {"mod", Operation::kModulo, 2, 2},
    {"pow", Operation::kPower, 2, 2},
    {"sign", Operation::kSign, 1, 1},
    {"sin", Operation::kSine, 1, 1},
    {"sinh", Operation::kHyperbolicSine, 1, 1},
    {"sqrt", Operation::kSquareRoot, 1, 1},
    {"tan", Operation::kTangent, 1, 1},
    {"tanh", Operation::kHyperbolicTangent, 1, 1},
};

bool IsLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

}  // namespace

const Function* FindFunction(std::string_view name) {
  const auto found = std::find_if(std::begin(kFunctions), std::end(kFunctions),
                                  [name](const Function& f) { return f.name == name; });
  return found == std::end(kFunctions) ? nullptr : found;
}

bool IsReserved(std::string_view name) {
  return name == "t" || name == "pi" || FindFunction(name) != nullptr;
}

bool IsName(std::string_view text) {
  return !text.empty() && text.size() <= kMaxNameLength && IsLetter(text[0]) &&
         std::all_of(text.begin(), text.end(),
                     [](char c) { return IsLetter(c) || (c >= '0' && c <= '9'); });
}

std::string SuggestFunction(std::string_view unknown, const std::vector<std::string>& tables) {
  std::vector<std::string> names;
  for (const Function& function : kFunctions) names.emplace_back(function.name);
  names.insert(names.end(), tables.begin(), tables.end());
  const std::string nearest = NearestName(std::string(unknown), names);
  if (!nearest.empty()) return absl::StrCat("; did you mean \"", nearest, "\"?");
  return absl::StrCat("; the functions are ", absl::StrJoin(names, ", "));
}

}  // namespace polyest::internal::equations
