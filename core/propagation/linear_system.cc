#include "core/propagation/linear_system.h"

#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

#include "core/model/input_generator.h"
#include "core/propagation/block_rows.h"

namespace polyest::internal {
namespace {

// A state or an input is given this size, a power of 2, to read its coefficients: the constant part
// of the right-hand side then vanishes beside them, and powers up to the fifth that a zero
// parameter multiplies do not overflow.
constexpr double kUnit = 0x1p200;

// Evaluates the right-hand side of a linear model at states and inputs of its own choice.
class RightHandSide {
 public:
  RightHandSide(const StateSpaceModel& model, const Eigen::ArrayXXd& parameters,
                const Eigen::ArrayXXd& constant_inputs)
      : model_(model),
        parameters_(parameters),
        states_(Eigen::ArrayXXd::Zero(parameters.rows(), std::ssize(model.description().states))),
        inputs_(constant_inputs),
        constant_(states_.rows(), states_.cols()) {
    Evaluate(constant_);
  }

  // Returns c, with the inputs that do not vary in it.
  const Eigen::ArrayXXd& Constant() const { return constant_; }
  // Returns the column of A or B, rows × states.
  Eigen::ArrayXXd ColumnOfState(Eigen::Index state) { return Column(states_.col(state)); }
  Eigen::ArrayXXd ColumnOfInput(Eigen::Index input) { return Column(inputs_.col(input)); }

 private:
  void Evaluate(Block derivatives) const {
    model_.Derivatives(0, states_, parameters_, inputs_, derivatives);
  }

  Eigen::ArrayXXd Column(Eigen::Ref<Eigen::ArrayXd> variable) {
    Eigen::ArrayXXd column(states_.rows(), states_.cols());
    variable.setConstant(kUnit);
    Evaluate(column);
    variable.setZero();
    return (column - constant_) / kUnit;
  }

