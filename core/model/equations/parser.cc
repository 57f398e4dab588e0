#include "core/model/equations/parser.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/model/equations/functions.h"
#include "core/model/equations/lexer.h"
#include "core/model/equations/limits.h"
#include "core/model/equations/text_error.h"

namespace polyest::internal::equations {
namespace {

struct BinaryOperator {
  std::string_view symbol;
  int precedence;
  Operation operation;
  bool swapped = false;  // whether a > b is stored as b < a
};

constexpr int kOr = 1, kAnd = 2, kComparison = 3, kSum = 4, kProduct = 5, kSign = 6, kPower = 7;

constexpr BinaryOperator kOperators[] = {
    {"||", kOr, Operation::kOr},
    {"&&", kAnd, Operation::kAnd},
    {"<", kComparison, Operation::kLess},
    {"<=", kComparison, Operation::kLessOrEqual},
    {">", kComparison, Operation::kLess, true},
    {">=", kComparison, Operation::kLessOrEqual, true},
    {"==", kComparison, Operation::kEqual},
    {"!=", kComparison, Operation::kNotEqual},
    {"+", kSum, Operation::kAdd},
    {"-", kSum, Operation::kSubtract},
    {"*", kProduct, Operation::kMultiply},
    {"/", kProduct, Operation::kDivide},
    {"^", kPower, Operation::kPower},
};

class Parser {
 public:
  Parser(Syntax* syntax, const std::map<std::string, int>& tables)
      : syntax_(syntax), tables_(tables), lexer_(syntax->field, syntax->text) {}

  absl::Status Run();

 private:
  // The index of a node, or an error.
  using Result = absl::StatusOr<int>;

  absl::Status Advance();
  Result Expression(int min_precedence);
  Result Prefix();
  Result Primary();
  Result Call(const Token& name);
  absl::StatusOr<std::vector<int>> Arguments();
  Result CallFunction(const Token& name, const Function& function, const std::vector<int>& given);
  Result Name(const Token& name);

  std::optional<BinaryOperator> Operator() const;
  bool At(std::string_view symbol) const {
    return token_.kind == Token::Kind::kSymbol && token_.text == symbol;
  }
  int Append(SyntaxNode node);
  absl::Status Error(size_t offset, std::string_view message) const {
    return ErrorAt(syntax_->field, syntax_->text, offset, message);
  }

