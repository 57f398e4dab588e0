#include "core/model/equations/unit_check.h"

#include <absl/strings/str_format.h>

#include <cmath>
#include <vector>

#include "core/common/status.h"
#include "core/model/equations/kernels.h"
#include "core/model/equations/text_error.h"

namespace polyest::internal::equations {
namespace {

// The unit and the value of a part of an expression, as far as they are known.
struct Known {
  std::optional<Unit> unit;     // nullopt if unknown or arbitrary
  std::optional<double> value;  // only for a constant part
};

class UnitCheck {
 public:
  UnitCheck(const Syntax& syntax, const std::map<std::string, Unit>& units)
      : syntax_(syntax), units_(units) {}

  absl::StatusOr<std::optional<Unit>> Run() {
    for (const SyntaxNode& node : syntax_.nodes) {
      POLYEST_ASSIGN_OR_RETURN(Known known, Infer(node));
      known.value = Value(node);
      // 0 has any unit.
      if (known.value == 0.0) known.unit = std::nullopt;
      known_.push_back(known);
    }
    return known_.back().unit;
  }

 private:
  using Result = absl::StatusOr<Known>;

  const Known& Operand(const SyntaxNode& node, int i) const {
    return known_[static_cast<size_t>(node.operands[i])];
  }
  absl::Status Error(const SyntaxNode& node, std::string_view message) const {
    return ErrorAt(syntax_.field, syntax_.text, node.offset, message);
  }
  std::optional<double> Value(const SyntaxNode& node) const;
  Result Infer(const SyntaxNode& node);
  Result Same(const SyntaxNode& node, int first, int second, std::string_view what);
  Result Plain(const SyntaxNode& node, std::string_view what);
  Result OfPower(const SyntaxNode& node);
  Result OfProduct(const SyntaxNode& node);
  // Infers the unit where all operands have the same: for a function of one, it is 1.
  Result OfLikeOperands(const SyntaxNode& node);

  const Syntax& syntax_;
  const std::map<std::string, Unit>& units_;
  std::vector<Known> known_;
};

std::optional<double> UnitCheck::Value(const SyntaxNode& node) const {
  if (node.operation == Operation::kConstant) return node.value;
  if (node.operation == Operation::kVariable || IsLookup(node.operation)) return std::nullopt;
  double values[3] = {0, 0, 0};
  for (int i = 0; i < Operands(node.operation); ++i) {
    const std::optional<double> value = Operand(node, i).value;
    if (!value) return std::nullopt;
    values[i] = *value;
  }
  return EvaluateAtPoint(node.operation, values[0], values[1], values[2]);
}

UnitCheck::Result UnitCheck::Same(const SyntaxNode& node, int first, int second,
                                  std::string_view what) {
  const int left = node.swapped ? second : first;
  const std::optional<Unit>& a = Operand(node, left).unit;
  const std::optional<Unit>& b = Operand(node, first + second - left).unit;
  if (a && b && !SameUnit(*a, *b)) {
    const bool scale = SameDimension(*a, *b);
    return Error(node, absl::StrFormat("%s of different %s: %s and %s", what,
                                       scale ? "scale" : "units", FormatUnit(*a), FormatUnit(*b)));
  }
  return Known{a ? a : b, std::nullopt};
}

UnitCheck::Result UnitCheck::Plain(const SyntaxNode& node, std::string_view what) {
  const std::optional<Unit>& unit = Operand(node, 0).unit;
  if (unit && !unit->IsPlain()) {
    const bool angle = SameDimension(*unit, Unit());
    return Error(node, absl::StrFormat("%s needs a plain number, not one in %s%s", what,
                                       FormatUnit(*unit), angle ? "; give angles in rad" : ""));
  }
  return Known{Unit(), std::nullopt};
}

UnitCheck::Result UnitCheck::OfPower(const SyntaxNode& node) {
  const Known& base = Operand(node, 0);
  const Known& exponent = Operand(node, 1);
  if (exponent.unit && !exponent.unit->IsPlain()) {
    return Error(node, absl::StrFormat("the exponent has the unit %s; it must be a plain number",
                                       FormatUnit(*exponent.unit)));
  }
  if (!base.unit || base.unit->IsPlain()) return base;
  if (exponent.value && std::isfinite(*exponent.value)) {
    return Known{Power(*base.unit, *exponent.value), std::nullopt};
  }
  return Error(node, absl::StrFormat("a power of something in %s needs a constant exponent",
                                     FormatUnit(*base.unit)));
}

UnitCheck::Result UnitCheck::OfProduct(const SyntaxNode& node) {
  const std::optional<Unit>& a = Operand(node, 0).unit;
  const std::optional<Unit>& b = Operand(node, 1).unit;
  if (!a || !b) return Known{};
  return Known{node.operation == Operation::kMultiply ? *a * *b : *a / *b, std::nullopt};
}

UnitCheck::Result UnitCheck::Infer(const SyntaxNode& node) {
  switch (node.operation) {
    case Operation::kConstant:
      return Known{Unit(), node.value};
    case Operation::kVariable: {
      const auto found = units_.find(node.name);
      return Known{found == units_.end() ? std::nullopt : std::optional(found->second),
                   std::nullopt};
    }
    case Operation::kNegate:
    case Operation::kAbsolute:
    case Operation::kFloor:
    case Operation::kCeiling:
      return Known{Operand(node, 0).unit, std::nullopt};
    case Operation::kNot:
    case Operation::kSign:
    case Operation::kAnd:
    case Operation::kOr:
      return Known{Unit(), std::nullopt};
    case Operation::kSquareRoot: {
      const std::optional<Unit>& unit = Operand(node, 0).unit;
      return Known{unit ? std::optional(Power(*unit, 0.5)) : std::nullopt, std::nullopt};
    }
    case Operation::kMultiply:
    case Operation::kDivide:
      return OfProduct(node);
    case Operation::kPower:
      return OfPower(node);
    case Operation::kLookup:
      return Known{};
    default:
      return OfLikeOperands(node);
  }
}

UnitCheck::Result UnitCheck::OfLikeOperands(const SyntaxNode& node) {
  switch (node.operation) {
    case Operation::kAdd:
      return Same(node, 0, 1, "a sum");
    case Operation::kSubtract:
      return Same(node, 0, 1, "a difference");
    case Operation::kMinimum:
    case Operation::kMaximum:
      return Same(node, 0, 1, "the smaller or larger");
    case Operation::kHypotenuse:
      return Same(node, 0, 1, "hypot");
    case Operation::kModulo:
      return Same(node, 0, 1, "the remainder");
    case Operation::kSelect:
      return Same(node, 1, 2, "the two sides of if");
    case Operation::kArcTangent2:
      POLYEST_RETURN_IF_ERROR(Same(node, 0, 1, "atan2").status());
      return Known{Unit(), std::nullopt};
    case Operation::kLess:
    case Operation::kLessOrEqual:
    case Operation::kEqual:
    case Operation::kNotEqual:
      POLYEST_RETURN_IF_ERROR(Same(node, 0, 1, "a comparison").status());
      return Known{Unit(), std::nullopt};
    default:
      return Plain(node, "this function");
  }
}

}  // namespace

absl::StatusOr<std::optional<Unit>> InferUnit(const Syntax& syntax,
                                              const std::map<std::string, Unit>& units) {
  return UnitCheck(syntax, units).Run();
}

}  // namespace polyest::internal::equations
