// Measures an estimate and an update as the record grows. After 10³ and after 10⁶ samples, an
// estimate must take the same time and the estimator the same memory, without the stored samples.

#include <benchmark/benchmark.h>
#include <malloc.h>

#include <cstdio>
#include <map>
#include <memory>
#include <random>

#include "core/common/check.h"
#include "core/estimator/estimator_access.h"
#include "polyest/catalogue.h"
#include "polyest/estimator.h"

namespace polyest::internal {
namespace {

constexpr int64_t kShort = 1'000;
constexpr int64_t kLong = 1'000'000;
constexpr double kStep = 0.01;   // s
constexpr double kNoise = 0.01;  // m
constexpr size_t kBatchRows = 30;

// Returns a damped oscillator that a force keeps in motion, so that its record can have any length.
Problem DrivenOscillator() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}};
  problem.uncertain = {*UncertainParameter::Uniform("k", 32, 47),
                       *UncertainParameter::Uniform("c", 0.5, 1.5)};
  problem.inputs = {{"force", SinusoidInput{10, 0.8, 0}}};
  problem.measured = {{"x", {.absolute = kNoise}}};
  return problem;
}

// A store of samples in memory whose size is known, so that it can be subtracted from the memory of
// the estimator.
class CountedStore final : public SampleStore {
 public:
  int64_t rows() const override { return static_cast<int64_t>(time_s_.size()); }
  absl::Status Append(const RowBlock& block) override {
    for (const SampleRow& row : block.rows) time_s_.push_back(row.time_s);
    value_.insert(value_.end(), block.values.begin(), block.values.end());
    return absl::OkStatus();
  }
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override {
    block.rows.clear();
    for (int64_t i = first; i < first + count; ++i) {
      block.rows.push_back({0, time_s_[static_cast<size_t>(i)]});
    }
    block.values.assign(value_.begin() + first, value_.begin() + first + count);
    block.noise.assign(static_cast<size_t>(count), kNoise);
    return absl::OkStatus();
  }
  size_t bytes() const { return (time_s_.capacity() + value_.capacity()) * sizeof(double); }

 private:
  std::vector<double> time_s_;
  std::vector<double> value_;
};

// An estimator with its record, which is simulated by the model at k = 40, c = 1, with noise.
class Rig {
 public:
  Rig()
      : heap_before_(HeapBytes()),
        resolved_(*ResolvedProblem::Make(DrivenOscillator())),
        inputs_(resolved_.MakeInputs()) {
    EstimatorOptions options;
    options.store = store_;
    estimator_ = *EstimatorAccess::Make(resolved_, options);
    Matrix truth(1, 2);
    truth << 40, 1;
    truth_ = std::make_unique<EnsemblePropagator>(
        resolved_.MakeEnsemble(truth, resolved_.outputs(), 1), &inputs_);
  }

  Samples Next(size_t rows) {
    Samples samples;
    for (size_t i = 0; i < rows; ++i) samples.time_s.push_back(kStep * static_cast<double>(++row_));
    Matrix outputs(1, static_cast<Eigen::Index>(rows));
    POLYEST_CHECK(truth_->Advance(samples.time_s, outputs, Stop()).ok());
    samples.columns.push_back({"x", {}, {}});
    for (size_t i = 0; i < rows; ++i) {
      samples.columns[0].value.push_back(outputs(0, static_cast<Eigen::Index>(i)) +
                                         noise_(generator_));
    }
    return samples;
  }

  void Take(const Samples& samples) {
    POLYEST_CHECK(estimator_->Append(samples).ok());
    POLYEST_CHECK(estimator_->Process().ok());
  }

  void RunTo(int64_t rows) {
    while (row_ < rows) Take(Next(static_cast<size_t>(std::min<int64_t>(1000, rows - row_))));
  }

  Estimate Now() const { return *estimator_->CurrentEstimate(); }
  double HeapBesideSamples() const {
    return HeapBytes() - heap_before_ - static_cast<double>(store_->bytes());
  }

 private:
  // Returns the bytes in use on the heap and in blocks mapped separately.
  static double HeapBytes() {
    const struct mallinfo2 info = mallinfo2();
    return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
  }

  double heap_before_;
  ResolvedProblem resolved_;
  InputSignals inputs_;
  std::shared_ptr<CountedStore> store_ = std::make_shared<CountedStore>();
  std::unique_ptr<Estimator> estimator_;
  std::unique_ptr<EnsemblePropagator> truth_;
  int64_t row_ = 0;
  std::mt19937_64 generator_{1};
  std::normal_distribution<double> noise_{0, kNoise};
};

void EstimateAfter(benchmark::State& state) {
  Rig rig;
  rig.RunTo(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(rig.Now());
  state.counters["heap_KiB"] = rig.HeapBesideSamples() / 1024;
  state.counters["trajectories"] = static_cast<double>(rig.Now().expansion.trajectories);
}
BENCHMARK(EstimateAfter)->Arg(kShort)->Arg(kLong)->Iterations(20)->Unit(benchmark::kMillisecond);

void UpdateOfABatch(benchmark::State& state) {
  Rig rig;
  rig.RunTo(kShort);
  for (auto _ : state) {
    state.PauseTiming();
    const Samples samples = rig.Next(kBatchRows);
    state.ResumeTiming();
    rig.Take(samples);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(kBatchRows));
}
BENCHMARK(UpdateOfABatch)->Iterations(1000)->Unit(benchmark::kMicrosecond);

// Prints the usual table and then the ratios of the long record to the short one.
class RatioReporter final : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      if (!run.counters.contains("heap_KiB")) continue;
      const int64_t rows =
          run.benchmark_name().find(std::to_string(kLong)) == std::string::npos ? kShort : kLong;
      time_[rows] = run.GetAdjustedCPUTime();
      heap_[rows] = run.counters.at("heap_KiB");
    }
  }

  void Finalize() override {
    if (time_.size() < 2) return;
    std::printf(
        "after 10^6 samples against after 10^3: estimate %.2f times as long, memory beside "
        "the samples %.2f times as much\n",
        time_[kLong] / time_[kShort], heap_[kLong] / heap_[kShort]);
  }

 private:
  std::map<int64_t, double> time_, heap_;
};

}  // namespace
}  // namespace polyest::internal

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  polyest::internal::RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();
  return 0;
}
