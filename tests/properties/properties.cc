// Tests whether polyest is right, or admits that it is not, on random small problems whose
// posteriors are known exactly: one to four unknowns; models linear and nonlinear, oscillating and
// growing; samples regular, irregular, in bursts or late; bounded and unbounded priors, sometimes
// far from the truth; noise known, unknown or correlated.
//
//   properties COUNT [FIRST_SEED [MAX_SILENT [MAX_CRASH]]]
//   properties --show SEED
//
// Every problem is computed in a process of its own, two at a time, so that a crash counts as one
// failure; one that takes more than a minute of computing counts as a crash. Prints each problem
// that is not RIGHT with its seed, then the counts for each model. Exits with 1 if more than
// MAX_SILENT problems are SILENT or more than MAX_CRASH crash (0 unless given), or if more than one
// in twenty has no exact posterior to compare with.

#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "core/common/check.h"
#include "polyest/estimator.h"
#include "tests/properties/judge.h"

namespace polyest::internal::properties {
namespace {

constexpr rlim_t kSeconds = 60;  // of computing; waiting does not count
constexpr size_t kAtOnce = 2;
constexpr int kShareSkipped = 20;  // at most one in so many
constexpr size_t kJudgements = 5;

absl::StatusOr<Estimate> EstimateOf(const SmallProblem& small) {
  auto estimator = Estimator::Make(small.problem);
  if (!estimator.ok()) return estimator.status();
  const absl::Status appended = (*estimator)->Append(small.record);
  if (!appended.ok()) return appended;
  const absl::Status processed = (*estimator)->Process();
  if (!processed.ok()) return processed;
  return (*estimator)->CurrentEstimate();
}

Verdict Compare(const SmallProblem& small) {
  const std::optional<Moments> exact = ExactPosterior(small);
  if (!exact) return {Judgement::kSkipped, "the exact posterior was not resolved"};
  const absl::StatusOr<Estimate> estimate = EstimateOf(small);
  if (!estimate.ok()) return {Judgement::kCrash, std::string(estimate.status().message())};
  return Judge(*estimate, *exact);
}

struct Result {
  uint64_t seed = 0;
  std::string law;
  Verdict verdict;
};

// A child process that computes one problem and writes its verdict into a pipe.
struct Child {
  pid_t process = 0;
  int pipe = -1;
  Result result;
};

Child Begin(uint64_t seed) {
  int ends[2];
  POLYEST_CHECK(pipe(ends) == 0);
  std::fflush(stdout);
  Child child;
  child.result.seed = seed;
  child.process = fork();
  POLYEST_CHECK(child.process >= 0);
  if (child.process == 0) {
    const rlimit limit = {kSeconds, kSeconds + 5};
    setrlimit(RLIMIT_CPU, &limit);
    const SmallProblem small = DrawProblem(seed);
    const Verdict verdict = Compare(small);
    // One write of less than PIPE_BUF bytes is never divided.
    const std::string line =
        absl::StrFormat("%s\n%d\n%s", small.law.name, static_cast<int>(verdict.judgement),
                        verdict.note.substr(0, 1'000));
    _exit(write(ends[1], line.data(), line.size()) < 0 ? EXIT_FAILURE : EXIT_SUCCESS);
  }
  close(ends[1]);
  child.pipe = ends[0];
  return child;
}

Result Finish(Child child, int status) {
  std::array<char, 2'000> bytes;
  const ssize_t count = read(child.pipe, bytes.data(), bytes.size());
  close(child.pipe);
  const std::string text(bytes.data(), static_cast<size_t>(std::max<ssize_t>(count, 0)));
  const std::vector<std::string> lines = absl::StrSplit(text, absl::MaxSplits('\n', 2));
  if (lines.size() == 3) {
    child.result.law = lines[0];
    child.result.verdict = {static_cast<Judgement>(std::atoi(lines[1].c_str())), lines[2]};
    return child.result;
  }
  child.result.law = DrawProblem(child.result.seed).law.name;
  const bool slow = WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU;
  child.result.verdict.note =
      slow ? absl::StrFormat("no answer in %d s", static_cast<int>(kSeconds))
           : absl::StrFormat("ended by signal %d", WIFSIGNALED(status) ? WTERMSIG(status) : 0);
  return child.result;
}

void PrintFailure(const Result& result) {
  if (result.verdict.judgement == Judgement::kRight) return;
  std::printf("seed %d, %s: %s: %s\n", static_cast<int>(result.seed), result.law.c_str(),
              NameOf(result.verdict.judgement), result.verdict.note.c_str());
}

std::vector<Result> RunAll(uint64_t first, int count) {
  std::vector<Result> results;
  std::vector<Child> running;
  uint64_t next = first;
  while (next < first + static_cast<uint64_t>(count) || !running.empty()) {
    if (running.size() < kAtOnce && next < first + static_cast<uint64_t>(count)) {
      running.push_back(Begin(next++));
      continue;
    }
    int status = 0;
    const pid_t process = wait(&status);
    const auto ended = std::ranges::find(running, process, &Child::process);
    POLYEST_CHECK(ended != running.end());
    results.push_back(Finish(*ended, status));
    running.erase(ended);
    PrintFailure(results.back());
  }
  return results;
}

using Counts = std::array<int, kJudgements>;

void PrintCounts(const std::string& name, const Counts& counts) {
  std::printf("| %-14s | %5d | %6d | %6d | %5d | %7d |\n", name.c_str(), counts[0], counts[1],
              counts[2], counts[3], counts[4]);
}

Counts PrintTable(const std::vector<Result>& results) {
  std::map<std::string, Counts> by_law;
  Counts all = {};
  for (const Result& result : results) {
    const auto column = static_cast<size_t>(result.verdict.judgement);
    ++by_law[result.law][column];
    ++all[column];
  }
  std::printf(
      "| model          | RIGHT | HONEST | SILENT | CRASH | skipped "
      "|\n|---|---|---|---|---|---|\n");
  for (const auto& [law, counts] : by_law) PrintCounts(law, counts);
  PrintCounts("all", all);
  return all;
}

int Run(uint64_t first, int count, int max_silent, int max_crash) {
  const std::vector<Result> results = RunAll(first, count);
  const Counts all = PrintTable(results);
  const bool good = all[static_cast<size_t>(Judgement::kSilent)] <= max_silent &&
                    all[static_cast<size_t>(Judgement::kCrash)] <= max_crash &&
                    kShareSkipped * all[static_cast<size_t>(Judgement::kSkipped)] <= count;
  if (!good) std::printf("more failures than %d SILENT and %d CRASH\n", max_silent, max_crash);
  return good ? EXIT_SUCCESS : EXIT_FAILURE;
}

// Prints one problem, its exact posterior and its estimate.
int Show(uint64_t seed) {
  const SmallProblem small = DrawProblem(seed);
  std::printf("seed %d, %s\n", static_cast<int>(seed), Describe(small).c_str());
  const std::optional<Moments> exact = ExactPosterior(small);
  const absl::StatusOr<Estimate> estimate = EstimateOf(small);
  if (!estimate.ok()) std::printf("%s\n", estimate.status().ToString().c_str());
  for (size_t i = 0; i < small.problem.uncertain.size(); ++i) {
    std::printf("%s:", small.problem.uncertain[i].name.c_str());
    const auto k = static_cast<Eigen::Index>(i);
    if (exact) std::printf(" exact %.8g ± %.3g;", exact->mean[k], exact->std_dev[k]);
    if (!estimate.ok()) continue;
    const ParameterEstimate& one = estimate->parameters[i];
    std::printf(" polyest %.8g ± %.3g in [%.8g, %.8g], minimum %.8g ± %.3g\n", one.mean,
                one.posterior_std_dev, one.lower95, one.upper95, one.map, one.std_dev);
  }
  if (!estimate.ok()) return EXIT_FAILURE;
  std::printf("order %d, %d re-expansions, %d trajectories\n", estimate->expansion.order,
              estimate->expansion.reexpansions, static_cast<int>(estimate->expansion.trajectories));
  for (const Diagnostic& one : estimate->diagnostics) std::printf("%s\n", one.message.c_str());
  if (exact) std::printf("%s\n", NameOf(Judge(*estimate, *exact).judgement));
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace polyest::internal::properties

int main(int argc, char** argv) {
  using polyest::internal::properties::Run;
  using polyest::internal::properties::Show;
  if (argc == 3 && std::string(argv[1]) == "--show")
    return Show(std::strtoull(argv[2], nullptr, 10));
  const auto argument = [&](int i, int preset) { return argc > i ? std::atoi(argv[i]) : preset; };
  const int count = argument(1, 100);
  if (count <= 0) {
    std::fprintf(stderr, "properties: COUNT must be at least 1\n");
    return 2;
  }
  return Run(static_cast<uint64_t>(argument(2, 1)), count, argument(3, 0), argument(4, 0));
}
