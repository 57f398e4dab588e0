#include "core/fmu/worker/monitor.h"

#include <algorithm>

namespace polyest::internal {

void Monitor::Say(absl::string_view message) {
  auto& text = page_->message;
  const size_t size = std::min(message.size(), text.size() - 1);
  std::copy_n(message.data(), size, text.data());
  text[size] = '\0';
}

}  // namespace polyest::internal
