#pragma once

// The collocation matrix A_qs = φ_s(ξ_q) (8), factored once by Householder QR; the coefficients
// c = A⁺ Y of (10) come from the factors and never from A⁺ or R⁻¹.

#include <absl/status/statusor.h>

#include "core/chaos/basis.h"
#include "core/chaos/packed_matrix.h"
#include "core/common/types.h"
#include "polyest/stop.h"

namespace polyest::internal {

class CollocationMatrix {
 public:
  // Factors A for `points` (Q × n, Q ≥ S). Returns InfeasibleError, naming order, terms and
  // points, if A lacks full rank or its condition number exceeds `max_condition`; on a stop request
  // its status.
  static absl::StatusOr<CollocationMatrix> Factor(const Basis& basis, const ConstMatrixRef& points,
                                                  const Stop& stop = {},
                                                  double max_condition = 1e8);

  int points() const { return static_cast<int>(matrix_.rows()); }  // Q
  int terms() const { return static_cast<int>(matrix_.cols()); }   // S
  Matrix matrix() const { return matrix_.Unpacked(); }
  double condition() const { return condition_; }  // from the triangular factor

  // Writes the least-squares coefficients (S × m) of the values (Q × m) at the points, and the
  // residual variance ‖Y − A c‖² / (Q − S) of each column; 0 if Q = S, because interpolation leaves
  // no residual. At most `threads` ≥ 1 compute; results do not depend on their number. Does not
  // allocate if the results have their sizes already, except when there are more columns than ever
  // before.
  void Solve(const ConstMatrixRef& values, MatrixRef coefficients, VectorRef residual_variance,
             int threads = 1);

 private:
  CollocationMatrix() = default;

  void ReserveResiduals(Eigen::Index columns);
  // Solves for some of the columns; `residuals` are their columns of residuals_.
  void SolveSome(const ConstMatrixRef& values, MatrixRef coefficients, VectorRef residual_variance,
                 MatrixRef residuals) const;

  PackedMatrix matrix_;
  PackedMatrix thin_q_;             // transposed, S × Q
  PackedMatrix back_substitution_;  // S × S: swept upwards, it solves with R
  Matrix residuals_;                // Q and more × the largest number of columns so far
  double condition_ = 0;
};

}  // namespace polyest::internal
