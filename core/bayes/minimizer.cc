#include "core/bayes/minimizer.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <new>
#include <nlopt.hpp>
#include <stdexcept>
#include <utility>

#include "core/bayes/unit_problem.h"
#include "core/common/check.h"
#include "core/common/linear_algebra.h"
#include "core/common/parallel.h"

namespace polyest::internal {
namespace {

// The value that replaces +∞ for the solver, far above any other value of the scaled function.
constexpr double kHuge = 1e20;
constexpr double kActive = UnitProblem::kActive;
// The largest number of times that SLSQP is restarted from its result with fresh curvature.
constexpr int kMaxRestarts = 8;
constexpr int kMaxNewtonSteps = 6;

std::string InWords(int code) {
  switch (code) {
    case nlopt::SUCCESS:
      return "converged";
    case nlopt::STOPVAL_REACHED:
      return "the stop value was reached";
    case nlopt::FTOL_REACHED:
      return "the value no longer changes";
    case nlopt::XTOL_REACHED:
      return "the point no longer moves";
    case nlopt::MAXEVAL_REACHED:
      return "the most evaluations were spent";
    case nlopt::MAXTIME_REACHED:
      return "the time was spent";
    case nlopt::FAILURE:
      return "the solver failed";
    case nlopt::INVALID_ARGS:
      return "the solver refused its arguments";
    case nlopt::OUT_OF_MEMORY:
      return "the solver ran out of memory";
    case nlopt::ROUNDOFF_LIMITED:
      return "rounding errors end progress";
    case nlopt::FORCED_STOP:
      return "stopped on request";
    default:
      return "unknown return code of the solver";
  }
}

// The data of NLopt's callback for the function.
struct Callback {
  UnitProblem* problem;
  nlopt::opt* solver = nullptr;
  std::exception_ptr thrown;  // by the function, which NLopt would make a code of failure of
};

double ValueAt(UnitProblem& problem, const std::vector<double>& u, std::vector<double>& gradient) {
  const Vector point = Eigen::Map<const Vector>(u.data(), static_cast<Eigen::Index>(u.size()));
  Vector slope;
  const double value = problem.Value(point, gradient.empty() ? nullptr : &slope);
  if (!gradient.empty()) Eigen::Map<Vector>(gradient.data(), slope.size()) = slope;
  return std::min(value, kHuge);
}

double CallFunction(const std::vector<double>& u, std::vector<double>& gradient, void* data) {
  Callback& callback = *static_cast<Callback*>(data);
  if (callback.problem->PollStop()) callback.solver->force_stop();
  try {
    return ValueAt(*callback.problem, u, gradient);
  } catch (...) {
    callback.thrown = std::current_exception();
    callback.solver->force_stop();
    return kHuge;
  }
}

// Evaluates all constraints at once: rows u − bounds ≤ 0, the gradient row-major.
void CallConstraints(unsigned count, double* result, unsigned n, const double* u, double* gradient,
                     void* data) {
  const UnitProblem& problem = *static_cast<UnitProblem*>(data);
  const Eigen::Map<const Vector> point(u, n);
  Eigen::Map<Vector>(result, count) = problem.rows() * point - problem.bounds();
  if (gradient == nullptr) return;
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<RowMajor>(gradient, count, n) = problem.rows();
}

struct Run {
  Vector point;
  int code = nlopt::FAILURE;
};

Run RunSolver(UnitProblem& problem, const Vector& start, const MinimizerOptions& options) {
  std::vector<double> u(start.data(), start.data() + start.size());
  Run run{start};
  Callback callback{.problem = &problem, .solver = nullptr, .thrown = nullptr};
  try {
    nlopt::opt solver(nlopt::LD_SLSQP, static_cast<unsigned>(start.size()));
    callback.solver = &solver;
    solver.set_min_objective(CallFunction, &callback);
    solver.set_lower_bounds(0);
    solver.set_upper_bounds(1);
    if (problem.rows().rows() > 0) {
      solver.add_inequality_mconstraint(
          CallConstraints, &problem,
          std::vector<double>(static_cast<size_t>(problem.rows().rows()), kActive));
    }
    solver.set_xtol_abs(options.relative_step);
    solver.set_xtol_rel(0);
    solver.set_ftol_rel(0);
    solver.set_maxeval(std::max(1, options.max_evaluations));
    double value = 0;
    try {
      run.code = solver.optimize(u, value);
    } catch (const nlopt::roundoff_limited&) {
      run.code = nlopt::ROUNDOFF_LIMITED;
    } catch (const nlopt::forced_stop&) {
      run.code = nlopt::FORCED_STOP;
    }
  } catch (const std::invalid_argument&) {
    run.code = nlopt::INVALID_ARGS;
  } catch (const std::bad_alloc&) {
    run.code = nlopt::OUT_OF_MEMORY;
  } catch (const std::exception&) {
    run.code = nlopt::FAILURE;
  }
  if (callback.thrown) std::rethrow_exception(callback.thrown);
  const Vector end = Eigen::Map<const Vector>(u.data(), start.size());
  if (end.allFinite()) run.point = problem.Project(end);
  return run;
}

// Returns an orthonormal basis of the directions that keep the constraints active at u that have a
// positive multiplier: leaving those would raise the function.
Matrix FreeDirections(const UnitProblem& problem, const Vector& u, const Vector& gradient) {
  const Eigen::Index n = u.size();
  std::vector<Vector> normals;  // outward
  for (Eigen::Index i = 0; i < n; ++i) {
    if (u[i] <= kActive) normals.push_back(-Vector::Unit(n, i));
    if (u[i] >= 1 - kActive) normals.push_back(Vector::Unit(n, i));
  }
  for (Eigen::Index i = 0; i < problem.rows().rows(); ++i) {
    if (problem.rows().row(i).dot(u) >= problem.bounds()[i] - kActive) {
      normals.push_back(problem.rows().row(i).transpose());
    }
  }
  while (!normals.empty()) {
    Matrix active(n, static_cast<Eigen::Index>(normals.size()));
    for (size_t i = 0; i < normals.size(); ++i)
      active.col(static_cast<Eigen::Index>(i)) = normals[i];
    const PivotedQr factors = SolveByPivotedQr(active, -gradient);
    const Vector& multipliers = factors.solution;  // gradient + active · multipliers = 0
    Eigen::Index worst = 0;
    if (multipliers.minCoeff(&worst) >= 0) {
      return factors.q.rightCols(n - factors.rank);
    }
    normals.erase(normals.begin() + worst);
  }
  return Matrix::Identity(n, n);
}

// Returns Zᵀ ∇²f Z by central differences of the gradient along the columns of Z; infinite where f
// is not finite or where the box leaves no room for the differences.
Matrix ReducedHessian(UnitProblem& problem, const Vector& u, const Matrix& z) {
  constexpr double kStep = 1e-5;
  Matrix hessian(z.cols(), z.cols());
  Vector forward(u.size()), backward(u.size());
  for (Eigen::Index i = 0; i < z.cols(); ++i) {
    double step = kStep;
    for (Eigen::Index j = 0; j < u.size(); ++j) {
      const double slope = std::abs(z(j, i));
      if (slope > kActive) step = std::min(step, std::min(u[j], 1 - u[j]) / slope);
    }
    const double valid = problem.Value(u + step * z.col(i), &forward) +
                         problem.Value(u - step * z.col(i), &backward);
    hessian.col(i) = z.transpose() * (forward - backward) / (2 * step);
    if (!std::isfinite(valid) || step < kStep / 1000) return hessian.setConstant(kInfinity);
  }
  return (hessian + hessian.transpose()) / 2;
}

enum class Polish { kConverged, kSaddle, kUnsure };

// Applies Newton's method, by the gradient alone, in the free directions: near a minimum rounding
// spoils differences of values long before it spoils the gradient. Moves `u` down from a saddle.
Polish PolishPoint(UnitProblem& problem, const MinimizerOptions& options, Vector& u) {
  constexpr double kFlat = 1e-13;  // × the largest curvature: less counts as no curvature
  constexpr double kKick = 1e-3;
  Vector gradient(u.size());
  double value = problem.Value(u, &gradient);
  for (int step = 0; step < kMaxNewtonSteps && std::isfinite(value); ++step) {
    const Matrix z = FreeDirections(problem, u, gradient);
    if (z.cols() == 0) return Polish::kConverged;
    const Matrix hessian = ReducedHessian(problem, u, z);
    if (!hessian.allFinite()) return Polish::kUnsure;
    const SymmetricEigen eigen = DecomposeSymmetric(hessian);
    const Vector& curvature = eigen.values;
    const double largest = curvature.cwiseAbs().maxCoeff();
    if (curvature[0] < -1e-6 * largest) {
      u = problem.Project(u + kKick * z * eigen.vectors.col(0));
      return Polish::kSaddle;
    }
    if (curvature[0] <= kFlat * largest) return Polish::kUnsure;
    // The step is p = −Z (Zᵀ H Z)⁻¹ Zᵀ g; the decrement gᵀ Z (Zᵀ H Z)⁻¹ Zᵀ g is twice a full step's
    // gain.
    const Matrix root = z * eigen.vectors * curvature.cwiseSqrt().cwiseInverse().asDiagonal();
    const Vector p = -root * (root.transpose() * gradient);
    if (p.cwiseAbs().maxCoeff() <= options.relative_step) return Polish::kConverged;
    const Vector next = problem.Project(u + p);
    Vector next_gradient(u.size());
    const double next_value = problem.Value(next, &next_gradient);
    const double decrement = (root.transpose() * gradient).squaredNorm();
    const double next_decrement = (root.transpose() * next_gradient).squaredNorm();
    if (!std::isfinite(next_value) || !(next_decrement < decrement)) {
      // The gradient cannot improve any more. The point has converged if a full step's gain is
      // below the rounding of the value.
      return decrement <= 1e-14 * std::abs(value) ? Polish::kConverged : Polish::kUnsure;
    }
    u = next;
    value = next_value;
    gradient = next_gradient;
  }
  return Polish::kUnsure;
}

// Returns the first point on the way from the start to the middle of the box at which f is finite.
// Scales the function so that its steepest slope there is 1.
Vector PrepareStart(UnitProblem& problem, const Vector& start) {
  const Vector centre = problem.Project(Vector::Constant(start.size(), 0.5));
  Vector gradient(start.size());
  for (const double fraction : {0.0, 1e-6, 1e-4, 1e-2, 0.1, 0.3, 0.6, 1.0}) {
    const Vector u = start + fraction * (centre - start);
    if (!std::isfinite(problem.Value(u, &gradient))) continue;
    const double slope = gradient.cwiseAbs().maxCoeff();
    if (slope > 0) problem.set_function_scale(problem.function_scale() * slope);
    return u;
  }
  return start;
}

// Returns the point, put on the bounds that it missed by rounding unless f is infinite there.
Vector OnBounds(UnitProblem& problem, const Vector& u) {
  constexpr double kMaxMissed = 1e-12;
  Vector snapped = u;
  for (double& value : snapped) {
    if (value < kMaxMissed) value = 0;
    if (value > 1 - kMaxMissed) value = 1;
  }
  return std::isfinite(problem.Value(snapped, nullptr)) ? snapped : u;
}

bool IsSuccess(int code) {
  return code == nlopt::SUCCESS || code == nlopt::FTOL_REACHED || code == nlopt::XTOL_REACHED;
}

Minimum MinimizeFrom(const MinimizationProblem& original, const Vector& start,
                     const MinimizerOptions& options, const Stop& stop) {
  UnitProblem problem(original, stop);
  Vector u = PrepareStart(problem, problem.Project(problem.ToUnit(start)));
  double value = problem.Value(u, nullptr);
  Minimum minimum;
  for (int restart = 0; restart <= kMaxRestarts && std::isfinite(value); ++restart) {
    const Run run = RunSolver(problem, u, options);
    minimum.code = run.code;
    Vector next = run.point;
    Polish polish = Polish::kUnsure;
    if (!problem.PollStop()) polish = PolishPoint(problem, options, next);
    const double next_value = problem.Value(next, nullptr);
    const bool moved = (next - u).cwiseAbs().maxCoeff() > options.relative_step;
    const bool lower = next_value < value;
    if (next_value <= value || polish == Polish::kSaddle) {
      u = next;
      value = next_value;
    }
    minimum.converged = polish == Polish::kConverged ||
                        (polish == Polish::kUnsure && !(moved && lower) && IsSuccess(run.code));
    if (minimum.converged || problem.stopped() || !std::isfinite(next_value)) break;
    if (problem.evaluations() >= options.max_evaluations) break;
  }
  minimum.point = problem.ToPoint(problem.Project(OnBounds(problem, u)));
  minimum.value = original.function(minimum.point, nullptr);
  minimum.evaluations = problem.evaluations() + 1;
  minimum.reason = std::isfinite(value) ? InWords(minimum.code) : "the function is not finite";
  if (!std::isfinite(minimum.value)) minimum.value = kInfinity;
  if (problem.stopped()) minimum.converged = false;
  return minimum;
}

}  // namespace

std::vector<Minimum> DistinctMinima(std::vector<Minimum> found, const MinimizationProblem& problem,
                                    const MinimizerOptions& options) {
  std::stable_sort(found.begin(), found.end(),
                   [](const Minimum& a, const Minimum& b) { return a.value < b.value; });
  const Vector tolerance = options.same_point * (problem.upper - problem.lower);
  std::vector<Minimum> distinct;
  for (Minimum& minimum : found) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Minimum& other) {
      return ((minimum.point - other.point).cwiseAbs().array() <= tolerance.array()).all();
    });
    // A run that gave up is not a minimum, unless its value is the lowest.
    if (!known && (distinct.empty() || minimum.converged)) distinct.push_back(std::move(minimum));
  }
  return distinct;
}

