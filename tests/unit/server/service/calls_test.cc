#include "server/service/calls.h"

#include <gtest/gtest.h>

#include <future>
#include <new>

#include "tests/testing/fake_shared_journal.h"
#include "tests/testing/faulty_journal.h"

namespace polyest::internal {
namespace {

class WithoutMemory final : public FakeSharedJournal {
 public:
  absl::StatusOr<std::optional<SessionHead>> HeadOf(const std::string&,
                                                    const std::string&) const override {
    throw std::bad_alloc();
  }
};

TEST(JobOfSession, FailsWhereTheSessionCannotBeLookedForForLackOfMemory) {
  WithoutMemory shared;
  FaultyJournal journal;
  journal.Share(&shared);
  ModelLibrary models;
  OpenCalls calls;
  const auto access = AccessControl::Open({}).value();
  std::unique_ptr<SessionRegistry> sessions;
  Executor executor({.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10});
  const SessionServices services{.executor = executor, .journal = journal, .models = models};
  sessions = SessionRegistry::Open(services, [] { return google::protobuf::Timestamp(); }).value();
  const ServiceContext context{.executor = executor,
                               .intake = executor,
                               .sessions = *sessions,
                               .calls = calls,
                               .access = *access,
                               .stop = {},
                               .models = models,
                               .max_computing = std::chrono::seconds(60),
                               .wall_clock = {}};
  const auto job =
      JobOfSession(context, {.tenant = "t"}, "name", "sessions/a",
                   [](const std::shared_ptr<Session>&, const Stop&) { return absl::OkStatus(); });
  ASSERT_TRUE(job.ok()) << job.status();
  std::promise<absl::Status> worked;
  ASSERT_TRUE(job->submit([&] {
                   std::stop_source source;
                   worked.set_value(job->work(Stop(), source, [](const absl::Status&) { FAIL(); }));
                 })
                  .ok());
  EXPECT_EQ(worked.get_future().get().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace polyest::internal
