#include "server/service/calls.h"

#include <gtest/gtest.h>

#include <future>
#include <new>

#include "tests/testing/fake_shared_journal.h"
#include "tests/unit/server/service/service_fixture.h"

namespace polyest::internal {
namespace {

class WithoutMemory final : public FakeSharedJournal {
 public:
  absl::StatusOr<std::optional<SessionHead>> HeadOf(const std::string&,
                                                    const std::string&) const override {
    throw std::bad_alloc();
  }
};

class JobOfSessionTest : public ServiceTest {
 protected:
  void SetUp() override {
    journal_.Share(&shared_);
    ServiceTest::SetUp();
  }

  WithoutMemory shared_;
};

TEST_F(JobOfSessionTest, FailsWhereTheSessionCannotBeLookedForForLackOfMemory) {
  const ServiceContext context = Context();
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