Vector DescendFrom(const MinimizationProblem& original, const Vector& start,
                   const MinimizerOptions& options, const Stop& stop) {
  UnitProblem problem(original, stop);
  const Vector u = PrepareStart(problem, problem.Project(problem.ToUnit(start)));
  const Vector end = RunSolver(problem, u, options).point;
  const bool lower = problem.Value(end, nullptr) <= problem.Value(u, nullptr);
  return problem.ToPoint(problem.Project(lower ? end : u));
}

std::vector<Minimum> FindMinima(const MinimizationProblem& problem, const Matrix& starts,
                                const MinimizerOptions& options, const Stop& stop) {
  POLYEST_CHECK(starts.rows() > 0 && starts.cols() == problem.lower.size());
  std::vector<Minimum> found(static_cast<size_t>(starts.rows()));
  ParallelFor(static_cast<int>(starts.rows()), problem.threads, [&](int start) {
    if (start > 0 && !stop.Check().ok()) return;
    found[static_cast<size_t>(start)] =
        MinimizeFrom(problem, starts.row(start).transpose(), options, stop);
  });
  // A stop request leaves out starts from which no search had begun.
  std::erase_if(found, [](const Minimum& minimum) { return minimum.evaluations == 0; });
  return DistinctMinima(std::move(found), problem, options);
}

}  // namespace polyest::internal
