#include "core/propagation/exact_step.h"

#include <algorithm>
#include <cmath>

#include "core/model/lane.h"

namespace polyest::internal {
namespace {

const double* At(const Eigen::ArrayXXd& block, Eigen::Index row, Eigen::Index column) {
  return block.data() + column * block.rows() + row;
}

Lane LoadLane(const Eigen::ArrayXXd& block, Eigen::Index row, Eigen::Index column) {
  return Lane::Map(At(block, row, column));
}

// Adds the product of the first `states` columns of `left` and all columns of `right`, both laid
// out as LinearSystem::coefficients, to `result`.
void AddProduct(Eigen::Index states, const Eigen::ArrayXXd& left, const Eigen::ArrayXXd& right,
                Eigen::ArrayXXd& result) {
  const Eigen::Index columns = right.cols() / states;
  for (Eigen::Index row = 0; row < right.rows(); row += kLanes) {
    for (Eigen::Index c = 0; c < columns; ++c) {
      for (Eigen::Index i = 0; i < states; ++i) {
        Lane sum = Lane::Zero();
        for (Eigen::Index k = 0; k < states; ++k) {
          sum += LoadLane(left, row, k * states + i) * LoadLane(right, row, c * states + k);
        }
        Lane::Map(result.data() + (c * states + i) * result.rows() + row) += sum;
      }
    }
  }
}

// Adds the forcing's part of `left` times a matrix of the generators to that of `result`.
void AddGeneratorProduct(const LinearSystem& system, const Eigen::ArrayXXd& left,
                         const Matrix& right, Eigen::ArrayXXd& result) {
  const Eigen::Index n = system.states;
  for (Eigen::Index c = 0; c < system.components; ++c) {
    for (Eigen::Index q = 0; q < system.components; ++q) {
      if (right(q, c) == 0) continue;
      result.middleCols((n + c) * n, n) += right(q, c) * left.middleCols((n + q) * n, n);
    }
  }
}

// Sums Σ_j (h M)^j/j! for M = [A, D; 0, J] and j ≥ 1 term by term.
ExactStep SeriesStep(const LinearSystem& system, double length_s) {
  ExactStep step{length_s, length_s * system.coefficients, length_s * system.J};
  Eigen::ArrayXXd term = step.matrices, next(term.rows(), term.cols());
  Matrix generator_term = step.G;
  const int terms = SeriesTerms(system, length_s);
  for (int j = 2; j <= terms; ++j) {
    next.setZero();
    AddProduct(system.states, term, system.coefficients, next);
    AddGeneratorProduct(system, term, system.J, next);
    term = (length_s / j) * next;
    step.matrices += term;
    generator_term = (length_s / j) * generator_term.lazyProduct(system.J).eval();
    step.G += generator_term;
  }
  return step;
}

// Computes [A D] [x; w], or [E W] [x; w].
void Multiply(const LinearSystem& system, const Eigen::ArrayXXd& matrices,
              const Eigen::ArrayXXd& states, const Vector& w, Eigen::ArrayXXd& result) {
  const Eigen::Index n = system.states;
  for (Eigen::Index row = 0; row < states.rows(); row += kLanes) {
    for (Eigen::Index i = 0; i < n; ++i) {
      Lane sum = Lane::Zero();
      for (Eigen::Index k = 0; k < n; ++k) {
        sum += LoadLane(matrices, row, k * n + i) * LoadLane(states, row, k);
      }
      for (Eigen::Index q = 0; q < system.components; ++q) {
        sum += LoadLane(matrices, row, (n + q) * n + i) * w[q];
      }
      Lane::Map(result.data() + i * result.rows() + row) = sum;
    }
  }
}

// Computes G w. A component depends on those of its own generator only.
void MultiplyGenerators(const LinearSystem& system, const Matrix& G, const Vector& w,
                        Vector& result) {
  result.setZero();
  for (const LinearSystem::Generator& generator : system.generators) {
    for (Eigen::Index i = generator.first; i < generator.first + generator.size; ++i) {
      for (Eigen::Index k = generator.first; k < generator.first + generator.size; ++k) {
        result[i] += G(i, k) * w[k];
      }
    }
  }
}

}  // namespace

ExactStep MakeExactStep(const LinearSystem& system, double length_s) {
  int exponent = 0;
  std::frexp(length_s * system.rate, &exponent);  // h · rate ≤ 2^exponent
  const int doublings = std::max(exponent, 0);
  ExactStep step = SeriesStep(system, std::ldexp(length_s, -doublings));
  for (int i = 0; i < doublings; ++i) step = Doubled(system, step);
  return step;
}

ExactStep Doubled(const LinearSystem& system, const ExactStep& step) {
  // E ← 2E + E²,  W ← 2W + E W + W G,  G ← 2G + G²
  ExactStep doubled{2 * step.length_s, 2 * step.matrices,
                    2 * step.G + step.G.lazyProduct(step.G).eval()};
  AddProduct(system.states, step.matrices, step.matrices, doubled.matrices);
  AddGeneratorProduct(system, step.matrices, step.G, doubled.matrices);
  return doubled;
}

void Apply(const LinearSystem& system, const ExactStep& step, Eigen::ArrayXXd& states, Vector& w,
           StepMemory& memory) {
  Multiply(system, step.matrices, states, w, memory.product);
  states += memory.product;
  MultiplyGenerators(system, step.G, w, memory.w_product);
  w += memory.w_product;
}

int SeriesTerms(const LinearSystem& system, double length_s) {
  // Beyond these terms, the next one is below 2⁻⁶⁰ of the first. A forcing of degree 3 in time
  // needs three terms more than the states.
  constexpr double kNegligible = 0x1p-60;
  const double z = std::abs(length_s) * system.rate;
  int terms = 2;
  for (double ratio = z / 2; ratio > kNegligible; ratio *= z / terms) ++terms;
  return system.generators.empty() ? terms : terms + 3;
}

void ApplySeries(const LinearSystem& system, double length_s, int terms, Eigen::ArrayXXd& states,
                 Vector& w, StepMemory& memory) {
  memory.term = states;
  memory.w_term = w;
  for (int j = 1; j <= terms; ++j) {
    // [x; w]_j = (h/j) M [x; w]_{j−1}
    Multiply(system, system.coefficients, memory.term, memory.w_term, memory.product);
    memory.term = (length_s / j) * memory.product;
    states += memory.term;
    MultiplyGenerators(system, system.J, memory.w_term, memory.w_product);
    memory.w_term = (length_s / j) * memory.w_product;
    w += memory.w_term;
  }
}

}  // namespace polyest::internal
