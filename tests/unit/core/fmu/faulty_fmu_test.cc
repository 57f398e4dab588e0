// Tests FMUs that fail, at single points or altogether. They must leave nothing behind.

#include <absl/cleanup/cleanup.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "core/common/sanitizer.h"
#include "core/fmu/worker_ensemble.h"
#include "tests/unit/core/fmu/fmu_ensemble.h"

namespace polyest::internal {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

#if POLYEST_ADDRESS_SANITIZER || POLYEST_THREAD_SANITIZER
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

// Puts temporary files into a folder of the test's own, in which nothing may remain.
class FaultyFmu : public testing::Test {
 protected:
  FaultyFmu() {
    std::string folder = testing::TempDir() + "polyest-faulty-XXXXXX";
    temporary_ = mkdtemp(folder.data());
    setenv("TMPDIR", temporary_.c_str(), 1);
  }
  ~FaultyFmu() override {
    unsetenv("TMPDIR");
    std::filesystem::remove_all(temporary_);
  }

  void ExpectNothingLeft() {
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "a worker is left";
    EXPECT_TRUE(std::filesystem::is_empty(temporary_)) << "a folder is left";
  }

  // Returns why the simulation of one point as a whole is lost.
  std::string Error(const char* fault, double time_s, const WorkerLimits& limits = {},
                    const Stop& stop = Stop()) {
    absl::Status status;
    {
      FmuEnsemble ensemble("faulty_cs2", 1, {"x"}, limits);
      ensemble.Set(fault, 0, time_s);
      status = ensemble.TryPropagate({0.25, 0.5}, stop).status();
    }
    ExpectNothingLeft();
    EXPECT_FALSE(status.ok());
    code_ = status.code();
    return std::string(status.message());
  }

  std::filesystem::path temporary_;
  absl::StatusCode code_ = absl::StatusCode::kOk;
};

TEST_F(FaultyFmu, ThatCrashesCostsAnErrorThatSaysWhere) {
  EXPECT_THAT(Error("crash_at", 0.31),
              AllOf(HasSubstr("fmu faulty_cs2: the worker was killed by signal 11"),
                    HasSubstr("while doing a step at t = 0.3"), HasSubstr("about to crash")));
  EXPECT_EQ(code_, absl::StatusCode::kFailedPrecondition);
}

TEST_F(FaultyFmu, ThatEndsItsProcessCostsAnError) {
  EXPECT_THAT(Error("exit_at", 0.31), HasSubstr("the worker ended with status 7"));
}

TEST_F(FaultyFmu, ThatHangsIsStoppedAfterTheTimeLimit) {
  EXPECT_THAT(Error("hang_at", 0.31, {.longest_call = std::chrono::milliseconds(2000)}),
              AllOf(HasSubstr("one call took longer than 2 s"),
                    HasSubstr("while doing a step at t = 0.3")));
}

TEST_F(FaultyFmu, ThatHangsHeedsAStop) {
  const auto deadline = Stop::Clock::now() + std::chrono::milliseconds(500);
  Error("hang_at", 0.31, {}, Stop({}, deadline));
  EXPECT_EQ(code_, absl::StatusCode::kDeadlineExceeded);
}

TEST_F(FaultyFmu, ThatLeaksMeetsItsLimitOfMemory) {
  if (kSanitized) GTEST_SKIP() << "a sanitized worker has no limit of memory";
  EXPECT_THAT(Error("leak_at", 0.31, {.max_memory_bytes = int64_t{512} << 20}),
              AllOf(HasSubstr("was killed by signal 11"), HasSubstr("the limit is 512 MiB")));
}

TEST_F(FaultyFmu, WithoutAFunctionIsRefused) {
  FmuEnsemble ensemble("without_step_cs2", 1, {"x"});
  EXPECT_THAT(ensemble.TryPropagate({1}).status().message(),
              HasSubstr("has no function fmi2DoStep"));
}

// Temporary files of a daemon that runs for weeks may be cleaned up under it.
TEST_F(FaultyFmu, WhoseFilesWereRemovedIsUnpackedAgain) {
  FmuEnsemble ensemble("faulty_cs2", 1, {"x"});
  const Matrix before = ensemble.Propagate({0.25});
  for (const auto& folder : std::filesystem::directory_iterator(temporary_)) {
    std::filesystem::remove_all(folder);
  }
  EXPECT_EQ(ensemble.Propagate({0.25}), before);
}

// Were it FailedPrecondition, a session would leave out the rows of which that says nothing.
TEST_F(FaultyFmu, WhoseLibraryCannotBeLoadedIsUnavailable) {
  FmuEnsemble ensemble("faulty_cs2", 1, {"x"});
  ensemble.Propagate({0.25});
  for (const auto& file : std::filesystem::recursive_directory_iterator(temporary_)) {
    if (file.path().extension() == ".so") std::ofstream(file.path()) << "no library";
  }
  const absl::Status status = ensemble.TryPropagate({0.25}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), HasSubstr("fmu faulty_cs2: its library cannot be loaded"));
}

