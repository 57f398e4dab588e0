#include "core/estimator/expansion/carried_state.h"

#include <algorithm>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/propagation/ensemble_points.h"

namespace polyest::internal {
namespace {

Eigen::Index StateCount(const ResolvedProblem& problem) {
  return std::ssize(problem.model()->description().states);
}

// Makes the state of an expansion over the new region after the rows of the state kept.
class Substitution {
 public:
  Substitution(const ResolvedProblem& problem, const RegionalExpansion& present,
               const ExpansionState& kept, int controls, const Stop& stop)
      : problem_(problem),
        present_(present),
        kept_(kept),
        before_(present.design()),
        controls_(controls),
        stop_(stop) {}

  // Finds T, δ and the terms at the new points. Fails if a collocation matrix cannot be factored.
  absl::Status Prepare(const ExpansionDesign& design) {
    points_ = design.points.rows();
    POLYEST_ASSIGN_OR_RETURN(CollocationMatrix after,
                             CollocationMatrix::Factor(*design.basis, design.points, stop_));
    Matrix etas(design.points.rows() + design.check_points.rows(), design.points.cols());
    etas << design.points, design.check_points;
    before_.basis->EvaluateMany(before_.region.ManyToLocal(design.region.ManyToGerm(etas)), phi_);
    const Eigen::Index old_terms = phi_.cols();
    transfer_.resize(design.basis->size(), old_terms);
    Vector residual(old_terms);
    after.Solve(phi_.topRows(points_), transfer_, residual);
    Vector reference(old_terms), new_reference(transfer_.rows());
    before_.basis->Evaluate(before_.reference, reference);
    design.basis->Evaluate(design.reference, new_reference);
    shift_ = transfer_.transpose() * new_reference - reference;
    design.basis->EvaluateMany(etas, new_phi_);
    new_reference_ = new_reference;
    new_phi_.rowwise() -= new_reference.transpose();
    return absl::OkStatus();
  }

  // Returns the state; `error` is Σ ρ/R that the sums keep.
  absl::StatusOr<ExpansionState> StateOn(const ExpansionDesign& design, double error) const {
    ExpansionState state;
    state.design = StateOf(design);
    state.noise = present_.noise().ForNewExpansion();
    state.absorbed = Absorbed(design, error);
    POLYEST_ASSIGN_OR_RETURN(state.trajectories, Trajectories());
    return state;
  }

 private:
  Eigen::Index channels() const { return std::ssize(kept_.absorbed.sums); }
  Eigen::Index old_controls() const {
    return kept_.absorbed.control_scores.cols() / std::max<Eigen::Index>(1, channels());
  }
  Eigen::Index first_old_control() const {
    return before_.points.rows() + before_.check_points.rows();
  }

  AbsorbedRows Absorbed(const ExpansionDesign& design, double error) const {
    const AbsorbedRows& old = kept_.absorbed;
    AbsorbedRows absorbed = old;
    absorbed.own_error = absorbed.carried_error = error;
    absorbed.windows.Substitute(transfer_, shift_);
    for (ResidualBlocks& blocks : absorbed.blocks) blocks = blocks.Renewed();
    absorbed.previous_coefficients = transfer_ * old.previous_coefficients;
    absorbed.previous_error -= old.previous_coefficients.transpose() * shift_;
    const Eigen::Index checks = design.check_points.rows();
    absorbed.check_residual.setConstant(checks, error);
    absorbed.check_valid.assign(static_cast<size_t>(checks), true);
    absorbed.check_chi_squared.resize(checks, channels());
    absorbed.point_chi_squared.resize(points_, channels());
    if (problem_.uses_filters()) absorbed.point_log_variance.setZero(points_);
    for (Eigen::Index c = 0; c < channels(); ++c) {
      ChannelSums& sums = absorbed.sums[static_cast<size_t>(c)];
      sums.samples = sums.samples.Substituted(transfer_, shift_);
      sums.differences = sums.differences.Substituted(transfer_, shift_);
      Vector chi_squared(new_phi_.rows());
      for (Eigen::Index i = 0; i < new_phi_.rows(); ++i) {
        chi_squared[i] = sums.samples.ChiSquared(new_phi_.row(i).transpose());
      }
      if (problem_.uses_filters()) {
        const Vector log_variances = SubstituteLogVariances(sums);
        absorbed.point_log_variance += log_variances.head(points_);
        chi_squared += 2 * log_variances;
      }
      absorbed.point_chi_squared.col(c) = chi_squared.head(points_);
      absorbed.check_chi_squared.col(c) = chi_squared.tail(checks);
    }
    SetControlScores(absorbed);
    if (absorbed.few) Carry(absorbed, error);
    return absorbed;
  }