  const StateSpaceModel& model_;
  const Eigen::ArrayXXd& parameters_;
  Eigen::ArrayXXd states_, inputs_, constant_;
};

// Scales row and column i of a matrix by inverse powers of 2, so that their sums become nearly
// equal. Returns whether that was worth while.
bool Balance(Matrix& absolute, Eigen::Index i) {
  const double column = absolute.col(i).sum() - absolute(i, i);
  const double row = absolute.row(i).sum() - absolute(i, i);
  if (!(column > 0 && row > 0) || !std::isfinite(column + row)) return false;
  const double factor = std::exp2(std::round(0.5 * std::log2(row / column)));
  if (!(column * factor + row / factor < 0.95 * (column + row))) return false;
  absolute.col(i) *= factor;
  absolute.row(i) /= factor;
  return true;
}

// Returns the least 1-norm of A over diagonal changes of units, nearly: it bounds the rate at which
// the system changes in units that suit it. Source: Parlett & Reinsch, Numer. Math. 13 (1969) 293.
double RateOf(const Eigen::ArrayXXd& coefficients, Eigen::Index point, Eigen::Index states) {
  Matrix absolute(states, states);
  for (Eigen::Index s = 0; s < states; ++s) {
    for (Eigen::Index i = 0; i < states; ++i) {
      absolute(i, s) = std::abs(coefficients(point, s * states + i));
    }
  }
  constexpr int kMaxSweeps = 20;
  bool changed = true;
  for (int sweep = 0; changed && sweep < kMaxSweeps; ++sweep) {
    changed = false;
    for (Eigen::Index i = 0; i < states; ++i) changed = Balance(absolute, i) || changed;
  }
  return absolute.colwise().sum().maxCoeff();
}

// Returns the greatest angular frequency in J; its shifts are not rates.
double RateOfGenerators(const Matrix& J) {
  return std::sqrt(-J.cwiseProduct(J.transpose()).minCoeff());
}

Eigen::ArrayXXd ConstantInputs(const Eigen::ArrayXXd& amplitudes, const Eigen::ArrayXXd& offsets,
                               const std::vector<size_t>& varying) {
  Eigen::ArrayXXd values = amplitudes;
  if (offsets.size() > 0) values += offsets;
  for (const size_t input : varying) values.col(static_cast<Eigen::Index>(input)).setZero();
  return values;
}

bool SameDelays(const Matrix& delays_s, Eigen::Index input) {
  return delays_s.size() == 0 || (delays_s.col(input).array() == delays_s(0, input)).all();
}

bool IsLinear(const StateSpaceModel& model, const EnsembleSpecification& specification,
              const InputSignals& inputs) {
  std::vector<bool> zero, constant;
  for (Eigen::Index j = 0; j < specification.parameters.cols(); ++j) {
    zero.push_back((specification.parameters.col(j).array() == 0).all());
  }
  for (const InputSignal& input : inputs) {
    constant.push_back(std::holds_alternative<ConstantInput>(input.specification()));
  }
  return model.IsLinear(zero, constant);
}

}  // namespace

bool StepsExactly(const EnsembleSpecification& specification, const InputSignals& inputs) {
  const auto* model = dynamic_cast<const StateSpaceModel*>(specification.model.get());
  if (model == nullptr || specification.integration.method != IntegrationMethod::kAuto ||
      specification.parameters.rows() == 0) {
    return false;
  }
  const auto states = std::ssize(model->description().states);
  if (states == 0 || states > kMaxExactStates) return false;
  for (size_t i = 0; i < inputs.size(); ++i) {
    const bool constant = std::holds_alternative<ConstantInput>(inputs[i].specification());
    if (!constant && (GeneratorSize(inputs[i]) == 0 ||
                      !SameDelays(specification.input_delays_s, static_cast<Eigen::Index>(i)))) {
      return false;
    }
  }
  if (!IsLinear(*model, specification, inputs)) return false;
  const std::vector<int> rows = PaddedRows(static_cast<int>(specification.parameters.rows()));
  const LinearSystem system =
      LinearSystemOf(*model, specification.parameters(rows, Eigen::all).array(), inputs,
                     BlockInputs(specification, &inputs, rows));
  return system.coefficients.isFinite().all() && std::isfinite(system.rate);
}

LinearSystem LinearSystemOf(const StateSpaceModel& model, const Eigen::ArrayXXd& parameters,
                            const InputSignals& signals, const BlockInputs& inputs) {
  const std::vector<size_t> varying = inputs.Varying();
  RightHandSide right(model, parameters,
                      ConstantInputs(inputs.amplitudes(), inputs.offsets(), varying));
  LinearSystem system;
  const Eigen::Index n = system.states = std::ssize(model.description().states);
  system.components = 1;
  for (const size_t i : varying) {
    system.generators.push_back({i, system.components, GeneratorSize(signals[i])});
    system.components += system.generators.back().size;
  }
  system.coefficients.setZero(parameters.rows(), n * (n + system.components));
  system.J.setZero(system.components, system.components);
  const auto column = [&](Eigen::Index c) { return system.coefficients.middleCols(c * n, n); };
  for (Eigen::Index s = 0; s < n; ++s) column(s) = right.ColumnOfState(s);
  column(n) = right.Constant();
  for (const LinearSystem::Generator& generator : system.generators) {
    const auto i = static_cast<Eigen::Index>(generator.input);
    const Eigen::ArrayXXd B = right.ColumnOfInput(i);
    // D_0 = c + Σ_i B_i offset_i,  D_first = B_i amplitude_i
    if (inputs.offsets().size() > 0) column(n) += B.colwise() * inputs.offsets().col(i);
    column(n + generator.first) = B.colwise() * inputs.amplitudes().col(i);
    system.J.block(generator.first, generator.first, generator.size, generator.size) =
        GeneratorMatrix(signals[generator.input]);
  }
  system.rate = RateOfGenerators(system.J);
  for (Eigen::Index point = 0; point < parameters.rows(); ++point) {
    system.rate = std::max(system.rate, RateOf(system.coefficients, point, n));
  }
  return system;
}

}  // namespace polyest::internal
