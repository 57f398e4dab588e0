#include "server/web/event_source.h"

#include <absl/strings/str_cat.h>

#include "server/web/transcode.h"

namespace polyest::internal {

EventSource::Text ToEvent(const std::string& message, const google::protobuf::Descriptor& type) {
  return std::make_shared<const std::string>(
      absl::StrCat("data: ", ToJsonText(message, type), "\n\n"));
}

}  // namespace polyest::internal
