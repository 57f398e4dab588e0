#include "server/execution/executor.h"

#include <absl/strings/str_cat.h>
#include <sys/resource.h>

#include <chrono>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/common/thread_pool.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

// Time after which a full queue may have room again.
constexpr std::chrono::seconds kBusyDelay{1};

}  // namespace

Executor::Executor(const ExecutorOptions& options) : options_(options) {
  POLYEST_CHECK(options.threads_per_lane >= 1 && options.threads >= options.threads_per_lane &&
                options.capacity >= 1 && options.capacity_per_lane >= 1 && options.niceness >= 0);
  workers_.resize(static_cast<size_t>(options.threads));
  for (Worker& worker : workers_) threads_.emplace_back([this, &worker] { Run(worker); });
}

Executor::~Executor() {
  const std::lock_guard lock(mutex_);
  ending_ = true;
  WakeAll();
}

absl::Status Executor::Submit(const std::string& lane, Task task, Admission admission) {
  POLYEST_RETURN_IF_ERROR(Reserve(lane, admission));
  Enqueue(lane, std::move(task));
  return absl::OkStatus();
}

bool Executor::AwaitIdle(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  return idle_.wait_until(lock, deadline, [this] { return accepted_ == 0; });
}

int Executor::accepted() const {
  const std::lock_guard lock(mutex_);
  return accepted_;
}

int Executor::waiting() const {
  const std::lock_guard lock(mutex_);
  int waiting = accepted_;
  for (const auto& [name, lane] : lanes_) waiting -= lane.running;
  return waiting;
}

absl::Status Executor::Reserve(const std::string& lane, Admission admission) {
  const std::lock_guard lock(mutex_);
  const auto found = lanes_.find(lane);
  const bool lane_full =
      found != lanes_.end() && found->second.accepted >= options_.capacity_per_lane;
  const bool full = accepted_ >= options_.capacity || lane_full;
  if (full && admission == Admission::kIfRoom) {
    return Refuse(absl::StatusCode::kResourceExhausted,
                  absl::StrCat("the daemon is busy: its queue of ",
                               lane_full ? options_.capacity_per_lane : options_.capacity,
                               " tasks is full; try later"),
                  {.reason = kBusy, .retry_delay = kBusyDelay});
  }
  ++accepted_;
  ++lanes_[lane].accepted;
  return absl::OkStatus();
}

void Executor::Enqueue(const std::string& lane, Task task) {
  Worker* woken = nullptr;
  {
    const std::lock_guard lock(mutex_);
    Lane& own = lanes_[lane];
    own.queue.push_back(std::move(task));
    if (GiveTurn(lane, own)) woken = Rouse();
  }
  if (woken != nullptr) woken->woken.notify_one();
}

bool Executor::GoOn(const std::string& lane) {
  const std::lock_guard lock(mutex_);
  Lane& own = lanes_[lane];
  if (!turns_.empty() || !own.queue.empty()) return false;
  --own.accepted;
  --accepted_;
  return true;
}

bool Executor::GiveTurn(const std::string& name, Lane& lane) {
  if (lane.in_turn || lane.queue.empty() || lane.running >= options_.threads_per_lane) return false;
  lane.in_turn = true;
  turns_.push_back(name);
  return true;
}

Executor::Worker* Executor::Rouse() {
  if (sleeping_.empty()) return nullptr;
  Worker* const worker = sleeping_.back();
  sleeping_.pop_back();
  worker->asleep = false;
  return worker;
}

void Executor::WakeAll() {
  while (Worker* const worker = Rouse()) worker->woken.notify_one();
}

void Executor::Await(Worker& self, std::unique_lock<std::mutex>& lock) {
  // A strand's running task may enqueue the next one, so the end waits for every task accepted.
  while (turns_.empty() && !(ending_ && accepted_ == 0)) {
    self.asleep = true;
    sleeping_.push_back(&self);
    self.woken.wait(lock, [&] { return !self.asleep; });
  }
}

void Executor::Run(Worker& self) {
  // On Linux each thread has a priority of its own, and 0 names the calling thread.
  if (options_.niceness > 0) {
    setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + options_.niceness);
  }
  std::unique_lock lock(mutex_);
  while (true) {
    Await(self, lock);
    if (turns_.empty()) return;
    const std::string name = std::move(turns_.front());
    turns_.pop_front();
    Lane& lane = lanes_[name];  // the entry stays while the lane has a task
    lane.in_turn = false;
    Task task = std::move(lane.queue.front());
    lane.queue.pop_front();
    ++lane.running;
    Worker* const woken = GiveTurn(name, lane) ? Rouse() : nullptr;
    lock.unlock();
    if (woken != nullptr) woken->woken.notify_one();
    {
      const Computing here;
      task();
      task = nullptr;
    }
    lock.lock();
    --lane.running;
    --lane.accepted;
    --accepted_;
    GiveTurn(name, lane);  // this thread is awake for it
    if (lane.accepted == 0) lanes_.erase(name);
    if (accepted_ > 0) continue;
    idle_.notify_all();
    if (ending_) WakeAll();
  }
}

absl::Status Strand::Submit(Task task, Admission admission) {
  POLYEST_RETURN_IF_ERROR(executor_.Reserve(lane_, admission));
  bool idle = false;
  {
    const std::lock_guard lock(mutex_);
    idle = tasks_.empty();
    tasks_.push_back(std::move(task));
  }
  if (idle) executor_.Enqueue(lane_, [self = shared_from_this()] { self->Run(); });
  return absl::OkStatus();
}

void Strand::Run() {
  while (true) {
    Task task;
    {
      const std::lock_guard lock(mutex_);
      task = std::move(tasks_.front());
    }
    task();
    task = nullptr;
    {
      const std::lock_guard lock(mutex_);
      tasks_.pop_front();
      if (tasks_.empty()) return;
    }
    // Where others wait, the next task goes to the end of the queue, so that a busy strand does not
    // keep them from their turn. Where nobody does, this thread runs it: no other needs to wake up.
    if (!executor_.GoOn(lane_)) break;
  }
  executor_.Enqueue(lane_, [self = shared_from_this()] { self->Run(); });
}

}  // namespace polyest::internal
