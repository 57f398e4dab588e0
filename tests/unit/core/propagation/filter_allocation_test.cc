#include <gtest/gtest.h>

#include <vector>

#include "core/propagation/filter_bank.h"
#include "polyest/equation_model.h"
#include "tests/testing/count_allocations.h"
#include "tests/unit/core/propagation/ensemble.h"

#if POLYEST_COUNTS_ALLOCATIONS

namespace polyest::internal {
namespace {

Ensemble Oscillators(IntegrationMethod method) {
  Ensemble ensemble("mass_spring_damper", 20, {"x", "v"});
  ensemble.specification.integration.method = method;
  return ensemble;
}

// Returns how often memory is allocated for 20 samples, after the first 5, of 20 filters of two
// outputs and two states.
int AllocationsOf(Ensemble ensemble) {
  ensemble.specification.process_noise.setConstant(20, 2, 0.01);
  const int at_first = testing::allocations;
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  EXPECT_GT(testing::allocations, at_first);  // the counter counts
  const std::vector<double> times_s = TimesUntil(1.2, 0.05);
  const Matrix values = Matrix::Constant(2, 25, 0.1), noise = Matrix::Constant(2, 25, 0.01);
  Matrix innovations(20, 40), log_variances(20, 40);
  const auto advance = [&](size_t first, size_t count) {
    const auto begin = static_cast<Eigen::Index>(first), columns = static_cast<Eigen::Index>(count);
    const FilterSamples samples{{times_s.data() + first, count},
                                values.middleCols(begin, columns),
                                noise.middleCols(begin, columns)};
    EXPECT_TRUE(bank.Advance(samples, innovations.leftCols(2 * columns),
                             log_variances.leftCols(2 * columns), Stop())
                    .ok());
  };
  advance(0, 5);
  const int before = testing::allocations;
  advance(5, 20);
  return testing::allocations - before;
}

TEST(FilterAllocation, IsNoneForASampleOfALinearModel) {
  EXPECT_EQ(AllocationsOf(Oscillators(IntegrationMethod::kAuto)), 0);
}

TEST(FilterAllocation, IsNoneForASampleThatIsIntegrated) {
  EXPECT_EQ(AllocationsOf(Oscillators(IntegrationMethod::kExplicit)), 0);
}

TEST(FilterAllocation, IsNoneForASampleOfACurvedOutput) {
  const EquationSpecification curved{.states = {{"x", "v"}, {"v", "-x - 0.1*v"}},
                                     .outputs = {{"y", "tanh(20*x)"}, {"z", "exp(10*v)"}}};
  EXPECT_EQ(AllocationsOf(Ensemble(MakeEquationModel(curved).value(), 20, {"y", "z"})), 0);
}

}  // namespace
}  // namespace polyest::internal

#else

TEST(FilterAllocation, IsCountedByTheTestsOwnMalloc) {
  GTEST_SKIP() << "a sanitizer or another C library has a malloc of its own";
}

#endif
