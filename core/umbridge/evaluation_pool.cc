#include "core/umbridge/evaluation_pool.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

using namespace std::chrono_literals;

constexpr int kMaxLosses = 10;
constexpr int kMaxBadAnswers = 3;
constexpr auto kLongestRest = 5s;
// Interval between two looks at the stop request and at slow points.
constexpr auto kLook = 20ms;
// A point is slow if it takes so many times the average, and never before kLook.
constexpr int kSlow = 3;

}  // namespace

EvaluationPool::EvaluationPool(EvaluationServers servers) : options_(std::move(servers)) {
  for (const std::string& url : options_.urls) servers_.push_back({.url = url});
}

EvaluationPool::~EvaluationPool() {
  std::unique_lock lock(mutex_);
  ends_ = true;
  work_.notify_all();
  // A request may begin after it was to be aborted, so that all are aborted until all have ended.
  while (ended_workers_ < workers_.size()) {
    lock.unlock();
    for (Worker& worker : workers_) worker.connection->Abort();
    lock.lock();
    answer_.wait_for(lock, kLook, [&] { return ended_workers_ == workers_.size(); });
  }
  lock.unlock();
  for (Worker& worker : workers_) worker.thread.join();
}

absl::StatusOr<std::vector<Evaluation>> EvaluationPool::Evaluate(size_t count, RequestOf request_of,
                                                                 const Stop& stop) {
  const auto job = std::make_shared<Job>();
  job->request_of = std::move(request_of);
  job->points.resize(count);
  for (size_t i = 0; i < count; ++i) job->waiting.push_back(i);
  job->left = count;
  std::unique_lock lock(mutex_);
  POLYEST_RETURN_IF_ERROR(StartWorkers());
  if (jobs_.empty()) {
    // What happened before the pause says nothing of now.
    for (Server& server : servers_) server = {.url = server.url};
  }
  jobs_.push_back(job);
  work_.notify_all();
  absl::Status status;
  while (job->left > 0 && !job->thrown && status.ok()) {
    answer_.wait_for(lock, kLook, [&] { return job->left == 0 || job->thrown; });
    status = stop.Check();
    if (status.ok()) status = CheckServers();
  }
  jobs_.remove(job);
  if (job->left > 0 && job->thrown) std::rethrow_exception(job->thrown);
  if (job->left > 0) return status;
  std::vector<Evaluation> results;
  for (Point& point : job->points) results.push_back(std::move(point.result));
  return results;
}

// Starts the threads with the first job, so that a model that nobody uses costs none.
absl::Status EvaluationPool::StartWorkers() {
  if (!workers_.empty()) return absl::OkStatus();
  workers_.reserve(servers_.size() * static_cast<size_t>(options_.requests_per_server));
  try {
    for (int i = 0; i < options_.requests_per_server; ++i) {
      for (Server& server : servers_) {
        Worker worker{std::make_unique<Connection>(server.url, options_.timeout_s), {}};
        Connection* const connection = worker.connection.get();
        worker.thread = std::thread([this, &server, connection] { Work(server, *connection); });
        workers_.push_back(std::move(worker));
      }
    }
  } catch (const std::system_error& refusal) {
    // The system allows no more threads: those that there are compute the points.
    if (workers_.empty()) {
      return absl::UnavailableError(
          absl::StrCat("no thread can be started to reach a server: ", refusal.what()));
    }
  }
  return absl::OkStatus();
}

void EvaluationPool::Work(Server& server, Connection& connection) {
  std::unique_lock lock(mutex_);
  while (!ends_) {
    if (Clock::now() < server.rests_until) {
      work_.wait_until(lock, server.rests_until);
      continue;
    }
    const std::optional<Task> task = Take(server);
    if (!task) {
      // Points become slow without notice.
      jobs_.empty() ? work_.wait(lock) : void(work_.wait_for(lock, kLook));
      continue;
    }
    Compute(server, connection, *task, lock);
  }
  ++ended_workers_;
  answer_.notify_all();
}

void EvaluationPool::Compute(Server& server, Connection& connection, const Task& task,
                             std::unique_lock<std::mutex>& lock) {
  Job& job = *task.job;
  const Clock::time_point since = Clock::now();
  Point& point = job.points[task.point];
  if (point.computations++ == 0) {
    point.computed_by = &server;
    point.since = since;
  }
  try {
    lock.unlock();
    const HttpReply reply = connection.Post("/Evaluate", job.request_of(task.point));
    lock.lock();
    Finish(server, task, reply, since);
  } catch (...) {
    // It ends the job, whose caller is told, and not the process.
    if (!lock.owns_lock()) lock.lock();
    job.thrown = std::current_exception();
    answer_.notify_all();
  }
}

