#include "core/propagation/filter_block.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/propagation/block_rows.h"
#include "core/propagation/noise_parts.h"
#include "core/propagation/output_limit.h"

namespace polyest::internal {
namespace {

// Returns rows first … first + count − 1, `copies` times one below the other; an empty matrix of an
// empty one.
Matrix Repeated(const Matrix& matrix, int first, int count, Eigen::Index copies) {
  if (matrix.size() == 0) return matrix;
  return matrix.middleRows(first, count).replicate(copies, 1);
}

// Returns the specification of the points of some members: point s · count + i is the s-th of
// member first + i.
EnsembleSpecification OfPointsOf(const EnsembleSpecification& members, int first, int count) {
  const auto copies = 2 * std::ssize(members.model->description().states);
  EnsembleSpecification points = members;
  points.process_noise = points.noise_factors = Matrix();
  for (Matrix EnsembleSpecification::*part :
       {&EnsembleSpecification::parameters, &EnsembleSpecification::amplitudes,
        &EnsembleSpecification::input_delays_s, &EnsembleSpecification::input_offsets,
        &EnsembleSpecification::output_gains, &EnsembleSpecification::output_offsets}) {
    points.*part = Repeated(members.*part, first, count, copies);
  }
  return points;
}

}  // namespace

int FilterBlock::Members(Eigen::Index states) {
  return std::max(1, TrajectoryBlock::kPoints / static_cast<int>(2 * states));
}

FilterBlock::FilterBlock(const EnsembleSpecification& specification, const InputSignals* inputs,
                         int first_member, int members, bool exact)
    : first_member_(first_member),
      specification_(OfPointsOf(specification, first_member, members)),
      spectral_densities_(specification.process_noise.middleRows(first_member, members).array()),
      noise_factors_(specification.noise_factors.size() == 0
                         ? Matrix()
                         : Matrix(specification.noise_factors.middleRows(first_member, members))),
      noisy_((spectral_densities_ != 0).any()),
      block_(&specification_, inputs, 0, static_cast<int>(specification_.parameters.rows()), exact),
      gaussians_(members, spectral_densities_.cols()),
      points_(block_.state_values()),
      moved_(std::ssize(PaddedRows(static_cast<int>(points_.cols()) + 1)), points_.cols()),
      moved_rates_(moved_),
      steps_(points_.cols()),
      jacobian_(points_.cols(), points_.cols()),
      square_(points_.cols(), points_.cols()),
      outputs_(specification_.parameters.rows()),
      noise_variance_(members),
      innovation_(members),
      variance_(members),
      gain_variance_(members),
      spread_(members),
      whitened_(members),
      log_variance_(members),
      quadrature_(members),
      scan_(members, std::max<Eigen::Index>(kScanned, 2 * points_.cols())),
      scanned_(scan_),
      shift_(members),
      mean_(members),
      squeezed_(members),
      has_line_(static_cast<size_t>(members), true),
      alive_(static_cast<size_t>(members), true) {
  part_ends_s_.reserve(kMaxEvenParts);
  gaussians_.mean() = points_.topRows(members);
  for (int i = 0; i < members; ++i) {
    if ((spectral_densities_.row(i) >= 0).all() && spectral_densities_.row(i).isFinite().all()) {
      continue;
    }
    // Its trajectories begin as those of the others do, so that they end here.
    block_.LeaveOut(PointsOf(i), "a spectral density of process noise is negative or not finite");
    spectral_densities_.row(i).setZero();
  }
  NoteFailures();
}

bool FilterBlock::AnyAlive() const { return std::ranges::find(alive_, true) != alive_.end(); }

std::vector<int> FilterBlock::PointsOf(int member) const {
  std::vector<int> points;
  const int count = member_count();
  const int all = static_cast<int>(specification_.parameters.rows());
  for (int point = member; point < all; point += count) points.push_back(point);
  return points;
}

// A member fails with the first of its points; the others are left out then.
void FilterBlock::NoteFailures() {
  while (failures_seen_ < block_.failures().size()) {
    const PointFailure failure = block_.failures()[failures_seen_++];
    const int member = failure.point % member_count();
    if (!alive_[static_cast<size_t>(member)]) continue;
    alive_[static_cast<size_t>(member)] = false;
    failures_.push_back({first_member_ + member, failure.time_s, failure.flag, failure.reason});
    block_.LeaveOut(PointsOf(member), failure.reason.c_str());
  }
}

absl::Status FilterBlock::Advance(const FilterSamples& samples, MatrixRef innovations,
                                  MatrixRef log_variances, const Stop& stop) {
  const auto channels = static_cast<int>(samples.values.rows());
  for (Eigen::Index k = 0; k < std::ssize(samples.times_s); ++k) {
    POLYEST_RETURN_IF_ERROR(Predict(samples.times_s[static_cast<size_t>(k)], stop));
    for (int c = 0; c < channels; ++c) Update(samples, k, c, innovations, log_variances);
  }
  return absl::OkStatus();
}

absl::Status FilterBlock::Predict(double time_s, const Stop& stop) {
  const double start_s = time_s_, interval_s = time_s - start_s;
  if (!(interval_s > 0)) return absl::OkStatus();
  if (!AnyAlive()) {
    // What is left of the states is no place to evaluate the model at.
    time_s_ = time_s;
    return absl::OkStatus();
  }
  if (!noisy_) return MoveTo(time_s, stop);
  DivideForNoise(start_s, time_s, FastestRate(interval_s), part_ends_s_);
  for (const double to_s : part_ends_s_) {
    const double from_s = time_s_;
    const double step_s = to_s - from_s;
    Diffuse(step_s / 6);
    POLYEST_RETURN_IF_ERROR(MoveTo(from_s + step_s / 2, stop));
    Diffuse(4 * step_s / 6);
    POLYEST_RETURN_IF_ERROR(MoveTo(to_s, stop));
    Diffuse(step_s / 6);
  }
  return absl::OkStatus();
}

void FilterBlock::Diffuse(double duration_s) {
  if (backward_) factor_before_ = gaussians_.factor();
  gaussians_.Diffuse(spectral_densities_, duration_s);
  if (backward_) backward_->AddNoise(factor_before_, gaussians_.factor());
}

absl::Status FilterBlock::MoveTo(double time_s, const Stop& stop) {
  gaussians_.Draw(points_);
  block_.SetStates(points_);
  POLYEST_ASSIGN_OR_RETURN(const Eigen::ArrayXXd* const states, block_.Move(time_s, stop));
  NoteFailures();
  gaussians_.Collect(*states);
  if (backward_) backward_->AddMotion(*states, gaussians_.factor());
  time_s_ = time_s;
  return absl::OkStatus();
}

// Writes ∂f/∂x at the mean of the first member, by differences.
void FilterBlock::Differentiate(double interval_s) {
  const Eigen::Index n = gaussians_.states();
  const auto mean = gaussians_.mean().row(0);
  moved_ = mean.replicate(moved_.rows(), 1);
  block_.FirstDerivatives(time_s_, moved_, moved_rates_);
  const double root_epsilon = std::sqrt(std::numeric_limits<double>::epsilon());
  for (Eigen::Index j = 0; j < n; ++j) {
    // A state that is still 0 is as large as it becomes in the interval.
    const double size =
        mean[j] == 0 ? interval_s * std::abs(moved_rates_(0, j)) : std::abs(mean[j]);
    steps_[j] = root_epsilon * size;
    moved_(j, j) += steps_[j];
  }
  block_.FirstDerivatives(time_s_, moved_, moved_rates_);
  for (Eigen::Index j = 0; j < n; ++j) {
    jacobian_.col(j).setZero();
    if (!(steps_[j] > 0)) continue;
    jacobian_.col(j) =
        ((moved_rates_.row(j) - moved_rates_.row(n)) / steps_[j]).matrix().transpose();
  }
}

// Returns the spectral radius of ∂f/∂x at the mean of the first member, in 1/s, by Gelfand's
// formula, ‖A^k‖^{1/k} with k = 32, in which the units of the states hardly matter.
double FilterBlock::FastestRate(double interval_s) {
  Differentiate(interval_s);
  double log_rate = 0, weight = 1;
  for (int doubling = 0; doubling < 5; ++doubling) {
    const double norm = jacobian_.norm();
    if (!(norm > 0)) return 0;
    log_rate += weight * std::log(norm);
    jacobian_ /= norm;
    square_.noalias() = jacobian_ * jacobian_;
    jacobian_.swap(square_);
    weight /= 2;
  }
  const double norm = jacobian_.norm();
  return norm > 0 ? std::exp(log_rate + weight * std::log(norm)) : 0;
}

// Reads the outputs at the points of the present states.
void FilterBlock::ReadOutputs() {
  gaussians_.Draw(points_);
  block_.SetStates(points_);
  all_outputs_ = &block_.OutputsOfStates();
  NoteFailures();
}

// Sets outputs_ to y = gain · h + offset of one channel.
void FilterBlock::SelectOutput(int channel) {
  outputs_ = all_outputs_->col(channel).head(outputs_.size());
  if (specification_.output_gains.size() > 0) {
    outputs_ *= specification_.output_gains.col(channel).array();
  }
  if (specification_.output_offsets.size() > 0) {
    outputs_ += specification_.output_offsets.col(channel).array();
  }
  for (Eigen::Index i = 0; i < outputs_.size(); ++i) {
    if (std::abs(outputs_[i]) <= kMaxOutput) continue;
    const int member = static_cast<int>(i) % member_count();
    if (alive_[static_cast<size_t>(member)]) {
      block_.LeaveOut(PointsOf(member),
                      "an output, with its gain and offset, exceeds 1e100 in magnitude");
      NoteFailures();
    }
    outputs_[i] = 0;  // so that the filter of a member that has failed remains finite
  }
}

absl::Status FilterBlock::PredictOutputs(double time_s, MatrixRef means, MatrixRef deviations,
                                         const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(Predict(time_s, stop));
  WriteOutputs(means, deviations);
  return absl::OkStatus();
}

void FilterBlock::WriteOutputs(MatrixRef means, MatrixRef deviations) {
  const bool any = AnyAlive();
  if (any) ReadOutputs();
  const int members = member_count();
  const auto points = outputs_.size() / members;
  for (int c = 0; any && c < static_cast<int>(means.cols()); ++c) {
    SelectOutput(c);
    const auto at_points = outputs_.reshaped(members, points);
    const Eigen::ArrayXd mean = at_points.rowwise().mean();
    means.col(c).segment(first_member_, members) = mean;
    deviations.col(c).segment(first_member_, members) =
        (at_points.colwise() - mean).square().rowwise().mean().sqrt();
  }
  for (int i = 0; i < members; ++i) {
    if (alive_[static_cast<size_t>(i)]) continue;
    means.row(first_member_ + i).setConstant(std::numeric_limits<double>::quiet_NaN());
    deviations.row(first_member_ + i).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
}

void FilterBlock::StartBackward() {
  backward_ = std::make_unique<BackwardPass>(gaussians_.members(), gaussians_.states());
}

absl::Status FilterBlock::Mark(double time_s, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(Predict(time_s, stop));
  backward_->Mark(gaussians_);
  return absl::OkStatus();
}

void FilterBlock::ReadMarked(size_t mark, double time_s, MatrixRef means, MatrixRef deviations) {
  gaussians_.mean() = backward_->marked(mark).mean;
  gaussians_.factor() = backward_->marked(mark).factor;
  block_.SetTime(time_s);
  WriteOutputs(means, deviations);
}

void FilterBlock::ReadJumpScores(size_t mark, MatrixRef scores) const {
  scores.middleRows(first_member_, member_count()) = backward_->marked(mark).jump_scores.matrix();
}

void FilterBlock::TakeStatesOf(const FilterBlock& other) {
  POLYEST_CHECK(other.time_s_ == time_s_ && other.first_member_ == first_member_ &&
                other.member_count() == member_count());
  gaussians_ = other.gaussians_;
  for (int i = 0; i < member_count(); ++i) {
    if (other.alive_[static_cast<size_t>(i)]) continue;
    block_.LeaveOut(PointsOf(i), "it failed while it took samples");
  }
  NoteFailures();
}

// The columns are the states, the means and the factors.
EnsembleState::OfBlock FilterBlock::State() const {
  EnsembleState::OfBlock state = block_.State();
  const Eigen::Index n = gaussians_.states(), rows = state.states.rows();
  const Eigen::Index members = gaussians_.members();
  Eigen::ArrayXXd all = Eigen::ArrayXXd::Zero(rows, 2 * n + gaussians_.factor().cols());
  all.leftCols(n) = state.states;
  all.middleCols(n, n).topRows(members) = gaussians_.mean();
  all.rightCols(gaussians_.factor().cols()).topRows(members) = gaussians_.factor();
  // What a member that has failed leaves behind need not be finite, and means nothing.
  state.states = all.isFinite().select(all, 0);
  return state;
}

EnsembleState::OfBlock FilterBlock::OfPoints(const EnsembleState::OfBlock& state) const {
  EnsembleState::OfBlock points = state;
  points.states = state.states.leftCols(gaussians_.states());
  return points;
}

bool FilterBlock::Fits(const EnsembleState::OfBlock& state) const {
  return state.states.cols() == 2 * gaussians_.states() + gaussians_.factor().cols() &&
         state.states.rows() == points_.rows() && state.states.isFinite().all() &&
         block_.Fits(OfPoints(state));
}

void FilterBlock::Restore(double time_s, const EnsembleState::OfBlock& state) {
  block_.Restore(time_s, OfPoints(state));
  const Eigen::Index n = gaussians_.states(), members = gaussians_.members();
  gaussians_.mean() = state.states.middleCols(n, n).topRows(members);
  gaussians_.factor() = state.states.rightCols(gaussians_.factor().cols()).topRows(members);
  time_s_ = time_s;
  failures_.clear();
  failures_seen_ = 0;
  alive_.assign(alive_.size(), true);
  NoteFailures();
}

}  // namespace polyest::internal