  // Carries the samples over that are kept by themselves. Other channels are as in the sums.
  void Carry(AbsorbedRows& absorbed, double error) const {
    SampleBySample& few = *absorbed.few;
    few.own_error = error;
    few.check_residual = absorbed.check_residual;
    few.point_chi_squared = absorbed.point_chi_squared;
    few.check_chi_squared = absorbed.check_chi_squared;
    Matrix product;
    for (Eigen::Index c = 0; c < channels(); ++c) {
      CarryRelative(c, few);
      RobustSamples& samples = few.channels[static_cast<size_t>(c)];
      samples = samples.Substituted(transfer_, shift_);
      if (samples.outliers() == OutlierHandling::kNone) continue;
      Vector losses = Vector::Zero(new_phi_.rows());
      samples.AddTo(losses, new_phi_, product);
      few.point_chi_squared.col(c) = 2 * losses.head(points_);
      few.check_chi_squared.col(c) = 2 * losses.tail(losses.size() - points_);
    }
  }

  void CarryRelative(Eigen::Index c, SampleBySample& few) const {
    RelativeSamples& samples = few.relative[static_cast<size_t>(c)];
    samples = samples.Substituted(transfer_, shift_);
    if (c == 0) {
      few.point_log_variance.setZero(points_, channels());
      few.check_log_variance.setZero(new_phi_.rows() - points_, channels());
    }
    if (!samples.keeps()) return;
    Matrix product;
    Vector chi_squared(new_phi_.rows()), log_variance(new_phi_.rows());
    samples.EvaluateMany(new_phi_, product, chi_squared, log_variance);
    few.point_chi_squared.col(c) = chi_squared.head(points_);
    few.check_chi_squared.col(c) = chi_squared.tail(chi_squared.size() - points_);
    few.point_log_variance.col(c) = log_variance.head(points_);
    few.check_log_variance.col(c) = log_variance.tail(log_variance.size() - points_);
  }

  // Replaces the terms of ½ Σ log(S/σ²) = lᵀφ by l′ = T l and returns its values at the new points.
  Vector SubstituteLogVariances(ChannelSums& sums) const {
    sums.log_variance = (transfer_ * sums.log_variance).eval();
    sums.log_variance_at_reference = sums.log_variance.dot(new_reference_);
    return ((new_phi_ * sums.log_variance).array() + sums.log_variance_at_reference).matrix();
  }

  // A control trajectory belongs to a check point. What the error of integration does changes
  // little over the posterior, so that the scores of one stand for those of another.
  void SetControlScores(AbsorbedRows& absorbed) const {
    absorbed.control_valid.assign(static_cast<size_t>(controls_), true);
    const Matrix scores = transfer_ * kept_.absorbed.control_scores;
    absorbed.control_scores.resize(transfer_.rows(), controls_ * channels());
    for (Eigen::Index i = 0; i < controls_; ++i) {
      absorbed.control_scores.middleCols(i * channels(), channels()) =
          scores.middleCols(i % old_controls() * channels(), channels());
    }
  }