// Propagates three points. The middle one fails at 0.3 s, or earlier if a step led there.
void ExpectOneFailure(const char* fmu, const char* fault, const char* reason,
                      bool sees_ahead = false) {
  SCOPED_TRACE(fmu);
  FmuEnsemble ensemble(fmu, 3, {"x"});
  ensemble.Set(fault, 1, 0.3);
  ensemble.Set("rate", 0, 2);
  const Matrix x = ensemble.Propagate({0.2, 0.4});
  ASSERT_THAT(ensemble.failures, SizeIs(1));
  EXPECT_EQ(ensemble.failures[0].point, 1);
  EXPECT_THAT(ensemble.failures[0].reason, HasSubstr(reason));
  EXPECT_LE(ensemble.failures[0].time_s, 0.3);
  // A straight line is exact, except for rounding.
  EXPECT_NEAR(x(0, 1), 0.8, 1e-12);
  if (!sees_ahead) {
    EXPECT_NEAR(x(1, 0), 0.2, 1e-12);
  }
  EXPECT_TRUE(std::isnan(x(1, 1)));
  EXPECT_NEAR(x(2, 1), 0.4, 1e-12);
}

TEST_F(FaultyFmu, ThatReportsAnErrorAtOnePointLosesThatPointOnly) {
  ExpectOneFailure("faulty_cs2", "error_at", "reported an error while doing a step");
  ExpectOneFailure("faulty_cs2", "error_at", "the test wants it");
  // An instance must not be asked for anything after an error, even if only a long step caused the
  // error.
  ExpectOneFailure("faulty_me2", "error_at", "the test wants it", /*sees_ahead=*/true);
}

TEST_F(FaultyFmu, ThatDiscardsAStepAtOnePointLosesThatPointOnly) {
  ExpectOneFailure("faulty_cs2", "discard_at", "discarded it while doing a step");
  ExpectOneFailure("faulty_me2", "discard_at", "discarded it while evaluating derivatives");
}

TEST_F(FaultyFmu, ThatIsNotFiniteAtOnePointLosesThatPointOnly) {
  ExpectOneFailure("faulty_cs2", "nan_at", "not finite");
  ExpectOneFailure("faulty_me2", "nan_at", "");
}

TEST_F(FaultyFmu, ThatFailsToStartAtOnePointLosesThatPointOnly) {
  for (const char* fmu : {"oscillator_me2", "oscillator_me3", "oscillator_cs2", "oscillator_cs3"}) {
    FmuEnsemble ensemble(fmu, 2, {"x"});
    ensemble.Set("m", 0, -1);
    ensemble.Set("x0", 1, 1);
    const Matrix x = ensemble.Propagate({0, 1});
    ASSERT_THAT(ensemble.failures, SizeIs(1)) << fmu;
    EXPECT_THAT(ensemble.failures[0].reason, HasSubstr("the mass must be above 0")) << fmu;
    EXPECT_TRUE(std::isnan(x(0, 0)));
    EXPECT_EQ(x(1, 0), 1);
  }
}

TEST_F(FaultyFmu, IsNotCalledAtAPointWhoseParametersOrInputsAreNotFinite) {
  for (const char* fmu : {"oscillator_me2", "oscillator_me3", "oscillator_cs2", "oscillator_cs3"}) {
    FmuEnsemble ensemble(fmu, 3, {"x"});
    ensemble.Set("x0", 1);
    ensemble.Set("m", 0, std::nan(""));
    ensemble.Drive("force", ConstantInput{1}, 0);
    ensemble.specification.amplitudes(2, 0) = std::nan("");
    const Matrix x = ensemble.Propagate({0, 1});
    ASSERT_THAT(ensemble.failures, SizeIs(2)) << fmu;
    for (const PointFailure& failure : ensemble.failures) {
      EXPECT_EQ(failure.reason, "a parameter or an input is not finite; the model is not called");
      EXPECT_TRUE(std::isnan(x(failure.point, 0)) && std::isnan(x(failure.point, 1)));
    }
    EXPECT_EQ(x(1, 0), 1);
    EXPECT_TRUE(std::isfinite(x(1, 1)));
  }
}

