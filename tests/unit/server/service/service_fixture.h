#pragma once

// Has what the services of a daemon need, within the test's process: sessions in a journal in
// memory that a test can make fail, and executors of one thread each.

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "server/service/service_context.h"
#include "tests/testing/faulty_journal.h"

namespace polyest::internal {

class ServiceTest : public testing::Test {
 protected:
  // `capacity` is the number of tasks that each executor accepts.
  explicit ServiceTest(int capacity = 10)
      : one_thread_{.threads_per_lane = 1,
                    .threads = 1,
                    .capacity = capacity,
                    .capacity_per_lane = capacity} {}

  void SetUp() override {
    const SessionServices services{.executor = executor_, .journal = journal_, .models = models_};
    sessions_ =
        SessionRegistry::Open(services, [] { return google::protobuf::Timestamp(); }).value();
  }
  // Makes a context that lets in everybody, or whoever has a token of the file. Those who have none
  // belong to the tenant "default".
  ServiceContext Context(const std::string& token_file = "") {
    access_ = AccessControl::Open({.token_file = token_file}).value();
    return {.executor = executor_,
            .intake = intake_,
            .sessions = *sessions_,
            .calls = calls_,
            .access = *access_,
            .stop = {},
            .models = models_,
            .max_computing = std::chrono::seconds(60),
            .wall_clock = {}};
  }

  FaultyJournal journal_;
  ModelLibrary models_;
  OpenCalls calls_;
  std::unique_ptr<AccessControl> access_;
  std::unique_ptr<SessionRegistry> sessions_;
  const ExecutorOptions one_thread_;
  // The executors are destroyed first, so that they finish their tasks while the rest still exists.
  Executor executor_{one_thread_};
  Executor intake_{one_thread_};
};

}  // namespace polyest::internal
