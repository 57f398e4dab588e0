// Adds what can be said about a data file.

#include <absl/strings/str_join.h>

#include <algorithm>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "client/cli/shared_options.h"

namespace polyest::internal {
namespace {

const std::map<std::string, char> kDelimiters = {
    {"comma", ','}, {"semicolon", ';'}, {"tab", '\t'}, {"bar", '|'}};
const std::map<std::string, char> kDecimals = {{"point", '.'}, {"comma", ','}};
const std::map<std::string, DataFileOptions::TimeZero> kTimeZeros = {
    {"file", DataFileOptions::TimeZero::kFile}, {"first", DataFileOptions::TimeZero::kFirst}};
const std::map<std::string, DataFileOptions::DateOrder> kDateOrders = {
    {"dmy", DataFileOptions::DateOrder::kDayFirst},
    {"mdy", DataFileOptions::DateOrder::kMonthFirst}};

// Adds an option that takes one of some names, or, for a character, also the character itself.
template <typename Value>
CLI::Option* AddChoice(CLI::App& command, const char* option,
                       const std::map<std::string, Value>& names, Value& value, const char* help) {
  const auto find = [&names](const std::string& text) {
    if constexpr (std::is_same_v<Value, char>) {
      for (const auto& [name, character] : names) {
        if (text == std::string(1, character)) return names.find(name);
      }
    }
    return names.find(text);
  };
  std::string list;
  for (const auto& [name, unused] : names) list += (list.empty() ? "" : ", ") + name;
  const auto check = [find, list, &names](const std::string& text) {
    return find(text) != names.end() ? "" : "\"" + text + "\" must be one of " + list;
  };
  return command
      .add_option_function<std::string>(
          option, [find, &value](const std::string& text) { value = find(text)->second; },
          std::string(help) + ": " + list)
      ->check(CLI::Validator(check, "NAME"))
      ->group("Data file");
}

}  // namespace

std::vector<CLI::Option*> AddDataOptions(CLI::App& command, DataFileOptions& options) {
  return {AddChoice(command, "--delimiter", kDelimiters, options.delimiter,
                    "What separates cells, where it is not found out"),
          AddChoice(command, "--decimal", kDecimals, options.decimal,
                    "The decimal mark, where it is not found out"),
          command
              .add_option("--time-column", options.time_column,
                          "Header of the time, where it is not found out")
              ->group("Data file"),
          AddChoice(command, "--time-zero", kTimeZeros, options.time_zero,
                    "When the time is 0: as in the file (the default), or at the first row of each "
                    "run (the default for dates)"),
          AddChoice(command, "--date-order", kDateOrders, options.date_order,
                    "Order in dates such as 01/02/2026")};
}

void RequireDataFile(const std::vector<CLI::Option*>& options,
                     const std::vector<const CLI::Option*>& files) {
  const auto is_given = [](const CLI::Option* option) { return option->count() > 0; };
  if (std::ranges::any_of(files, is_given)) return;
  const auto option = std::ranges::find_if(options, is_given);
  if (option == options.end()) return;
  std::vector<std::string> names;
  for (const CLI::Option* const file : files) names.push_back(file->get_name());
  throw CLI::RequiresError((*option)->get_name(), absl::StrJoin(names, " or "));
}

}  // namespace polyest::internal
