#include "core/propagation/switched_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

Eigen::Index SwitchesOf(const SwitchingModel* model) {
  return static_cast<Eigen::Index>(model->switches().size());
}

// Below this part of a sum's terms the sum is rounding error.
constexpr double kRounding = 1e-12;

}  // namespace

SwitchedRows::SwitchedRows(const SwitchingModel* model, const Eigen::ArrayXXd* parameters,
                           const BlockInputs* inputs, Eigen::Index states)
    : model_(model),
      parameters_(parameters),
      inputs_of_rows_(inputs),
      inputs_(parameters->rows(), inputs->channels()),
      variants_(model, parameters, inputs, 1 + SwitchesOf(model)) {
  const Eigen::Index rows = parameters->rows();
  const Eigen::Index number = SwitchesOf(model);
  modes_.values.setConstant(rows, 1 + number, std::numeric_limits<double>::quiet_NaN());
  modes_.sliding.setConstant(rows, number, false);
  departing_.setZero(rows, number);
  held_.setConstant(rows, number, false);
  resting_.assign(static_cast<size_t>(rows), false);
  surfaces_.reserve(static_cast<size_t>(number));
  columns_.reserve(static_cast<size_t>(number));
  columns_of_sliding_.reserve(static_cast<size_t>(number));
  changes_.setZero(number, states);
  effects_.setZero(number, number);
  matrix_.setZero(number, number);
  for (Eigen::ArrayXd* array :
       {&drift_, &approach_, &rounding_, &lambda_, &right_side_, &solution_}) {
    array->setZero(number);
  }
  row_rates_.setZero(states);
  before_.setZero(number);
}

void SwitchedRows::SetSmoothSpan(double from_s, double until_s, double difference_s) {
  smooth_from_s_ = from_s;
  smooth_until_s_ = until_s;
  difference_s_ = difference_s;
}

SwitchedRows::Interval SwitchedRows::Bounds(Eigen::Index row, Eigen::Index which) const {
  if (modes_.sliding(row, which)) return {0, 1};
  const double mode = modes_.values(row, 1 + which);
  if (model_->switches()[static_cast<size_t>(which)] == SwitchKind::kFloor) return {mode, mode + 1};
  return mode < 0 ? Interval{-kInfinity, 0} : Interval{0, kInfinity};
}

void SwitchedRows::ReadInputs(const Eigen::Ref<const Eigen::ArrayXd>& times_s) {
  for (Eigen::Index i = 0; i < inputs_.cols(); ++i) {
    for (Eigen::Index row = 0; row < inputs_.rows(); ++row) {
      inputs_(row, i) = inputs_of_rows_->At(row, i, times_s(row));
    }
  }
}

void SwitchedRows::Rates(const Eigen::ArrayXd& times_s, const Eigen::ArrayXXd& states,
                         Eigen::ArrayXXd& rates) {
  modes_.values.col(0) = times_s;
  ReadInputs(times_s);
  const ConstBlock modes = modes_.values, x = states, theta = *parameters_, u = inputs_;
  model_->FrozenDerivatives({modes, x, theta, u}, rates);
  for (Eigen::Index row = 0; row < rates.rows(); ++row) {
    if (!Rests(row) && (IsSliding(row) || !rates.row(row).isFinite().all())) {
      RatesOfRow(row, times_s(row), x, rates);
    }
  }
}

void SwitchedRows::RatesOfRow(Eigen::Index row, double time_s, const ConstBlock& states,
                              Eigen::ArrayXXd& rates) {
  if (IsSliding(row)) {
    GatherSliding(modes_, row);
    Analyse(row, time_s, states, modes_);
    rates.row(row) = row_rates_.transpose();
    return;
  }
  variants_.Load(row, time_s, states, modes_.values, 1);
  rates.row(row) = variants_.Rates().row(0);
  // Beyond its piece a branch may be undefined, such as the root of a level that has reached 0. The
  // step ends there anyway.
  if (!rates.row(row).isFinite().all()) rates.row(row) = variants_.NaturalRates().row(0);
}

void SwitchedRows::Observe(const Eigen::ArrayXd& times_s, const Eigen::ArrayXXd& states,
                           Eigen::ArrayXXd& observed) {
  modes_.values.col(0) = times_s;
  ReadInputs(times_s);
  const ConstBlock modes = modes_.values, x = states, theta = *parameters_, u = inputs_;
  model_->Arguments({modes, x, theta, u}, observed);
  for (Eigen::Index row = 0; row < observed.rows(); ++row) {
    if (!Rests(row) && IsSliding(row)) ObserveRow(row, times_s(row), x, observed);
  }
}

void SwitchedRows::ObserveRow(Eigen::Index row, double time_s, const ConstBlock& states,
                              Eigen::ArrayXXd& observed) {
  variants_.Load(row, time_s, states, modes_.values, 1);
  observed.row(row) = variants_.Arguments().row(0);
  if (!IsSliding(row)) return;
  GatherSliding(modes_, row);
  Analyse(row, time_s, states, modes_);
  for (size_t z = 0; z < surfaces_.size(); ++z) {
    observed(row, surfaces_[z].which) = lambda_(static_cast<Eigen::Index>(z));
  }
}

void SwitchedRows::GatherSliding(const Modes& modes, Eigen::Index row) {
  surfaces_.clear();
  for (Eigen::Index i = 0; i < switches(); ++i) {
    if (!modes.sliding(row, i)) continue;
    const double low = modes.values(row, 1 + i);
    const bool floor = model_->switches()[static_cast<size_t>(i)] == SwitchKind::kFloor;
    surfaces_.push_back({i, low, floor ? low + 1 : 1, Status::kSlides});
  }
}