std::optional<EvaluationPool::Task> EvaluationPool::Take(const Server& server) {
  if (auto task = TakeWaiting()) return task;
  return TakeSlow(server);
}

// Takes a point of the first job that has one, and puts this job last.
std::optional<EvaluationPool::Task> EvaluationPool::TakeWaiting() {
  for (auto job = jobs_.begin(); job != jobs_.end(); ++job) {
    if ((*job)->waiting.empty()) continue;
    const Task task{*job, (*job)->waiting.front()};
    (*job)->waiting.pop_front();
    jobs_.splice(jobs_.end(), jobs_, job);
    return task;
  }
  return std::nullopt;
}

// Returns the slowest point that one other server computes, if it is slow.
std::optional<EvaluationPool::Task> EvaluationPool::TakeSlow(const Server& server) const {
  const Clock::time_point now = Clock::now();
  std::optional<Task> slowest;
  Clock::duration longest{};
  for (const std::shared_ptr<Job>& job : jobs_) {
    if (job->answers == 0) continue;
    const Clock::duration slow =
        std::max<Clock::duration>(kSlow * job->computed / job->answers, kLook);
    for (size_t i = 0; i < job->points.size(); ++i) {
      const Point& point = job->points[i];
      if (point.done || point.computations != 1 || point.computed_by == &server) continue;
      const Clock::duration taken = now - point.since;
      if (taken <= slow || taken <= longest) continue;
      longest = taken;
      slowest = Task{job, i};
    }
  }
  return slowest;
}

void EvaluationPool::Finish(Server& server, const Task& task, const HttpReply& reply,
                            Clock::time_point since) {
  Job& job = *task.job;
  Point& point = job.points[task.point];
  --point.computations;
  const bool reached =
      reply.kind == HttpReply::Kind::kAnswered || reply.kind == HttpReply::Kind::kTimedOut;
  if (reached) {
    server.down_since.reset();
    server.rest = kFirstRest;
  } else {
    Rest(server, reply.text);
  }
  if (point.done) return;
  if (reply.kind == HttpReply::Kind::kAnswered) {
    absl::StatusOr<Vectors> outputs = ReadEvaluation(reply.status, reply.text);
    if (outputs.ok() || absl::IsFailedPrecondition(outputs.status())) {
      job.computed += Clock::now() - since;
      ++job.answers;
      SetResult(job, point,
                outputs.ok() ? Evaluation{*std::move(outputs), ""}
                             : Evaluation{{}, std::string(outputs.status().message())});
    } else if (++point.bad_answers >= kMaxBadAnswers) {
      SetResult(job, point, {{}, std::string(outputs.status().message())});
    }
  } else if (reply.kind == HttpReply::Kind::kTimedOut && ++point.bad_answers >= kMaxBadAnswers) {
    SetResult(job, point, {{}, reply.text});
  } else if (reply.kind == HttpReply::Kind::kLost && ++point.losses >= kMaxLosses) {
    SetResult(
        job, point,
        {{}, absl::StrFormat("%d connections were lost while it was computed", point.losses)});
  }
  if (point.done) {
    if (job.left == 0) answer_.notify_all();
  } else if (point.computations == 0) {
    job.waiting.push_front(task.point);
    work_.notify_one();
  }
}

void EvaluationPool::SetResult(Job& job, Point& point, Evaluation result) {
  point.result = std::move(result);
  point.done = true;
  --job.left;
}

void EvaluationPool::Rest(Server& server, const std::string& fault) {
  const Clock::time_point now = Clock::now();
  server.fault = fault;
  if (!server.down_since) server.down_since = now;
  server.rests_until = now + server.rest;
  server.rest = std::min<Clock::duration>(2 * server.rest, kLongestRest);
}

// Returns Unavailable with what is wrong with each server if all are down for too long.
absl::Status EvaluationPool::CheckServers() const {
  const Clock::time_point now = Clock::now();
  const std::chrono::duration<double> patience(options_.give_up_after_s);
  std::string faults;
  for (const Server& server : servers_) {
    if (!server.down_since || now - *server.down_since < patience) return absl::OkStatus();
    absl::StrAppend(&faults, faults.empty() ? "" : "; ", server.url, ": ", server.fault);
  }
  return absl::UnavailableError(absl::StrFormat(
      "no server could be reached for %g s (giveUpAfterS): %s", options_.give_up_after_s, faults));
}

}  // namespace polyest::internal
