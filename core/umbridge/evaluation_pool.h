#pragma once

// Evaluates a model at many points on several servers at once. A model is a pure function of its
// request, so that a point may be computed anywhere and more than once: results depend on nothing
// but the requests.
//
// - Points of a server that dies are computed by the others. A server that cannot be reached is
//   left alone for a while that doubles from 0.1 s to 5 s.
// - When nothing else is left to do, a point that takes over three times the average is computed by
//   another server as well, and the first answer counts.
// - A point fails by the model's own error, by three answers that are none, or if ten connections
//   break while it is computed.

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/umbridge/connection.h"
#include "core/umbridge/model_file.h"
#include "core/umbridge/protocol.h"
#include "polyest/stop.h"

namespace polyest::internal {

// What came of one point: the model's outputs, or why there are none.
struct Evaluation {
  Vectors outputs;
  std::string failure;  // empty: none
};

// Thread-safe. Callers share the servers in turns, point by point.
class EvaluationPool {
 public:
  explicit EvaluationPool(EvaluationServers servers);
  // Ends the requests that are being computed for nobody.
  ~EvaluationPool();

  // Writes the i-th request for /Evaluate whenever it is sent: from any thread, at once with
  // others, and even after Evaluate has returned. The same one each time. What it throws ends
  // Evaluate.
  using RequestOf = std::function<std::string(size_t)>;

  // Returns what came of each of `count` requests, in their order. Returns Cancelled or
  // DeadlineExceeded on a stop request, Unavailable if no server could be reached for
  // EvaluationServers::give_up_after_s.
  absl::StatusOr<std::vector<Evaluation>> Evaluate(size_t count, RequestOf request_of,
                                                   const Stop& stop);

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kFirstRest{100};

  struct Server {
    std::string url;
    Clock::time_point rests_until = {};
    std::optional<Clock::time_point> down_since = {};  // while it cannot be reached
    Clock::duration rest = kFirstRest;                 // the next time
    std::string fault = {};                            // why it cannot be reached
  };
  struct Point {
    const Server* computed_by = nullptr;  // the first that computes it now
    Clock::time_point since{};
    int computations = 0;  // going on
    int losses = 0;
    int bad_answers = 0;
    bool done = false;
    Evaluation result;
  };
  struct Job {
    RequestOf request_of;
    std::vector<Point> points;
    std::deque<size_t> waiting;
    size_t left = 0;  // points that are not done
    Clock::duration computed{};
    int answers = 0;
    std::exception_ptr thrown;  // while one of its points was computed
  };
  struct Task {
    std::shared_ptr<Job> job;
    size_t point = 0;
  };
  struct Worker {
    std::unique_ptr<Connection> connection;
    std::thread thread;
  };

  absl::Status StartWorkers();
  void Work(Server& server, Connection& connection);
  // Computes a point and takes what comes of it. The mutex, which `lock` holds, is free meanwhile.
  void Compute(Server& server, Connection& connection, const Task& task,
               std::unique_lock<std::mutex>& lock);
  std::optional<Task> Take(const Server& server);
  std::optional<Task> TakeWaiting();
  std::optional<Task> TakeSlow(const Server& server) const;
  void Finish(Server& server, const Task& task, const HttpReply& reply, Clock::time_point since);
  static void SetResult(Job& job, Point& point, Evaluation result);
  void Rest(Server& server, const std::string& fault);
  absl::Status CheckServers() const;

  EvaluationServers options_;
  std::mutex mutex_;
  std::condition_variable work_;    // for workers
  std::condition_variable answer_;  // for callers
  std::vector<Server> servers_;
  std::vector<Worker> workers_;  // none before the first job
  size_t ended_workers_ = 0;
  std::list<std::shared_ptr<Job>> jobs_;  // the next one to serve first
  bool ends_ = false;
};

}  // namespace polyest::internal
