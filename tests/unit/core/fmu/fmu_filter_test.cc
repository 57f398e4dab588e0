// Compares filters of FMUs for Model Exchange with those of the same equations in this process.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/propagation/filter_bank.h"
#include "tests/unit/core/fmu/fmu_ensemble.h"

namespace polyest::internal::fmu_filter_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

// Sixteen members of a model with two states share a block: these make three.
constexpr int kMembers = 35;
constexpr double kStepS = 0.05;

struct Filtered {
  Matrix innovations, log_variances;
};

FmuEnsemble Oscillators(std::shared_ptr<const Model> model) {
  FmuEnsemble ensemble(std::move(model), kMembers, {"x", "a"});
  ensemble.Set("m", 1);
  ensemble.Set("c", 0.3);
  ensemble.Set("x0", 1);
  ensemble.specification.process_noise.setZero(kMembers, 2);
  for (int member = 0; member < kMembers; ++member) {
    ensemble.Set("k", member, 30 + member / 4.0);
    ensemble.specification.process_noise(member, 1) = 0.01 * member;
  }
  return ensemble;
}
FmuEnsemble BuiltIn() {
  FmuEnsemble ensemble =
      Oscillators(std::make_shared<UnknownEquations>(*FindBuiltinModel("mass_spring_damper")));
  ensemble.specification.integration.method = IntegrationMethod::kExplicit;
  return ensemble;
}
FmuEnsemble Fmu(const char* name) { return Oscillators(*TestFmus().Find(name)); }

// Filters samples of the outputs at `count` times; a streamed force comes in as they do.
absl::StatusOr<Filtered> TryFilter(FmuEnsemble& ensemble, FilterBank& bank, int count,
                                   const Stop& stop = Stop()) {
  const Eigen::Index m = bank.outputs();
  Filtered filtered{Matrix(bank.members(), m * count), Matrix(bank.members(), m * count)};
  for (int k = 0; k < count; ++k) {
    const double time_s = kStepS * k;
    for (InputSignal& input : ensemble.inputs) {
      if (input.streamed()) input.Append(time_s, 2 * std::cos(3 * time_s));
    }
    const Matrix values = Matrix::Constant(m, 1, std::cos(5.5 * time_s));
    const Matrix noise = Matrix::Constant(m, 1, 0.1);
    const absl::Status status = bank.Advance({std::span(&time_s, 1), values, noise},
                                             filtered.innovations.middleCols(m * k, m),
                                             filtered.log_variances.middleCols(m * k, m), stop);
    if (!status.ok()) return status;
  }
  return filtered;
}

Filtered Filter(FmuEnsemble ensemble, int count = 40) {
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  absl::StatusOr<Filtered> filtered = TryFilter(ensemble, bank, count);
  EXPECT_TRUE(filtered.ok()) << filtered.status();
  EXPECT_THAT(bank.failures(), IsEmpty());
  return filtered.ok() ? *std::move(filtered) : Filtered{};
}

double Largest(const Matrix& matrix) { return matrix.cwiseAbs().maxCoeff(); }

class FmuFilters : public testing::TestWithParam<const char*> {};

TEST_P(FmuFilters, AreThoseOfTheBuiltInToRoundingErrors) {
  FmuEnsemble fmu = Fmu(GetParam()), built_in = BuiltIn();
  for (FmuEnsemble* ensemble : {&fmu, &built_in}) {
    ensemble->Drive("force", StreamedInput{.interpolation = Interpolation::kHold}, 1);
  }
  const Filtered a = Filter(fmu), b = Filter(built_in);
  EXPECT_LT(Largest(a.innovations - b.innovations), 1e-11 * Largest(b.innovations));
  EXPECT_LT(Largest(a.log_variances - b.log_variances), 1e-11 * Largest(b.log_variances));
}

TEST_P(FmuFilters, HaveTheSameBitsForAnyNumberOfWorkers) {
  FmuEnsemble one = Fmu(GetParam()), two = one;
  two.specification.threads = 2;
  const Filtered a = Filter(one), b = Filter(two);
  EXPECT_EQ(a.innovations, b.innovations);
  EXPECT_EQ(a.log_variances, b.log_variances);
}

INSTANTIATE_TEST_SUITE_P(Versions, FmuFilters,
                         testing::Values("oscillator_me2", "oscillator_me3", "once_me2"));

