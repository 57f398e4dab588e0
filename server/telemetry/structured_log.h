#pragma once

// Writes log lines to stderr, as text or as JSON, that carry fields beside their message. They
// never contain a token, a measurement, or a message that repeats what a client has sent.

#include <spdlog/common.h>

#include <string>
#include <utility>
#include <vector>

namespace polyest::internal {

enum class LogFormat { kText, kJson };

// Sends everything logged through spdlog's default logger to stderr, from this level on.
void StartLog(LogFormat format, spdlog::level::level_enum level);

using LogFields = std::vector<std::pair<std::string, std::string>>;

// Returns whether messages of this level are logged.
bool IsLogged(spdlog::level::level_enum level);
// Logs a message with its fields; leaves out fields without a value.
void Log(spdlog::level::level_enum level, const std::string& message, const LogFields& fields);

// Return the fields as they stand in a line. As text: ` name=value`, quoted where it is not one
// plain word. As JSON: `,"name":"value"`.
std::string FieldsAsText(const LogFields& fields);
std::string FieldsAsJson(const LogFields& fields);
// Returns the text as a JSON string, with its quotes; bytes that are not UTF-8 are replaced.
std::string JsonString(const std::string& text);

}  // namespace polyest::internal