  Syntax* syntax_;
  const std::map<std::string, int>& tables_;
  Lexer lexer_;
  Token token_;
  int nesting_ = 0;
};

absl::Status Parser::Advance() {
  POLYEST_ASSIGN_OR_RETURN(token_, lexer_.Next());
  return absl::OkStatus();
}

int Parser::Append(SyntaxNode node) {
  syntax_->nodes.push_back(std::move(node));
  return static_cast<int>(syntax_->nodes.size()) - 1;
}

absl::Status Parser::Run() {
  POLYEST_RETURN_IF_ERROR(Advance());
  if (token_.kind == Token::Kind::kEnd) return Error(token_.offset, "expected an expression");
  POLYEST_RETURN_IF_ERROR(Expression(kOr).status());
  if (At(")")) return Error(token_.offset, "a ) without its (");
  if (token_.kind != Token::Kind::kEnd) {
    return Error(token_.offset, "expected an operator; products are written with *");
  }
  return absl::OkStatus();
}

std::optional<BinaryOperator> Parser::Operator() const {
  if (token_.kind != Token::Kind::kSymbol) return std::nullopt;
  for (const BinaryOperator& candidate : kOperators) {
    if (candidate.symbol == token_.text) return candidate;
  }
  return std::nullopt;
}

Parser::Result Parser::Expression(int min_precedence) {
  if (++nesting_ > kMaxNesting) {
    return Error(token_.offset,
                 absl::StrFormat("nested more than %d deep; use intermediates", kMaxNesting));
  }
  POLYEST_ASSIGN_OR_RETURN(int left, Prefix());
  for (;;) {
    const std::optional<BinaryOperator> found = Operator();
    if (!found || found->precedence < min_precedence) break;
    const size_t offset = token_.offset;
    POLYEST_RETURN_IF_ERROR(Advance());
    // Powers bind to the right, and their exponent may have a sign.
    POLYEST_ASSIGN_OR_RETURN(
        const int right, Expression(found->precedence == kPower ? kSign : found->precedence + 1));
    SyntaxNode node{.operation = found->operation, .offset = offset, .swapped = found->swapped};
    node.operands[0] = found->swapped ? right : left;
    node.operands[1] = found->swapped ? left : right;
    left = Append(std::move(node));
    if (found->precedence != kComparison) continue;
    if (const auto next = Operator(); next && next->precedence == kComparison) {
      return Error(token_.offset, "comparisons do not chain: a < b < c is a < b && b < c");
    }
  }
  --nesting_;
  return left;
}

Parser::Result Parser::Prefix() {
  const size_t offset = token_.offset;
  const bool minus = At("-"), plus = At("+"), negation = At("!");
  if (!minus && !plus && !negation) return Primary();
  POLYEST_RETURN_IF_ERROR(Advance());
  POLYEST_ASSIGN_OR_RETURN(const int operand, Expression(kSign));
  if (plus) return operand;
  return Append({.operation = minus ? Operation::kNegate : Operation::kNot,
                 .operands = {operand, -1, -1},
                 .offset = offset});
}

Parser::Result Parser::Primary() {
  const Token token = token_;
  switch (token.kind) {
    case Token::Kind::kEnd:
      return Error(token.offset, "expected a number, a name or (");
    case Token::Kind::kNumber:
      POLYEST_RETURN_IF_ERROR(Advance());
      return Append({.value = token.value, .offset = token.offset});
    case Token::Kind::kName:
      POLYEST_RETURN_IF_ERROR(Advance());
      return At("(") ? Call(token) : Name(token);
    case Token::Kind::kSymbol:
      break;
  }
  if (!At("(")) return Error(token.offset, "expected a number, a name or (");
  POLYEST_RETURN_IF_ERROR(Advance());
  POLYEST_ASSIGN_OR_RETURN(const int inside, Expression(kOr));
  if (!At(")")) {
    const std::string message =
        absl::StrFormat("expected ) for the ( in column %d", token.offset + 1);
    return Error(token_.offset, message);
  }
  POLYEST_RETURN_IF_ERROR(Advance());
  return inside;
}

Parser::Result Parser::Name(const Token& token) {
  std::string name(token.text);
  if (name == "pi") return Append({.value = 3.14159265358979323846, .offset = token.offset});
  if (FindFunction(name) != nullptr || tables_.contains(name)) {
    return Error(token.offset,
                 absl::StrFormat("%s is a %s; it is called as %s(…)", name,
                                 tables_.contains(name) ? "table" : "function", name));
  }
  return Append(
      {.operation = Operation::kVariable, .name = std::move(name), .offset = token.offset});
}

Parser::Result Parser::Call(const Token& token) {
  std::string name(token.text);
  const Function* const function = FindFunction(name);
  const auto table = tables_.find(name);
  if (function == nullptr && table == tables_.end()) {
    std::vector<std::string> tables;
    for (const auto& [table_name, arguments] : tables_) tables.push_back(table_name);
    return Error(token.offset, absl::StrFormat("unknown function %s%s", Quoted(name),
                                               SuggestFunction(name, tables)));
  }
  POLYEST_ASSIGN_OR_RETURN(const std::vector<int> given, Arguments());
  if (function != nullptr) return CallFunction(token, *function, given);
  if (std::ssize(given) != table->second) {
    return Error(token.offset,
                 absl::StrFormat("the table %s takes %d argument%s, not %d", name, table->second,
                                 table->second == 1 ? "" : "s", given.size()));
  }
  SyntaxNode node{.operation = Operation::kLookup, .name = std::move(name), .offset = token.offset};
  std::copy(given.begin(), given.end(), node.operands);
  return Append(std::move(node));
}

absl::StatusOr<std::vector<int>> Parser::Arguments() {
  const size_t opened = token_.offset;
  std::vector<int> given;
  do {
    POLYEST_RETURN_IF_ERROR(Advance());
    if (given.empty() && At(")")) break;
    POLYEST_ASSIGN_OR_RETURN(const int argument, Expression(kOr));
    given.push_back(argument);
  } while (At(","));
  if (!At(")")) {
    return Error(token_.offset,
                 absl::StrFormat("expected , or ) for the ( in column %d", opened + 1));
  }
  POLYEST_RETURN_IF_ERROR(Advance());
  return given;
}

Parser::Result Parser::CallFunction(const Token& token, const Function& function,
                                    const std::vector<int>& given) {
  const int count = static_cast<int>(given.size());
  if (count < function.min_arguments || count > function.max_arguments) {
    const bool many = function.max_arguments == kMaxArguments;
    return Error(
        token.offset,
        absl::StrFormat("%s takes %d%s argument%s, not %d", function.name, function.min_arguments,
                        many ? absl::StrFormat(" to %d", function.max_arguments) : "",
                        function.max_arguments == 1 ? "" : "s", count));
  }
  SyntaxNode node{.operation = function.operation, .offset = token.offset};
  std::copy_n(given.begin(), std::min(count, Operands(function.operation)), node.operands);
  int result = Append(node);
  // min(a, b, c) = min(min(a, b), c)
  for (int i = Operands(function.operation); i < count; ++i) {
    node.operands[0] = result;
    node.operands[1] = given[static_cast<size_t>(i)];
    result = Append(node);
  }
  return result;
}

}  // namespace

absl::StatusOr<Syntax> Parse(FieldPath field, std::string text,
                             const std::map<std::string, int>& tables) {
  if (text.size() > kMaxTextLength) {
    return FieldError(absl::StatusCode::kResourceExhausted, field,
                      absl::StrFormat("has %d bytes; an expression may have %d at most",
                                      text.size(), kMaxTextLength));
  }
  Syntax syntax{std::move(field), std::move(text), {}};
  POLYEST_RETURN_IF_ERROR(Parser(&syntax, tables).Run());
  return syntax;
}

std::vector<std::string> VariablesIn(const Syntax& syntax) {
  std::set<std::string> names;
  for (const SyntaxNode& node : syntax.nodes) {
    if (node.operation == Operation::kVariable) names.insert(node.name);
  }
  return {names.begin(), names.end()};
}

}  // namespace polyest::internal::equations