// Computes Δ_j, ∇a_i · Δ_j, λ_j, ȧ_i and ẋ for the surfaces with their present status.
void SwitchedRows::Analyse(Eigen::Index row, double time_s, const ConstBlock& states,
                           const Modes& modes) {
  const auto number = static_cast<Eigen::Index>(surfaces_.size());
  variants_.Load(row, time_s, states, modes.values, 1 + number);
  for (Eigen::Index z = 0; z < number; ++z) {
    const AtSurface& at = surfaces_[static_cast<size_t>(z)];
    const bool high = at.status == Status::kHigh;
    for (Eigen::Index v = 0; v <= number; ++v) {
      variants_.SetMode(v, at.which, high != (v == 1 + z) ? at.high : at.low);
    }
  }
  slopes_ = &variants_.Slopes();
  const Eigen::ArrayXXd& rates = variants_.Rates();
  for (Eigen::Index z = 0; z < number; ++z) {
    const bool high = surfaces_[static_cast<size_t>(z)].status == Status::kHigh;
    changes_.row(z) = (high ? -1 : 1) * (rates.row(1 + z) - rates.row(0));
  }
  row_rates_ = rates.row(0).transpose();
  Differentiate(row, time_s);
  SolveSliding();
}

// Computes ȧ_i = ∂a_i/∂t + ∂a_i/∂x · ẋ + ∂a_i/∂u · u̇ with the rates of the first variant, and the
// effects of the others.
void SwitchedRows::Differentiate(Eigen::Index row, double time_s) {
  const double before_s = std::max(time_s - difference_s_, smooth_from_s_);
  const double after_s = std::min(time_s + difference_s_, smooth_until_s_);
  const auto number = static_cast<Eigen::Index>(surfaces_.size());
  for (Eigen::Index z = 0; z < number; ++z) {
    const Eigen::Index i = surfaces_[static_cast<size_t>(z)].which;
    double drift = Slope(i, 0);
    double terms = std::abs(drift);
    for (Eigen::Index s = 0; s < row_rates_.size(); ++s) {
      const double slope = Slope(i, 1 + s);
      drift += slope * row_rates_(s);
      terms += std::abs(slope * row_rates_(s));
      for (Eigen::Index v = 0; v < number; ++v) terms += std::abs(slope * changes_(v, s));
    }
    for (Eigen::Index k = 0; k < inputs_.cols(); ++k) {
      const double slope = Slope(i, 1 + row_rates_.size() + k);
      if (slope == 0 || !(after_s > before_s)) continue;
      const double change =
          inputs_of_rows_->At(row, k, after_s) - inputs_of_rows_->At(row, k, before_s);
      drift += slope * change / (after_s - before_s);
      terms += std::abs(slope * change / (after_s - before_s));
    }
    drift_(z) = drift;
    rounding_(z) = kRounding * terms;
    for (Eigen::Index v = 0; v < number; ++v) {
      double effect = 0;
      for (Eigen::Index s = 0; s < row_rates_.size(); ++s) {
        effect += Slope(i, 1 + s) * changes_(v, s);
      }
      effects_(z, v) = effect;
    }
  }
}

// Solves Σ_j (∇a_i · Δ_j) λ_j = −ȧ_i for the surfaces that slide, and adds Σ_j λ_j Δ_j.
void SwitchedRows::SolveSliding() {
  const auto number = static_cast<Eigen::Index>(surfaces_.size());
  const auto slides = [this](Eigen::Index z) {
    return surfaces_[static_cast<size_t>(z)].status == Status::kSlides;
  };
  Eigen::Index n = 0;
  for (Eigen::Index i = 0; i < number; ++i) {
    if (!slides(i)) continue;
    Eigen::Index column = 0;
    for (Eigen::Index j = 0; j < number; ++j) {
      if (slides(j)) matrix_(n, column++) = effects_(i, j);
    }
    right_side_(n++) = -drift_(i);
  }
  constexpr double kOpen = 0.5;
  SolveSmall(n, kOpen, matrix_, right_side_, solution_, columns_);
  approach_.head(number) = drift_.head(number);
  lambda_.head(number).setZero();
  n = 0;
  for (Eigen::Index j = 0; j < number; ++j) {
    if (!slides(j)) continue;
    lambda_(j) = solution_(n++);
    row_rates_ += lambda_(j) * changes_.row(j).transpose();
    approach_.head(number) += lambda_(j) * effects_.col(j).head(number);
  }
}

void SwitchedRows::Outputs(double time_s, const ConstBlock& states, const Modes& modes,
                           Block outputs) {
  output_modes_ = modes.values;
  output_modes_.col(0).setConstant(time_s);
  ReadInputs(output_modes_.col(0));
  const ConstBlock sigma = output_modes_, theta = *parameters_, u = inputs_;
  model_->FrozenOutputs({sigma, states, theta, u}, outputs);
  for (Eigen::Index row = 0; row < outputs.rows(); ++row) {
    if (modes.sliding.row(row).any()) {
      GatherSliding(modes, row);
      Analyse(row, time_s, states, modes);
      const Eigen::ArrayXXd& y = variants_.Outputs();
      outputs.row(row) = y.row(0);
      for (Eigen::Index z = 0; z < std::ssize(surfaces_); ++z) {
        outputs.row(row) += lambda_(z) * (y.row(1 + z) - y.row(0));
      }
    }
    if (outputs.row(row).isFinite().all()) continue;
    variants_.Load(row, time_s, states, modes.values, 1);
    outputs.row(row) = variants_.NaturalOutputs().row(0);
  }
}

}  // namespace polyest::internal
