#include "server/execution/executor.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest {

Executor::Executor(int threads, int capacity) : capacity_(capacity) {
  POLYEST_CHECK(threads >= 1 && capacity >= 1);
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Run(); });
}

Executor::~Executor() {
  {
    std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ready_.notify_all();
}

absl::Status Executor::Submit(Task task) {
  POLYEST_RETURN_IF_ERROR(Reserve());
  Enqueue([this, task = std::move(task)] {
    task();
    Release();
  });
  return absl::OkStatus();
}

absl::Status Executor::Reserve() {
  std::lock_guard lock(mutex_);
  if (accepted_ >= capacity_) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the daemon is busy: its queue of ", capacity_, " tasks is full; try later"));
  }
  ++accepted_;
  return absl::OkStatus();
}

void Executor::Release() {
  std::lock_guard lock(mutex_);
  --accepted_;
  if (ending_ && accepted_ == 0) ready_.notify_all();
}

void Executor::Enqueue(Task task) {
  {
    std::lock_guard lock(mutex_);
    queue_.push_back(std::move(task));
  }
  ready_.notify_one();
}

void Executor::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    // A strand's running task may bring its next one, so the end waits for all that was accepted.
    ready_.wait(lock, [this] { return !queue_.empty() || (ending_ && accepted_ == 0); });
    if (queue_.empty()) return;
    Task task = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    task();
    task = nullptr;
    lock.lock();
  }
}

absl::Status Strand::Submit(Task task) {
  POLYEST_RETURN_IF_ERROR(executor_.Reserve());
  bool idle = false;
  {
    std::lock_guard lock(mutex_);
    idle = tasks_.empty();
    tasks_.push_back(std::move(task));
  }
  if (idle) executor_.Enqueue([self = shared_from_this()] { self->RunOne(); });
  return absl::OkStatus();
}

void Strand::RunOne() {
  Task task;
  {
    std::lock_guard lock(mutex_);
    task = std::move(tasks_.front());
  }
  task();
  task = nullptr;
  bool more = false;
  {
    std::lock_guard lock(mutex_);
    tasks_.pop_front();
    more = !tasks_.empty();
  }
  // Back to the end of the queue: one busy strand does not keep others from their turn.
  if (more) executor_.Enqueue([self = shared_from_this()] { self->RunOne(); });
  executor_.Release();
}

}  // namespace polyest
