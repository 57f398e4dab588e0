// Tests what must not pass for knowledge, and what must be refused before it does harm.

#include <gmock/gmock.h>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/memory_store.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

// The samples are taken where x = 0 for every v0.
const std::vector<double> kZeroCrossings = {0.5, 1.0, 1.5, 2.0};

// The curvature of these priors at their modes is larger than 1/variance. Without information from
// the data this must not count as knowledge.
TEST(Verdicts, DoNotTakeTheSharpModeOfASkewedPriorForKnowledge) {
  for (const UncertainParameter& v0 : {*UncertainParameter::Gamma("v0", 1.05, 0.2, 0.5),
                                       *UncertainParameter::Gamma("v0", 2, 0.2, 0),
                                       *UncertainParameter::Beta("v0", 1.2, 8, 0.5, 1.5)}) {
    const Problem problem = InitialVelocityProblem(v0, 0.01);
    const Estimate estimate = EstimateOf(problem, InitialVelocityRecord(kZeroCrossings, 1.0, 0.01));
    EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kNotIdentified);
    EXPECT_TRUE(Has(estimate, DiagnosticCode::kNotIdentified));
  }
}

TEST(Verdicts, DoNotTakeTheWeightOfThePriorForKnowledge) {
  Problem problem = InitialVelocityProblem(*UncertainParameter::Normal("v0", 1, 0.2), 0.01);
  problem.regularization = 1000;
  const Estimate estimate = EstimateOf(problem, InitialVelocityRecord(kZeroCrossings, 1.0, 0.01));
  EXPECT_LT(estimate.parameters[0].contraction, 0.1);
  EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kNotIdentified);
}

TEST(EstimatorGuards, RefusesASampleThatWouldDrownTheOthersInRounding) {
  const Problem problem =
      InitialVelocityProblem(*UncertainParameter::Uniform("v0", 0.5, 1.5), 0.01);
  const Samples good = InitialVelocityRecord({0.1, 0.2, 0.3}, 1.0, 0.01);
  Samples bad = good;
  bad.columns[0].value[1] = 1e200;
  const auto estimator = MakeEstimator(problem);
  const absl::Status refused = estimator->Append(bad);
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()),
              HasSubstr("row 1 (counted from 0), column x: 1e+200"));
  EXPECT_EQ(estimator->rows_appended(), 0);
  EXPECT_TRUE(estimator->Append(good).ok());
}

// Acts as a disk that is full at the second batch and not at its repeat.
class FailingOnceStore final : public SampleStore {
 public:
  int64_t rows() const override { return samples_.rows(); }
  absl::Status Append(const RowBlock& block) override {
    if (++appends_ == 2) return absl::ResourceExhaustedError("no space left");
    return samples_.Append(block);
  }
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override {
    return samples_.Read(first, count, block);
  }

 private:
  MemoryStore samples_;
  int appends_ = 0;
};

TEST(EstimatorGuards, TakesABatchAgainThatTheStoreCouldNotTake) {
  const Problem problem =
      InitialVelocityProblem(*UncertainParameter::Uniform("v0", 0.5, 1.5), 0.01);
  EstimatorOptions options;
  options.store = std::make_shared<FailingOnceStore>();
  const auto estimator = MakeEstimator(problem, options);
  ASSERT_TRUE(estimator->Append(InitialVelocityRecord({0.1, 0.2}, 1.0, 0.01)).ok());
  const Samples second = InitialVelocityRecord({0.3, 0.4}, 1.0, 0.01, 2);
  EXPECT_EQ(estimator->Append(second).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(estimator->rows_appended(), 2);
  EXPECT_TRUE(estimator->Append(second).ok());
  EXPECT_EQ(estimator->rows_appended(), 4);
}

TEST(EstimatorGuards, BeginsWithAnEmptyStoreOnly) {
  const Problem problem =
      InitialVelocityProblem(*UncertainParameter::Uniform("v0", 0.5, 1.5), 0.01);
  EstimatorOptions options;
  options.store = std::make_shared<MemoryStore>();
  RowBlock row;
  row.rows.push_back({0, 0.1});
  row.values.push_back(1);
  row.noise.push_back(0.01);
  ASSERT_TRUE(options.store->Append(row).ok());
  EXPECT_EQ(Estimator::Make(problem, options).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EstimatorOptions no_threads;
  no_threads.threads = 0;
  EXPECT_EQ(Estimator::Make(problem, no_threads).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(Problem, RefusesAFixedAmplitudeOfAnInputWithoutASignal) {
  Problem problem = InitialVelocityProblem(*UncertainParameter::Uniform("v0", 0.5, 1.5), 0.01);
  problem.fixed["force.amplitude"] = 2;
  const absl::Status refused = ResolvedProblem::Make(problem).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("needs a signal for input force"));
}

}  // namespace
}  // namespace polyest::internal
