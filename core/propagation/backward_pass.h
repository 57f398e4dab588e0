#pragma once

// What later samples tell of the states of the filters of a block: a smoother, which runs backward
// over the record after the filters have run forward.
//
// Problem: at some instants of a run a filter (gaussian_states.h) has N(m, P), P = L Lᵀ, from the
// samples before. With all samples of the run the states there are N(m + L ε, L (I − M) Lᵀ), where
// ε (n) and M (n × n, 0 ≤ M ≤ I) have no units. After the last sample both are 0. Going back over
// one stage of the filter, from what is known after it (⁺) to what is known before it,
//
//   noise or motion:  ε = Tᵀ ε⁺,  M = Tᵀ M⁺ T,  T = (L⁺)⁻¹ D,
//                     D = L for noise, and for motion the half differences of the moved points
//                     m ± √n L e_j, divided by √n, so that D Dᵀ ≤ P⁺;
//   a sample:         ε = U ε⁺ + hᵀ ν/S,  M = U M⁺ Uᵀ + hᵀ h/S,  U = L⁻¹ L⁺,
//                     h likewise those of the outputs, ν the innovation and S its variance.
//
// This is the smoother of Rauch, Tung and Striebel with the cubature's statistical linearization,
// for which it is exact if the model is linear, in the coordinates of the factors: every matrix
// above is a contraction, and states that are known (P singular) need no inverse: a row of T or U
// is 0 where the diagonal element of its factor is. Stages compose on the way forward,
//
//   ε = A ε⁺ + a,  M = A M⁺ Aᵀ + B,
//
// so that memory is needed for the instants asked for, and not for every sample between them.
//
// ε and M also tell whether a state has changed abruptly: had something else than the process noise
// added δ to state i at a mark, with all else as the model says, the log likelihood of the samples
// after it would be greater by δ r_i − δ² N_ii/2, with r = L⁻ᵀ ε and N = L⁻ᵀ M L⁻¹. The score of an
// abrupt change is r_i/√N_ii, which is ~ N(0, 1) if there was none; its square is twice the
// greatest gain. (De Jong and Penzer, Diagnosing Shocks in Time Series, Journal of the American
// Statistical Association 93 (1998) 796–806.)
//
// Sources: Rauch, Tung and Striebel, Maximum Likelihood Estimates of Linear Dynamic Systems, AIAA
// Journal 3 (1965) 1445–1450; Särkkä, Bayesian Filtering and Smoothing (2013), ch. 8–10.

#include <vector>

#include "core/propagation/gaussian_states.h"

namespace polyest::internal {

class BackwardPass {
 public:
  BackwardPass(Eigen::Index members, Eigen::Index states);

  // Adds a stage in which noise has changed the factors from `before` to `after`.
  void AddNoise(const Eigen::ArrayXXd& before, const Eigen::ArrayXXd& after);
  // Adds a stage in which the points (as GaussianStates::Draw writes them) have moved to `points`,
  // of which `after` are the factors.
  void AddMotion(const Eigen::ArrayXXd& points, const Eigen::ArrayXXd& after);
  // Adds a sample; the arguments are those of GaussianStates::Update after the call. With noise
  // that is not Gaussian, `variance` is 1/A and `spread` 1/(A − B) (heavy_tail.h); else both are S.
  void AddSample(const Eigen::ArrayXd& outputs, const Eigen::ArrayXd& innovation,
                 const Eigen::ArrayXd& variance, const Eigen::ArrayXd& spread,
                 const Eigen::ArrayXXd& before, const Eigen::ArrayXXd& after);

  // Marks the present instant, at which the filters are in these states.
  void Mark(const GaussianStates& states);
  // Ends the record: replaces the marked states by those that all samples tell.
  void Finish();
  // The states at the i-th mark: before Finish from the samples before, afterwards from all.
  struct Marked {
    Eigen::ArrayXXd mean, factor;  // as those of GaussianStates
    Eigen::ArrayXXd jump_scores;  // members × n, after Finish; 0 for a state that is known exactly
  };
  const Marked& marked(size_t i) const { return marks_[i].states; }

 private:
  // The map from what is known later to what is known now: A, a and B.
  struct Map {
    Eigen::ArrayXXd A, a, B;  // members × n², n, n²; element (i, j) is in column i n + j
  };
  struct AtMark {
    Marked states;
    Map map;  // from the next mark or the record's end to this one
  };

  Map Identity() const;
  void Solve(const Eigen::ArrayXXd& factor, Eigen::ArrayXXd& matrix) const;
  void Compose(const Eigen::ArrayXXd& matrix, bool transposed);
  void ScoreJumps(Marked& states, const Eigen::ArrayXXd& epsilon, const Eigen::ArrayXXd& M) const;
  void Correct(Marked& states, const Eigen::ArrayXXd& epsilon, const Eigen::ArrayXXd& M) const;
  auto Full(Eigen::ArrayXXd& matrix, Eigen::Index i, Eigen::Index j) const {
    return matrix.col(i * n_ + j);
  }
  auto Full(const Eigen::ArrayXXd& matrix, Eigen::Index i, Eigen::Index j) const {
    return matrix.col(i * n_ + j);
  }

  const Eigen::Index members_, n_;
  Map map_;  // from now to the last mark
  std::vector<AtMark> marks_;
  Eigen::ArrayXXd stage_, product_, slope_;
};

}  // namespace polyest::internal
