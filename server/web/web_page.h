#pragma once

// The live page, whose files are in the program.

#include <span>
#include <string_view>

#include "server/web/http_message.h"

namespace polyest::internal {

struct WebFile {
  std::string_view path;  // "/index.html"
  std::string_view content_type;
  std::string_view bytes;
};

// Returns the files of client/web/dist as they were when the program was built; none if that folder
// was missing.
std::span<const WebFile> EmbeddedFiles();

// Returns the answer to a request for a file; that of status 404 if there is none of this path. "/"
// is the page.
HttpAnswer FileAnswer(std::span<const WebFile> files, std::string_view path);

}  // namespace polyest::internal
