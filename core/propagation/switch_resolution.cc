// Decides which way a row goes at the surfaces where its equations switch.

#include <algorithm>
#include <cmath>

#include "core/propagation/switched_rows.h"

namespace polyest::internal {
namespace {

// Arguments within this part of their tolerance of a surface are at it.
constexpr double kAtSurface = 1e-3;
// Below this part of an argument a change of it is rounding error.
constexpr double kRoundingOfArguments = 1e-12;
// Two gradients whose directions differ by less, squared, are the same.
constexpr double kParallel = 1e-10;

double NaturalMode(SwitchKind kind, double argument, double mode) {
  const double unknown = std::isnan(mode) ? 1 : mode;
  if (kind == SwitchKind::kSign) return argument > 0 ? 1 : argument < 0 ? -1 : unknown;
  if (!std::isfinite(argument)) return unknown;
  return argument >= mode && argument <= mode + 1 ? mode : std::floor(argument);
}

}  // namespace

void SolveSmall(Eigen::Index n, double open, Eigen::ArrayXXd& A, Eigen::ArrayXd& b,
                Eigen::ArrayXd& x, std::vector<Eigen::Index>& order) {
  order.resize(static_cast<size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i) order[static_cast<size_t>(i)] = i;
  const double largest = n > 0 ? A.topLeftCorner(n, n).abs().maxCoeff() : 0;
  constexpr double kSingular = 1e-12;
  Eigen::Index rank = 0;
  for (; rank < n; ++rank) {
    Eigen::Index row = 0, column = 0;
    const Eigen::Index left = n - rank;
    const double pivot = A.block(rank, rank, left, left).abs().maxCoeff(&row, &column);
    if (!(pivot > kSingular * largest)) break;
    A.row(rank).head(n).swap(A.row(rank + row).head(n));
    std::swap(b(rank), b(rank + row));
    A.col(rank).head(n).swap(A.col(rank + column).head(n));
    std::swap(order[static_cast<size_t>(rank)], order[static_cast<size_t>(rank + column)]);
    for (Eigen::Index i = rank + 1; i < n; ++i) {
      const double factor = A(i, rank) / A(rank, rank);
      A.row(i).head(n) -= factor * A.row(rank).head(n);
      b(i) -= factor * b(rank);
    }
  }
  x.head(n).setConstant(open);
  for (Eigen::Index i = rank; i-- > 0;) {
    double sum = b(i);
    for (Eigen::Index j = i + 1; j < n; ++j) sum -= A(i, j) * x(order[static_cast<size_t>(j)]);
    x(order[static_cast<size_t>(i)]) = sum / A(i, i);
  }
}

double SwitchedRows::Encoded(const Modes& modes, Eigen::Index row, Eigen::Index which) const {
  return modes.values(row, 1 + which) + (modes.sliding(row, which) ? HalfStep(which) : 0);
}

void SwitchedRows::Decode(Eigen::Index row, Eigen::Index which, double encoded) {
  const double half = HalfStep(which);
  // The modes of a sign are odd, those of a floor whole; half a step between two of them slides.
  const bool slides = half == 1 ? encoded == 0 : encoded != std::floor(encoded);
  modes_.sliding(row, which) = slides && !std::isnan(encoded);
  modes_.values(row, 1 + which) = modes_.sliding(row, which) ? encoded - half : encoded;
}

// Sets all modes by the arguments. An argument may depend on the modes of others, so that it takes
// as many passes as they are nested.
bool SwitchedRows::TakeNaturalModes(Eigen::Index row, double time_s, const ConstBlock& states,
                                    const Eigen::ArrayXXd& tolerance) {
  for (Eigen::Index pass = 0; pass <= switches() + 1; ++pass) {
    variants_.Load(row, time_s, states, modes_.values, 1);
    const Eigen::ArrayXXd& arguments = variants_.Arguments();
    bool changed = false;
    for (Eigen::Index i = 0; i < switches(); ++i) {
      double& mode = modes_.values(row, 1 + i);
      const double argument = arguments(0, i);
      if (modes_.sliding(row, i)) {
        const double surface = 2 * HalfStep(i) == 1 ? mode + 1 : 0;
        if (std::abs(argument - surface) <= tolerance(row, i)) continue;
        modes_.sliding(row, i) = false;
        changed = true;
      }
      const double natural =
          NaturalMode(model_->switches()[static_cast<size_t>(i)], argument, mode);
      changed = changed || mode != natural;
      mode = natural;
    }
    if (!changed) return true;
  }
  return false;
}

// Appends the switch to the surfaces if its argument is at one.
void SwitchedRows::Gather(Eigen::Index which, double mode, double argument, double tolerance) {
  if (HalfStep(which) == 1) {
    if (!(std::abs(argument) <= tolerance)) return;
    surfaces_.push_back({which, -1, 1, mode < 0 ? Status::kLow : Status::kHigh});
  } else if (std::abs(argument - mode) <= std::min(tolerance, 0.5)) {
    surfaces_.push_back({which, mode - 1, mode, Status::kHigh});
  } else if (std::abs(argument - mode - 1) <= tolerance) {
    surfaces_.push_back({which, mode, mode + 1, Status::kLow});
  }
}

// Appends the switches that are at their surfaces without sliding.
void SwitchedRows::GatherOthers(Eigen::Index row, double time_s, const ConstBlock& states,
                                Eigen::Index except, const Eigen::ArrayXXd& tolerance) {
  variants_.Load(row, time_s, states, modes_.values, 1);
  const Eigen::ArrayXXd& arguments = variants_.Arguments();
  before_ = arguments.row(0).transpose();
  for (Eigen::Index i = 0; i < switches(); ++i) {
    if (i == except || modes_.sliding(row, i)) continue;
    const double within = held_(row, i) ? kInfinity : kAtSurface * tolerance(row, i);
    Gather(i, modes_.values(row, 1 + i), arguments(0, i), within);
  }
}

bool SwitchedRows::Settle(Eigen::Index row, double time_s, const ConstBlock& states,
                          const Eigen::ArrayXXd& tolerance) {
  if (!TakeNaturalModes(row, time_s, states, tolerance)) return false;
  held_.row(row).setConstant(false);
  GatherSliding(modes_, row);
  GatherOthers(row, time_s, states, -1, tolerance);
  return ResolveAll(row, time_s, states, tolerance);
}

bool SwitchedRows::Leave(Eigen::Index row, double time_s, const ConstBlock& states,
                         Eigen::Index which, bool upwards, const Eigen::ArrayXXd& tolerance) {
  const Status status = upwards ? Status::kHigh : Status::kLow;
  GatherSliding(modes_, row);
  if (modes_.sliding(row, which)) {
    for (AtSurface& at : surfaces_) {
      if (at.which == which) at.status = status;
    }
  } else {
    const double step = 2 * HalfStep(which);
    const double mode = modes_.values(row, 1 + which);
    surfaces_.push_back(
        {which, upwards ? mode : mode - step, upwards ? mode + step : mode, status});
  }
  GatherOthers(row, time_s, states, which, tolerance);
  return ResolveAll(row, time_s, states, tolerance);
}

// Resolves the surfaces and what follows from it at the same instant. Arguments depend on modes
// without a cycle, so that as many passes as there are switches are enough. Only surfaces that
// resolve differently after each jump can need more. Then a switch is left out of its bounds, and
// the integrator, which finds it again without having moved, reports the endless sequence.
bool SwitchedRows::ResolveAll(Eigen::Index row, double time_s, const ConstBlock& states,
                              const Eigen::ArrayXXd& tolerance) {
  for (Eigen::Index pass = 0; pass <= switches(); ++pass) {
    if (!Resolve(row, time_s, states)) return false;
    if (!TakeJumps(row, time_s, states, tolerance)) return true;
  }
  return true;
}

// Takes the natural modes of the switches whose arguments jumped when the modes of others changed,
// as mod(t, T) − T/2 does where mod wraps. Such an argument is not at the surface that it jumps
// across, so that the direction in which it moves must not decide its mode. Returns whether any
// argument jumped.
bool SwitchedRows::TakeJumps(Eigen::Index row, double time_s, const ConstBlock& states,
                             const Eigen::ArrayXXd& tolerance) {
  variants_.Load(row, time_s, states, modes_.values, 1);
  const Eigen::ArrayXXd& arguments = variants_.Arguments();
  bool any = false;
  for (Eigen::Index i = 0; i < switches(); ++i) {
    const double argument = arguments(0, i);
    const double rounding = kRoundingOfArguments * (std::abs(argument) + std::abs(before_(i)));
    const bool jumps = std::abs(argument - before_(i)) > tolerance(row, i) + rounding;
    before_(i) = argument;
    if (!jumps) continue;
    any = true;
    std::erase_if(surfaces_, [i](const AtSurface& at) { return at.which == i; });
    modes_.sliding(row, i) = false;
    double& mode = modes_.values(row, 1 + i);
    mode = NaturalMode(model_->switches()[static_cast<size_t>(i)], argument, mode);
    // It may have jumped onto a surface, as mod(t, T) does onto 0.
    Gather(i, mode, argument, kAtSurface * tolerance(row, i) + rounding);
  }
  return any;
}

bool SwitchedRows::Resolve(Eigen::Index row, double time_s, const ConstBlock& states) {
  departing_.row(row).setZero();
  held_.row(row).setConstant(false);
  if (surfaces_.empty()) return true;
  const size_t most = 8 + 4 * surfaces_.size();
  for (size_t attempt = 0; attempt < most; ++attempt) {
    Analyse(row, time_s, states, modes_);
    if (Correct()) continue;
    Accept(row);
    return true;
  }
  return false;
}

// Changes the first status that contradicts the motion; returns false if none does. A row goes on
// the low side only if it moves downwards there, and on the high side only upwards. Where neither
// holds it slides.
bool SwitchedRows::Correct() {
  for (size_t z = 0; z < surfaces_.size(); ++z) {
    const auto i = static_cast<Eigen::Index>(z);
    Status& status = surfaces_[z].status;
    const bool may_slide = effects_(i, i) < -rounding_(i);
    if (status == Status::kSlides) {
      if (lambda_(i) >= 0 && lambda_(i) <= 1) continue;
      if (std::isnan(lambda_(i))) continue;
      status = lambda_(i) < 0 ? Status::kLow : Status::kHigh;
      return true;
    }
    if (status == Status::kLow && approach_(i) > rounding_(i)) {
      status = may_slide ? Status::kSlides : Status::kHigh;
      return true;
    }
    if (status == Status::kHigh && approach_(i) < -rounding_(i)) {
      status = may_slide ? Status::kSlides : Status::kLow;
      return true;
    }
  }
  return false;
}

void SwitchedRows::Accept(Eigen::Index row) {
  for (size_t z = 0; z < surfaces_.size(); ++z) {
    const AtSurface& at = surfaces_[z];
    modes_.sliding(row, at.which) = at.status == Status::kSlides;
    modes_.values(row, 1 + at.which) = at.status == Status::kHigh ? at.high : at.low;
    departing_(row, at.which) = at.status == Status::kHigh ? -1 : at.status == Status::kLow ? 1 : 0;
    held_(row, at.which) = at.status != Status::kSlides && IsDependent(z);
  }
}

// Returns ∇a_i · ∇a_j of two surfaces.
double SwitchedRows::Product(Eigen::Index i, Eigen::Index j) const {
  double product = 0;
  for (Eigen::Index s = 0; s < row_rates_.size(); ++s) {
    product += Slope(surfaces_[static_cast<size_t>(i)].which, 1 + s) *
               Slope(surfaces_[static_cast<size_t>(j)].which, 1 + s);
  }
  return product;
}

// Whether the gradient of the argument is a combination of the gradients of those that slide: what
// is left of it, g² − gᵀ Gᵀ (G Gᵀ)⁻¹ G g, is 0.
bool SwitchedRows::IsDependent(size_t surface) {
  const auto z = static_cast<Eigen::Index>(surface);
  columns_of_sliding_.clear();
  for (size_t i = 0; i < surfaces_.size(); ++i) {
    if (surfaces_[i].status == Status::kSlides) {
      columns_of_sliding_.push_back(static_cast<Eigen::Index>(i));
    }
  }
  const auto n = static_cast<Eigen::Index>(columns_of_sliding_.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index first = columns_of_sliding_[static_cast<size_t>(i)];
    right_side_(i) = Product(first, z);
    for (Eigen::Index j = 0; j < n; ++j) {
      matrix_(i, j) = Product(first, columns_of_sliding_[static_cast<size_t>(j)]);
    }
  }
  SolveSmall(n, 0, matrix_, right_side_, solution_, columns_);
  const double square = Product(z, z);
  double left = square;
  for (Eigen::Index i = 0; i < n; ++i) {
    left -= solution_(i) * Product(columns_of_sliding_[static_cast<size_t>(i)], z);
  }
  return n > 0 && square > 0 && left <= kParallel * square;
}

void SwitchedRows::ArgumentErrors(Eigen::Index row, double time_s, const ConstBlock& states,
                                  double relative, const Eigen::ArrayXXd& weights,
                                  Eigen::ArrayXXd& errors) {
  variants_.Load(row, time_s, states, modes_.values, 1);
  slopes_ = &variants_.Slopes();
  for (Eigen::Index i = 0; i < switches(); ++i) {
    double error = 0;
    for (Eigen::Index s = 0; s < states.cols(); ++s) {
      const double of_state = relative * std::abs(states(row, s)) + 1 / weights(row, s);
      error += std::abs(Slope(i, 1 + s)) * of_state;
    }
    errors(row, i) = error;
  }
}

// x ← x − W⁻² Gᵀ (G W⁻² Gᵀ)⁻¹ (a − a*), where the rows of G are the ∇a_i and a* is the surface.
void SwitchedRows::Project(Eigen::Index row, double time_s, const Eigen::ArrayXXd& weights,
                           Eigen::ArrayXXd& states, Eigen::Index left) {
  GatherSliding(modes_, row);
  if (left >= 0 && departing_(row, left) != 0 && !held_(row, left)) {
    const Interval bounds = Bounds(row, left);
    const double surface = departing_(row, left) > 0 ? bounds.upper : bounds.lower;
    surfaces_.push_back({left, surface, surface, Status::kHigh});
  }
  if (surfaces_.empty()) return;
  variants_.Load(row, time_s, states, modes_.values, 1);
  slopes_ = &variants_.Slopes();
  const Eigen::ArrayXXd& arguments = variants_.Arguments();
  const auto number = static_cast<Eigen::Index>(surfaces_.size());
  for (Eigen::Index z = 0; z < number; ++z) {
    const AtSurface& at = surfaces_[static_cast<size_t>(z)];
    right_side_(z) = arguments(0, at.which) - (HalfStep(at.which) == 1 ? 0 : at.high);
    for (Eigen::Index v = 0; v < number; ++v) {
      const Eigen::Index other = surfaces_[static_cast<size_t>(v)].which;
      double product = 0;
      for (Eigen::Index s = 0; s < states.cols(); ++s) {
        const double w = weights(row, s);
        product += Slope(at.which, 1 + s) / w * (Slope(other, 1 + s) / w);
      }
      matrix_(z, v) = product;
    }
  }
  SolveSmall(number, 0, matrix_, right_side_, solution_, columns_);
  for (Eigen::Index s = 0; s < states.cols(); ++s) {
    const double w = weights(row, s);
    double correction = 0;
    for (Eigen::Index z = 0; z < number; ++z) {
      correction += Slope(surfaces_[static_cast<size_t>(z)].which, 1 + s) / w * solution_(z) / w;
    }
    states(row, s) -= correction;
  }
}

}  // namespace polyest::internal