  // Returns what the polynomial fitted to the values of the collocation points (the first rows) is
  // at the new points. Below them, the new control trajectories differ from their check points as
  // the old ones did. `fit` is the collocation matrix of the old points.
  Matrix AtNewPoints(const Matrix& values, CollocationMatrix& fit) const {
    const Eigen::Index first_check = before_.points.rows();
    Matrix coefficients(phi_.cols(), values.cols());
    Vector residual(values.cols());
    fit.Solve(values.topRows(first_check), coefficients, residual);
    Matrix moved(phi_.rows() + controls_, values.cols());
    moved.topRows(phi_.rows()) = phi_ * coefficients;
    for (Eigen::Index i = 0; i < controls_; ++i) {
      const Eigen::Index old = i % old_controls();
      moved.row(phi_.rows() + i) = moved.row(points_ + i) + values.row(first_old_control() + old) -
                                   values.row(first_check + old);
    }
    return moved;
  }

  absl::StatusOr<TrajectoryState> Trajectories() const {
    const TrajectoryState& before = kept_.trajectories;
    TrajectoryState state;
    for (int q = 0; q < static_cast<int>(points_); ++q) state.kept.push_back(q);
    state.run = before.run;
    POLYEST_ASSIGN_OR_RETURN(CollocationMatrix fit,
                             CollocationMatrix::Factor(*before_.basis, before_.points, stop_));
    for (const PreviousSample& sample : before.previous) {
      PreviousSample& moved = state.previous.emplace_back(sample);
      moved.output = AtNewPoints(sample.output, fit).col(0);
    }
    if (!before.ensemble) return state;
    const Matrix own = InterpolableStates(problem_, *before.ensemble);
    Matrix states(first_old_control() + old_controls(), own.cols());
    states.topRows(own.rows()) = own;
    if (before.controls) {
      states.bottomRows(old_controls()) = InterpolableStates(problem_, *before.controls);
    }
    const Matrix moved = AtNewPoints(states, fit);
    state.ensemble = WithInterpolated(problem_, *before.ensemble, moved.topRows(phi_.rows()));
    if (controls_ > 0) {
      state.controls = WithInterpolated(problem_, *before.controls, moved.bottomRows(controls_));
    }
    return state;
  }

  const ResolvedProblem& problem_;
  const RegionalExpansion& present_;
  const ExpansionState& kept_;
  const ExpansionDesign& before_;
  Eigen::Index controls_;
  const Stop& stop_;
  Eigen::Index points_ = 0;  // Q′ new collocation points, which the check points follow
  Matrix transfer_;          // T, S′ × S
  Vector shift_;             // δ, S
  Vector new_reference_;     // φ′_0, S′
  Matrix phi_, new_phi_;  // φ and φ′ − φ′_0 at the new points, (Q′ + C′) × S and × S′
};

}  // namespace

Matrix InterpolableStates(const ResolvedProblem& problem, const EnsembleState& ensemble) {
  return problem.uses_filters() ? GaussiansOf(ensemble, StateCount(problem)) : StatesOf(ensemble);
}

EnsembleState WithInterpolated(const ResolvedProblem& problem, const EnsembleState& ensemble,
                               const ConstMatrixRef& values) {
  return problem.uses_filters() ? WithGaussians(ensemble, StateCount(problem), values)
                                : WithStates(ensemble, values);
}

absl::StatusOr<ExpansionState> CarriedState(const ResolvedProblem& problem,
                                            const RegionalExpansion& present,
                                            const ExpansionState& kept,
                                            const ExpansionDesign& design, double error,
                                            const Stop& stop) {
  // A new expansion knows how many control trajectories it has.
  POLYEST_ASSIGN_OR_RETURN(const auto fresh,
                           RegionalExpansion::Make(problem, nullptr, design,
                                                   present.noise().ForNewExpansion(), 1, stop));
  if (fresh->controls() > 0 && kept.absorbed.control_scores.cols() == 0) {
    return InfeasibleError("there are no control trajectories");
  }
  Substitution substitution(problem, present, kept, fresh->controls(), stop);
  POLYEST_RETURN_IF_ERROR(substitution.Prepare(design));
  return substitution.StateOn(design, error);
}

}  // namespace polyest::internal
