#pragma once

// Coordinates u in which sums, or products and ratios, of parameters are straight. Data often
// determine only these, k/m say: where one of the two has a lognormal prior and the other a uniform
// one, the posterior is a thin curved ridge in germ coordinates.
//
//   of sums       u_i = θ_i, if the scale of a logarithmic prior is at most 1
//   of products   u_i = log |θ_i|, beside the sign of θ_i, which no move in u changes
//
// and u_i = z_i where that would be affine in the score z_i, or does not exist, or would take long:
// for beta, gamma and truncated normal priors that are correlated. A parameter whose prior has both
// signs, as every normal one, has log |θ_i| or z_i by choice: near 0 moves in z_i are the better.

#include <vector>

#include "core/bayes/prior.h"
#include "core/bayes/region.h"

namespace polyest::internal {

class StraightCoordinates {
 public:
  // Makes those of sums for ParameterMap::kAffine, those of products for kExponential. The prior
  // and the region must outlive the object.
  StraightCoordinates(const Prior& prior, const Region& region, ParameterMap map);

  // Whether u is anything but affine in the local coordinates η, or may be by choice.
  bool curved() const { return !curved_.empty(); }
  bool has_choice() const;       // whether a prior has both signs
  bool by_choice_alone() const;  // whether u may be affine in η

  // Gives the parameters whose priors have both signs the coordinate log |θ_i|: all of them, if
  // `of_both_signs`, else those with one sign at all rows of `etas`. The others have z_i, as all of
  // them at first. Moves in u leave a density invariant only if the choice is independent of what
  // they move.
  void Choose(const ConstMatrixRef& etas, bool of_both_signs);

  // Maps the rows of `etas` to those of `us`. Unless null, `signs` (as large) receives the signs of
  // θ_i where u_i is its logarithm, and `log_volumes` log |dη/du|, up to a constant.
  void FromLocal(const ConstMatrixRef& etas, Matrix& us, Matrix* signs, Vector* log_volumes) const;
  // The inverse. Rows of u outside of Ω are mapped outside of it, or to what is not a number.
  void ToLocal(const ConstMatrixRef& us, const Matrix& signs, Matrix& etas,
               Vector& log_volumes) const;

 private:
  struct Curved {
    int parameter;
    bool of_choice;    // whether the prior has both signs, and u is to be its logarithm
    bool used;         // whether u is not z
    bool of_own_germ;  // whether the score z is the parameter's own germ, so that θ = T(l + s z)
    double location;   // l
    double scale;      // s
  };

  Matrix Scores(const ConstMatrixRef& etas) const;  // z at each row

  // Replace the scores z of a parameter in `column` by u and write the signs of θ into `signs`, or
  // u by z, and add log |dz/du|, up to a constant, to `log_volumes`, unless null.
  void ToStraight(const Curved& curved, VectorRef column, VectorRef signs,
                  Vector* log_volumes) const;
  void FromStraight(const Curved& curved, VectorRef column, const ConstVectorRef& signs,
                    Vector& log_volumes) const;
  double LogSlope(const Curved& curved, double z, double u) const;  // log |dz/du| by the prior

  const Prior& prior_;
  const Region& region_;
  const ParameterMap map_;
  std::vector<Curved> curved_;
};

}  // namespace polyest::internal
