#include "core/estimator/posterior/connected_elements.h"

#include <gtest/gtest.h>

#include <deque>
#include <utility>
#include <vector>

#include "core/estimator/expansion/search_domain.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal::connected_elements {
namespace {

// Elements of the germ of one parameter, uniform on [−1, 1].
class Elements {
 public:
  // Adds the part with lower ≤ ξ ≤ upper, where y(ξ) was measured as z.
  void Add(double lower, double upper, const Measurement& measurement) {
    const UncertainParameter x = UncertainParameter::Uniform("x", -1, 1).value();
    const Prior prior({x});
    const Vector unit = Vector::Unit(1, 0);
    const Element element({{-unit, -lower}, {unit, upper}});
    ExpansionDesign& design = designs_.emplace_back();
    design.lower = Vector::Constant(1, -1);
    design.upper = Vector::Constant(1, 1);
    design.element = element;
    const Cost& cost = costs_.emplace_back(CostOf(prior, {measurement}, element));
    const Matrix starts = Matrix::Constant(1, 1, 0.5 * (lower + upper));
    std::vector<Minimum> minima = FindMinima(SearchOf(cost, design), starts, {}, Stop());
    elements_.push_back({&design, &cost, 0, std::move(minima.front())});
  }

  std::vector<size_t> Pieces() const { return ConnectedPieces(elements_); }

 private:
  std::deque<ExpansionDesign> designs_;
  std::deque<Cost> costs_;
  std::vector<ElementCost> elements_;
};

double Line(const Vector& xi) { return xi[0]; }
double Square(const Vector& xi) { return xi[0] * xi[0]; }

TEST(ConnectedPieces, AreElementsThatMeetWhereTheCostIsLow) {
  Elements elements;
  elements.Add(-1, 0.1, {Line, 0, 0.2});
  elements.Add(0.1, 1, {Line, 0, 0.2});
  EXPECT_EQ(elements.Pieces(), (std::vector<size_t>{0, 0}));
}

// On the bound, ½ (0.5/0.05)² = 50.
TEST(ConnectedPieces, AreNotElementsThatMeetWhereTheCostIsHigh) {
  Elements elements;
  elements.Add(-1, 0, {Square, 0.5, 0.05});
  elements.Add(0, 1, {Square, 0.5, 0.05});
  EXPECT_EQ(elements.Pieces(), (std::vector<size_t>{0, 1}));
}

// As those that were divided by the parameter of a run that has ended.
TEST(ConnectedPieces, AreElementsThatOverlapWhereBothHaveALowCost) {
  Elements elements;
  elements.Add(-0.1, 1, {Line, 0.3, 0.1});
  elements.Add(0, 0.9, {Line, 0.35, 0.1});
  EXPECT_EQ(elements.Pieces(), (std::vector<size_t>{0, 0}));
}

// ½ (0.6/0.1)² = 18 at the least of the other.
TEST(ConnectedPieces, AreNotElementsThatOverlapWhereOneHasAHighCost) {
  Elements elements;
  elements.Add(-0.1, 1, {Line, 0.8, 0.1});
  elements.Add(0, 0.9, {Line, 0.2, 0.1});
  EXPECT_EQ(elements.Pieces(), (std::vector<size_t>{0, 1}));
}

// Along the line they stand in the order 0, 3, 1, 2: the last one joins the first with a piece of
// two.
TEST(ConnectedPieces, AreThoseThatAnElementJoinsLater) {
  Elements elements;
  elements.Add(-1, -0.5, {Line, 0, 2});
  elements.Add(0, 0.5, {Line, 0, 2});
  elements.Add(0.5, 1, {Line, 0, 2});
  elements.Add(-0.5, 0, {Line, 0, 2});
  EXPECT_EQ(elements.Pieces(), (std::vector<size_t>{0, 0, 0, 0}));
}

}  // namespace
}  // namespace polyest::internal::connected_elements
