#include "core/estimator/posterior/posterior_pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/model/equations/equation_model.h"
#include "polyest/problem.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal {
namespace {

Prior Normals(int dimension) {
  std::vector<UncertainParameter> parameters;
  for (int i = 0; i < dimension; ++i) {
    parameters.push_back(UncertainParameter::Normal(std::string(1, 'a' + i), 0, 1).value());
  }
  return Prior(parameters);
}

// Returns a box of ±4 standard deviations, which is the whole prior as far as pieces are concerned.
ExpansionDesign WideDesign(int dimension) {
  ExpansionDesign design;
  design.region = Region::WholePrior(dimension);
  design.lower = Vector::Constant(dimension, -4);
  design.upper = -design.lower;
  return design;
}

std::vector<Piece> PiecesOf(const Cost& cost, int particles = 1000) {
  const ExpansionDesign design = WideDesign(cost.dimension());
  SamplerOptions options;
  options.particles = particles;
  const Particles drawn =
      SamplePosterior(cost, design.lower, design.upper, Matrix(0, cost.dimension()), options, {})
          .value();
  return FindPieces(cost, design, drawn.etas);
}

// Makes the data a² = 1 with a noise of 0.1, which leave a = ±1, each with a standard deviation of
// 0.05.
std::vector<Measurement> SquareOfTheFirst() {
  return {{[](const Vector& xi) { return xi[0] * xi[0]; }, 1, 0.1}};
}

TEST(PosteriorPieces, AreTwoWhereASignIsNotObserved) {
  for (const int n : {1, 2, 6}) {
    const std::vector<Piece> pieces = PiecesOf(CostOf(Normals(n), SquareOfTheFirst()));
    ASSERT_EQ(pieces.size(), 2U) << n;
    EXPECT_EQ(pieces[0].particles.rows() + pieces[1].particles.rows(), 1000);
    const double first = pieces[0].particles.col(0).maxCoeff(),
                 second = pieces[1].particles.col(0).minCoeff();
    EXPECT_LT(std::min(first, second), 0) << n;
    EXPECT_NEAR(std::abs(pieces[0].particles.col(0).mean()), 1, 0.05);
    EXPECT_LT(pieces[0].particles.col(0).mean() * pieces[1].particles.col(0).mean(), 0);
  }
}

TEST(PosteriorPieces, AreFourWhereTwoSignsAreNotObserved) {
  std::vector<Measurement> measurements = SquareOfTheFirst();
  measurements.push_back({[](const Vector& xi) { return xi[1] * xi[1]; }, 1.5, 0.1});
  const std::vector<Piece> pieces = PiecesOf(CostOf(Normals(2), measurements));
  ASSERT_EQ(pieces.size(), 4U);
  for (const Piece& piece : pieces) {
    // The particles of a piece all have the signs of its mean, and lie in its element alone.
    for (const Piece& other : pieces) {
      EXPECT_EQ(other.element.Contains(piece.particles.row(0).transpose()), &other == &piece);
    }
    for (int j = 0; j < 2; ++j) {
      const double sign = piece.particles.col(j).mean() > 0 ? 1 : -1;
      EXPECT_GT((sign * piece.particles.col(j)).minCoeff(), 0);
    }
  }
}

TEST(PosteriorPieces, AreOneOfAGaussian) {
  for (const int n : {1, 2, 6}) {
    const Cost cost = CostOf(Normals(n), {{[](const Vector& xi) { return xi.sum(); }, 0.3, 0.05}});
    EXPECT_EQ(PiecesOf(cost).size(), 1U) << n;
  }
}

// The data b = a² make a banana along ±2. The density on its straight chord is practically zero.
TEST(PosteriorPieces, AreOneOfABanana) {
  const Cost cost =
      CostOf(Normals(2), {{[](const Vector& xi) { return xi[1] - xi[0] * xi[0]; }, -1, 0.05}});
  EXPECT_EQ(PiecesOf(cost).size(), 1U);
}

// The data a b = 1 have two branches under the prior; each is one piece, though a curved valley.
TEST(PosteriorPieces, AreTheBranchesOfAHyperbola) {
  const Cost cost = CostOf(Normals(2), {{[](const Vector& xi) { return xi[0] * xi[1]; }, 1, 0.02}});
  const std::vector<Piece> pieces = PiecesOf(cost);
  ASSERT_EQ(pieces.size(), 2U);
  EXPECT_LT(pieces[0].particles.col(0).mean() * pieces[1].particles.col(0).mean(), 0);
}

// The data a = b to 10⁻⁴ make a valley a thousandth as wide as long.
TEST(PosteriorPieces, AreOneOfAValley) {
  const Cost cost = CostOf(Normals(2), {{[](const Vector& xi) { return xi[0] - xi[1]; }, 0, 1e-4}});
  EXPECT_EQ(PiecesOf(cost).size(), 1U);
}

// The saddle between the two minima is 3 high, far less than what separates pieces.
TEST(PosteriorPieces, AreOneWhereALowSaddleJoinsTwoMinima) {
  const Cost cost = CostOf(Normals(1), {{[](const Vector& xi) { return xi[0] * xi[0]; }, 1, 0.4}});
  EXPECT_EQ(PiecesOf(cost).size(), 1U);
}

TEST(PosteriorPieces, AreNotToldApartByFewParticles) {
  EXPECT_EQ(PiecesOf(CostOf(Normals(1), SquareOfTheFirst()), 199).size(), 1U);
}

}  // namespace
}  // namespace polyest::internal
