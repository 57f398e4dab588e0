#pragma once

// Writes on the status page what is being done.

#include <absl/strings/string_view.h>

#include "core/fmu/status_page.h"

namespace polyest::internal {

class Monitor {
 public:
  explicit Monitor(StatusPage* page) : page_(page) {}

  // Before each call of an FMU's function.
  void Enter(FmuCall call, int point, double time_s) {
    page_->call.store(call, std::memory_order_relaxed);
    page_->point.store(point, std::memory_order_relaxed);
    page_->time_s.store(time_s, std::memory_order_relaxed);
    // The only writer: no need for an atomic addition.
    page_->calls.store(page_->calls.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  // After it.
  void Leave() { page_->call.store(FmuCall::kNothing, std::memory_order_relaxed); }
  // What the FMU said; cut to the page's size.
  void Say(absl::string_view message);

 private:
  StatusPage* page_;
};

}  // namespace polyest::internal