TEST(FmuFilter, PredictsAndSmoothsAsTheBuiltIn) {
  const auto smoothed = [](FmuEnsemble ensemble) {
    FilterBank bank(ensemble.specification, &ensemble.inputs);
    bank.StartBackward();
    EXPECT_TRUE(bank.Mark(0, Stop()).ok());
    EXPECT_TRUE(TryFilter(ensemble, bank, 20).ok());
    EXPECT_TRUE(bank.Mark(2, Stop()).ok());
    bank.FinishBackward();
    Matrix means(kMembers, 4), deviations(kMembers, 4);
    EXPECT_TRUE(bank.ReadMarked(0, 0, means.leftCols(2), deviations.leftCols(2)).ok());
    EXPECT_TRUE(bank.ReadMarked(1, 2, means.rightCols(2), deviations.rightCols(2)).ok());
    EXPECT_EQ(bank.State(), std::nullopt);
    return Filtered{means, deviations};
  };
  const Filtered a = smoothed(Fmu("oscillator_me2"));
  FmuEnsemble built_in = BuiltIn();
  built_in.specification.integration.samples_between_checkpoints = 1'000'000;
  const Filtered b = smoothed(built_in);
  EXPECT_LT(Largest(a.innovations - b.innovations), 1e-11 * Largest(b.innovations));
  EXPECT_LT(Largest(a.log_variances - b.log_variances), 1e-11 * Largest(b.log_variances));
}

FmuEnsemble Faulty(int members) {
  FmuEnsemble ensemble("faulty_me2", members, {"x"});
  ensemble.specification.process_noise.setConstant(members, 1, 0.01);
  return ensemble;
}

TEST(FmuFilter, LosesTheMemberWhoseInstanceFailsAndSaysWhatTheFmuSaid) {
  FmuEnsemble ensemble = Faulty(3);
  ensemble.Set("error_at", 1, 0.3);
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const auto filtered = TryFilter(ensemble, bank, 10);
  ASSERT_TRUE(filtered.ok()) << filtered.status();
  ASSERT_THAT(bank.failures(), SizeIs(1));
  EXPECT_EQ(bank.failures()[0].point, 1);
  EXPECT_THAT(bank.failures()[0].reason, HasSubstr("the test wants it"));
  EXPECT_TRUE(std::isnan(filtered->innovations(1, 9)));
  EXPECT_EQ(filtered->innovations(0, 9), filtered->innovations(2, 9));
}

TEST(FmuFilter, LosesTheMemberThatCannotStart) {
  FmuEnsemble ensemble = Fmu("oscillator_me2");
  ensemble.Set("m", 4, -1);
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  ASSERT_TRUE(TryFilter(ensemble, bank, 3).ok());
  ASSERT_THAT(bank.failures(), SizeIs(1));
  EXPECT_EQ(bank.failures()[0].point, 4);
  EXPECT_THAT(bank.failures()[0].reason, HasSubstr("the mass must be above 0"));
}

TEST(FmuFilter, EndsWithAnErrorThatSaysWhereTheFmuCrashed) {
  FmuEnsemble ensemble = Faulty(3);
  ensemble.Set("crash_at", 2, 0.3);
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const absl::Status status = TryFilter(ensemble, bank, 10).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(),
              HasSubstr("fmu faulty_me2: the worker was killed by signal 11 (Segmentation fault) "
                        "while evaluating derivatives at t = 0.3"));
}

TEST(FmuFilter, HeedsAStopWhileTheFmuHangs) {
  FmuEnsemble ensemble = Faulty(1);
  ensemble.Set("hang_at", 0, 0.3);
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const auto deadline = Stop::Clock::now() + std::chrono::milliseconds(500);
  EXPECT_EQ(TryFilter(ensemble, bank, 10, Stop({}, deadline)).status().code(),
            absl::StatusCode::kDeadlineExceeded);
}

TEST(FmuFilter, IsRefusedWhereStatesCannotBeSetOrEventsMayCome) {
  const auto why = [](const char* fmu) {
    return dynamic_cast<const SelfPropagatingModel&>(**TestFmus().Find(fmu)).WhyNotFiltered();
  };
  EXPECT_EQ(why("oscillator_me3"), "");
  EXPECT_THAT(why("oscillator_cs2"), HasSubstr("Co-Simulation"));
  EXPECT_THAT(why("ball_me2"), HasSubstr("1 event indicators"));
  EXPECT_THAT(why("ball_me3"), HasSubstr("event"));
  // What only the FMU itself knows is found when it starts.
  EXPECT_EQ(why("switch_me2"), "");
  FmuEnsemble ensemble("switch_me2", 1, {"x"});
  ensemble.specification.process_noise.setConstant(1, 1, 0.01);
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  EXPECT_EQ(
      TryFilter(ensemble, bank, 2).status().message(),
      "fmu switch_me2: filters need a model without events, but the FMU has one at t = 0.3 s");
}

}  // namespace
}  // namespace polyest::internal::fmu_filter_test
