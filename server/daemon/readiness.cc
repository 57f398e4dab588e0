#include "server/daemon/readiness.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

namespace polyest::internal {
namespace {

constexpr std::chrono::seconds kPause{1};

}  // namespace

void Readiness::Start(grpc::HealthCheckServiceInterface* health, LogFields daemon) {
  const absl::Status writable = check_writable_();
  const std::lock_guard lock(mutex_);
  health_ = health;
  daemon_ = std::move(daemon);
  writable_ = writable.ok();
  health_->SetServingStatus(kService, false);
  Tell();
  thread_ = std::jthread([this](std::stop_token stop) { Run(stop); });
}

void Readiness::OnCommit(bool kept) {
  const std::lock_guard lock(mutex_);
  if (kept == writable_) return;
  writable_ = kept;
  Tell();
  failed_.notify_all();
}

void Readiness::Drain() {
  {
    const std::lock_guard lock(mutex_);
    if (health_ != nullptr) health_->SetServingStatus(kService, false);
    health_ = nullptr;
    ready_ = false;
  }
  thread_ = {};
}

void Readiness::Tell() {
  if (health_ == nullptr || ready_ == writable_) return;
  ready_ = writable_;
  health_->SetServingStatus(kService, ready_);
  if (ready_) {
    Log(spdlog::level::info, "ready", daemon_);
  } else {
    spdlog::warn("not ready: the journal cannot be written");
  }
}

void Readiness::Run(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    failed_.wait(lock, stop, [this] { return !writable_; });
    failed_.wait_for(lock, stop, kPause, [this] { return writable_; });
    if (stop.stop_requested() || writable_) continue;
    lock.unlock();
    const bool writable = check_writable_().ok();
    lock.lock();
    if (writable) {
      writable_ = true;
      Tell();
    }
  }
}

}  // namespace polyest::internal
