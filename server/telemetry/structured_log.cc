#include "server/telemetry/structured_log.h"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/wrappers.pb.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>

#include "core/common/utf8.h"

namespace polyest::internal {
namespace {

// Fields of the line that this thread is logging. spdlog's own messages have no room for them.
thread_local const LogFields* current_fields = nullptr;

const LogFields& CurrentFields() {
  static const LogFields none;
  return current_fields == nullptr ? none : *current_fields;
}

void Append(const std::string& text, spdlog::memory_buf_t& line) {
  line.append(text.data(), text.data() + text.size());
}

// Formats a piece of spdlog's pattern.
template <std::string (*Text)(const spdlog::details::log_msg&)>
class Piece final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& line) override {
    Append(Text(message), line);
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<Piece>();
  }
};

std::string TextPiece(const spdlog::details::log_msg&) { return FieldsAsText(CurrentFields()); }

std::string JsonPiece(const spdlog::details::log_msg& message) {
  return absl::StrCat(
      "\"message\":", JsonString(std::string(message.payload.data(), message.payload.size())),
      FieldsAsJson(CurrentFields()));
}

bool IsPlainWord(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return absl::ascii_isgraph(c) && c != '"' && c != '=' && c != '\\';
  });
}

// Returns the beginning of a text, because what a client wrote may be long.
std::string Shortened(const std::string& text) {
  constexpr size_t kLongest = 200;
  return text.size() <= kLongest ? text : absl::StrCat(CutAt(text, kLongest), "...");
}

}  // namespace

std::string JsonString(const std::string& text) {
  google::protobuf::StringValue value;
  value.set_value(ValidUtf8(text));
  std::string json;
  if (!google::protobuf::util::MessageToJsonString(value, &json).ok()) return "\"\"";
  return json;
}

std::string FieldsAsText(const LogFields& fields) {
  std::string text;
  for (const auto& [name, value] : fields) {
    if (value.empty()) continue;
    const std::string shown = Shortened(value);
    absl::StrAppend(&text, " ", name, "=");
    if (IsPlainWord(shown)) {
      text += shown;
    } else {
      absl::StrAppend(&text, "\"", absl::CHexEscape(shown), "\"");
    }
  }
  return text;
}

std::string FieldsAsJson(const LogFields& fields) {
  std::string text;
  for (const auto& [name, value] : fields) {
    if (!value.empty()) absl::StrAppend(&text, ",\"", name, "\":", JsonString(Shortened(value)));
  }
  return text;
}

void StartLog(LogFormat format, spdlog::level::level_enum level) {
  const bool json = format == LogFormat::kJson;
  auto formatter = std::make_unique<spdlog::pattern_formatter>(
      json ? spdlog::pattern_time_type::utc : spdlog::pattern_time_type::local);
  if (json) {
    formatter->add_flag<Piece<JsonPiece>>('*');
    formatter->set_pattern(R"({"time":"%Y-%m-%dT%H:%M:%S.%fZ","level":"%l",%*})");
  } else {
    formatter->add_flag<Piece<TextPiece>>('*');
    formatter->set_pattern("[%Y-%m-%d %H:%M:%S.%e] [%^%l%$] %v%*");
  }
  auto logger = std::make_shared<spdlog::logger>(
      "polyestd", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  logger->set_formatter(std::move(formatter));
  logger->set_level(level);
  spdlog::set_default_logger(std::move(logger));
}

bool IsLogged(spdlog::level::level_enum level) { return spdlog::should_log(level); }

void Log(spdlog::level::level_enum level, const std::string& message, const LogFields& fields) {
  current_fields = &fields;
  spdlog::log(level, spdlog::string_view_t(message.data(), message.size()));
  current_fields = nullptr;
}

}  // namespace polyest::internal