TEST_F(FaultyFmu, LeavesNothingBehindWhenAllGoesWell) {
  {
    FmuEnsemble ensemble("oscillator_me2", 70, {"x"});
    ensemble.specification.threads = 2;
    ensemble.Propagate({1});
    EXPECT_FALSE(std::filesystem::is_empty(temporary_));
  }
  ExpectNothingLeft();
}

TEST_F(FaultyFmu, EndsWithAProcessThatDies) {
  // Orphans become this process's children, so that their end can be awaited.
  ASSERT_EQ(prctl(PR_SET_CHILD_SUBREAPER, 1), 0);
  const pid_t child = fork();
  if (child == 0) {
    alarm(1);  // kills this process while the FMU hangs
    FmuEnsemble ensemble("faulty_cs2", 1, {"x"});
    ensemble.Set("hang_at", 0, 0.1);
    (void)ensemble.TryPropagate({1});
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM);
  // The worker ends although its FMU hangs.
  EXPECT_GT(waitpid(-1, &status, 0), 0);
  prctl(PR_SET_CHILD_SUBREAPER, 0);
  // The folder of the dead process remains until the next one is made.
  EXPECT_FALSE(std::filesystem::is_empty(temporary_));
  {
    FmuEnsemble ensemble("oscillator_me2", 1, {"x"});
    ensemble.Propagate({1});
  }
  ExpectNothingLeft();
}

TEST_F(FaultyFmu, ThatTakesOneStepSizeOnlyFailsBetweenItsSteps) {
  FmuEnsemble ensemble("stepwise_cs2", 1, {"x"});
  ensemble.Set("x0", 0, 1);
  ensemble.Propagate({0.25, 0.5});
  EXPECT_THAT(ensemble.failures, IsEmpty());
  ensemble.Propagate({0.25, 0.50037});
  ASSERT_THAT(ensemble.failures, SizeIs(1));
  EXPECT_THAT(ensemble.failures[0].reason, HasSubstr("steps of 0.001 s only"));
}

TEST_F(FaultyFmu, ThatCanBeInstantiatedOnceServesManyPointsByItsState) {
  for (const auto& [once, many] :
       {std::pair{"once_me2", "oscillator_me2"}, std::pair{"once_cs2", "oscillator_cs2"}}) {
    FmuEnsemble ensemble(once, 3, {"x", "v"});
    FmuEnsemble reference(many, 3, {"x", "v"});
    for (int point = 0; point < 3; ++point) {
      for (FmuEnsemble* each : {&ensemble, &reference}) {
        each->Set("x0", point, 1 + point);
        each->Set("k", point, 4 + point);
      }
    }
    EXPECT_EQ(ensemble.Propagate({0.5, 1}), reference.Propagate({0.5, 1})) << once;
  }
}

TEST_F(FaultyFmu, ThatCanBeInstantiatedOnceWithoutStateHasAProcessForEachPoint) {
  FmuEnsemble reference("oscillator_cs2", 5, {"x"});
  for (int point = 0; point < 5; ++point) reference.Set("x0", point, 1 + point);
  const Matrix expected = reference.Propagate({0.5, 1});
  for (const int threads : {1, 2, 8}) {
    FmuEnsemble ensemble("once_without_state_cs2", 5, {"x"});
    for (int point = 0; point < 5; ++point) ensemble.Set("x0", point, 1 + point);
    ensemble.specification.threads = threads;
    EXPECT_EQ(ensemble.Propagate({0.5, 1}), expected) << threads;
  }
  FmuEnsemble one("once_without_state_cs2", 1, {"x"});
  EnsemblePropagator propagator(one.specification, &one.inputs);
  Matrix output(1, 1);
  ASSERT_TRUE(propagator.Advance(std::vector{0.1}, output, Stop()).ok());
  FmuEnsemble many("once_without_state_cs2", WorkerEnsemble::kMaxOfOneTrajectory, {"x"});
  const absl::Status refused = many.TryPropagate({0.1}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("256 trajectories need as many processes"),
                                       HasSubstr("and 1 are in use")));
}

TEST_F(FaultyFmu, NeedsTheProgramThatRunsIt) {
  setenv("POLYEST_FMU_WORKER", "/nowhere", 1);
  const absl::Cleanup unset = [] { unsetenv("POLYEST_FMU_WORKER"); };
  FmuEnsemble ensemble("oscillator_me2", 1, {"x"});
  const absl::Status missing = ensemble.TryPropagate({1}).status();
  EXPECT_EQ(missing.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(missing.message(), HasSubstr("POLYEST_FMU_WORKER: \"/nowhere\""));
}

}  // namespace
}  // namespace polyest::internal
