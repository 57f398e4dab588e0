#include "core/chaos/gauss_rule.h"

#include <Eigen/Eigenvalues>

#include "core/common/check.h"

namespace polyest {

GaussRule MakeGaussRule(const Germ& germ, int count) {
  const RecurrenceCoefficients recurrence = germ.Recurrence(count);
  const Vector off_diagonal = recurrence.b.tail(count - 1).cwiseSqrt();
  Eigen::SelfAdjointEigenSolver<Matrix> solver;
  solver.computeFromTridiagonal(recurrence.a, off_diagonal);
  POLYEST_CHECK(solver.info() == Eigen::Success);
  return {solver.eigenvalues(), solver.eigenvectors().row(0).transpose().cwiseAbs2()};
}

}  // namespace polyest
