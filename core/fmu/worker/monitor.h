#pragma once

// Records the current activity on the status page.

#include <absl/strings/string_view.h>

#include "core/fmu/status_page.h"

namespace polyest::internal {

class Monitor {
 public:
  explicit Monitor(StatusPage* page) : page_(page) {}

  // Records the start of a call of an FMU function.
  void Enter(FmuCall call, double time_s) {
    page_->call.store(call, std::memory_order_relaxed);
    page_->time_s.store(time_s, std::memory_order_relaxed);
    // This is the only writer, so no atomic addition is needed.
    page_->calls.store(page_->calls.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  // Records the end of the call.
  void Leave() { page_->call.store(FmuCall::kNothing, std::memory_order_relaxed); }
  // Records the FMU's message, truncated to the page's size.
  void Say(absl::string_view message);

 private:
  StatusPage* page_;
};

}  // namespace polyest::internal
