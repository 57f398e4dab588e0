#include "server/web/web_page.h"

#include <absl/strings/ascii.h>
#include <grpcpp/support/status_code_enum.h>

#include <algorithm>

#include "server/web/web_answers.h"

namespace polyest::internal {
namespace {

constexpr std::string_view kNoPage =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>polyest</title>\n"
    "<p>This polyestd was built without the live page. Its calls are served under /v1.</p>\n";

// Returns whether the name of a file carries a hash of its content, as in index-CmRJ8x2a.js: files
// of one name are the same for ever.
bool HasHash(std::string_view path) {
  constexpr size_t kHash = 8;
  const size_t dot = path.rfind('.');
  if (!path.starts_with("/assets/") || dot == std::string_view::npos || dot < kHash + 1) {
    return false;
  }
  const std::string_view hash = path.substr(dot - kHash, kHash);
  return path[dot - kHash - 1] == '-' && std::ranges::all_of(hash, [](unsigned char c) {
           return absl::ascii_isalnum(c) || c == '_' || c == '-';
         });
}

}  // namespace

HttpAnswer FileAnswer(std::span<const WebFile> files, std::string_view path) {
  const std::string_view wanted = path == "/" ? "/index.html" : path;
  const auto file = std::ranges::find(files, wanted, &WebFile::path);
  if (file != files.end()) {
    HttpAnswer answer{.content_type = std::string(file->content_type)};
    answer.body = file->bytes;
    if (HasHash(path)) {
      answer.headers.emplace_back("Cache-Control", "public, max-age=31536000, immutable");
    }
    return answer;
  }
  if (path == "/") {
    return {.content_type = "text/html; charset=utf-8", .body = std::string(kNoPage)};
  }
  return ErrorAnswer(404, grpc::StatusCode::NOT_FOUND, "there is nothing at this path");
}

}  // namespace polyest::internal
