#include "core/chaos/gauss_rule.h"

#include "core/common/check.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {

GaussRule MakeGaussRule(const Germ& germ, int count) {
  const RecurrenceCoefficients recurrence = germ.Recurrence(count);
  const Vector off_diagonal = recurrence.b.tail(count - 1).cwiseSqrt();
  const SymmetricEigen eigen = DecomposeTridiagonal(recurrence.a, off_diagonal);
  POLYEST_CHECK(eigen.converged);
  return {eigen.values, eigen.vectors.row(0).transpose().cwiseAbs2()};
}

}  // namespace polyest::internal
