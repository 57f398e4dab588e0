#include "tests/properties/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/common/check.h"

namespace polyest::internal::properties {
namespace {

constexpr double kNegligible = 25;   // nats below the best node, at which cells are left out
constexpr double kAgreement = 0.02;  // of the moments, in standard deviations
constexpr int kParts = 3;            // a cell is divided into, along each axis
constexpr int kMaxDivisions = 5;
constexpr size_t kMaxCells = 400'000;
constexpr double kLogSigmaStep = 0.06;
constexpr double kLogSigmaBelow = 1.5, kLogSigmaAbove = 2.5;  // about the true log σ

using Linear = std::array<double, kMaxLinear>;

struct Node {
  std::array<double, 2> c = {};  // coordinates of ν
  double log_weight = -std::numeric_limits<double>::infinity();
  Linear mean = {};    // of β given ν
  Linear square = {};  // of β² given ν
};

// Solves with a symmetric positive definite matrix of p ≤ 4 rows.
class SmallCholesky {
 public:
  SmallCholesky(const double (&a)[kMaxLinear][kMaxLinear], int p) : p_(p) {
    for (int i = 0; i < p; ++i) {
      for (int j = 0; j <= i; ++j) {
        double rest = a[i][j];
        for (int k = 0; k < j; ++k) rest -= l_[i][k] * l_[j][k];
        l_[i][j] = i == j ? std::sqrt(rest) : rest / l_[j][j];
      }
    }
  }
  double LogDeterminant() const {
    double sum = 0;
    for (int i = 0; i < p_; ++i) sum += 2 * std::log(l_[i][i]);
    return sum;
  }
  Linear Solve(Linear b) const {
    for (int i = 0; i < p_; ++i) {
      for (int k = 0; k < i; ++k) b[Index(i)] -= l_[i][k] * b[Index(k)];
      b[Index(i)] /= l_[i][i];
    }
    for (int i = p_ - 1; i >= 0; --i) {
      for (int k = i + 1; k < p_; ++k) b[Index(i)] -= l_[k][i] * b[Index(k)];
      b[Index(i)] /= l_[i][i];
    }
    return b;
  }

 private:
  static size_t Index(int i) { return static_cast<size_t>(i); }
  int p_;
  double l_[kMaxLinear][kMaxLinear] = {};
};

// XᵀX, Xᵀz′ and z′ᵀz′ of whitened samples, z′ = z − g_0.
struct Products {
  double xx[kMaxLinear][kMaxLinear] = {};
  Linear xz = {};
  double zz = 0;
};

class Grid {
 public:
  explicit Grid(const SmallProblem& small)
      : small_(small),
        nonlinear_(static_cast<int>(small.law.nonlinear.size())),
        linear_(static_cast<int>(small.law.linear.size())) {
    const Matrix& covariance = small.linear_covariance;
    double p[kMaxLinear][kMaxLinear] = {};
    for (int i = 0; i < linear_; ++i) {
      for (int j = 0; j < linear_; ++j) p[i][j] = covariance(i, j);
    }
    const SmallCholesky cholesky(p, linear_);
    for (int j = 0; j < linear_; ++j) {
      Linear unit = {};
      unit[static_cast<size_t>(j)] = 1;
      const Linear column = cholesky.Solve(unit);
      for (int i = 0; i < linear_; ++i) precision_[i][j] = column[static_cast<size_t>(i)];
    }
  }

  std::optional<Moments> Run() {
    if (nonlinear_ == 0) {
      std::vector<Node> one(1);
      Evaluate(one[0]);
      return MomentsOf(one, [](const Node&) { return true; });
    }
    std::vector<Node> cells = FirstCells();
    // Every other cell, as on a chessboard, is a grid of its own; two that agree are both right.
    Moments before = MomentsOf(cells, [this](const Node& node) { return IsBlack(node); });
    Moments now = MomentsOf(cells, [](const Node&) { return true; });
    for (int division = 0; !Agree(before, now); ++division) {
      Prune(cells);
      if (division == kMaxDivisions || cells.size() > kMaxCells) return std::nullopt;
      cells = Divide(cells);
      before = std::move(now);
      now = MomentsOf(cells, [](const Node&) { return true; });
    }
    return now;
  }

 private:
  const Density& density(int i) const {
    return small_.law.nonlinear[static_cast<size_t>(i)].density;
  }

  std::vector<Node> FirstCells() {
    const Vector steps = SafeSteps(small_);
    int count[2] = {1, 1};
    for (int i = 0; i < nonlinear_; ++i) {
      const double width = density(i).upper() - density(i).lower();
      count[i] = static_cast<int>(std::max(64.0, std::ceil(width / steps[i])));
      size_[static_cast<size_t>(i)] = width / count[i];
    }
    std::vector<Node> cells(static_cast<size_t>(count[0]) * static_cast<size_t>(count[1]));
    size_t next = 0;
    for (int a = 0; a < count[0]; ++a) {
      for (int b = 0; b < count[1]; ++b) {
        Node& node = cells[next++];
        node.c[0] = density(0).lower() + (a + 0.5) * size_[0];
        if (nonlinear_ > 1) node.c[1] = density(1).lower() + (b + 0.5) * size_[1];
        Evaluate(node);
      }
    }
    return cells;
  }

  bool IsBlack(const Node& node) const {
    double sum = 0;
    for (int i = 0; i < nonlinear_; ++i) {
      const auto k = static_cast<size_t>(i);
      sum += std::floor((node.c[k] - density(i).lower()) / size_[k]);
    }
    return std::fmod(sum, 2) == 0;
  }

  static void Prune(std::vector<Node>& cells) {
    double best = -std::numeric_limits<double>::infinity();
    for (const Node& node : cells) best = std::max(best, node.log_weight);
    std::erase_if(cells, [&](const Node& node) { return node.log_weight < best - kNegligible; });
  }

  std::vector<Node> Divide(const std::vector<Node>& cells) {
    for (double& size : size_) size /= kParts;
    std::vector<Node> divided;
    divided.reserve(cells.size() * (nonlinear_ > 1 ? kParts * kParts : kParts));
    for (const Node& cell : cells) {
      for (int a = -1; a <= 1; ++a) {
        for (int b = nonlinear_ > 1 ? -1 : 0; b <= (nonlinear_ > 1 ? 1 : 0); ++b) {
          Node& node = divided.emplace_back();
          node.c = {cell.c[0] + a * size_[0], cell.c[1] + b * size_[1]};
          Evaluate(node);
        }
      }
    }
    return divided;
  }

  Products ProductsAt(const double* nu) {
    const std::vector<double>& time_s = small_.record.time_s;
    const std::vector<double>& z = small_.record.columns[0].value;
    Products products;
    double row[1 + kMaxLinear], before[1 + kMaxLinear] = {}, u[1 + kMaxLinear];
    for (size_t k = 0; k < z.size(); ++k) {
      small_.law.shapes(nu, time_s[k], row);
      row[0] = z[k] - row[0];
      double a = 0;
      if (k > 0 && small_.time_constant_s > 0) {
        a = std::exp((time_s[k - 1] - time_s[k]) / small_.time_constant_s);
      }
      for (int j = 0; j <= linear_; ++j) {
        u[j] = (row[j] - a * before[j]) / std::sqrt(1 - a * a);
        before[j] = row[j];
      }
      products.zz += u[0] * u[0];
      for (int i = 0; i < linear_; ++i) {
        products.xz[static_cast<size_t>(i)] += u[1 + i] * u[0];
        for (int j = 0; j <= i; ++j) products.xx[i][j] += u[1 + i] * u[1 + j];
      }
    }
    return products;
  }

  // Sets the weight and β's moments of a node whose coordinates are set.
  void Evaluate(Node& node) {
    double nu[2] = {};
    double log_prior = 0;
    for (int i = 0; i < nonlinear_; ++i) {
      nu[i] = density(i).ToParameter(node.c[static_cast<size_t>(i)]);
      log_prior += density(i).LogDensity(node.c[static_cast<size_t>(i)]);
    }
    const Products products = ProductsAt(nu);
    if (!small_.sigma_unknown) {
      AddNormal(products, small_.sigma, log_prior, node);
      return;
    }
    for (double step = -kLogSigmaBelow; step <= kLogSigmaAbove; step += kLogSigmaStep) {
      AddNormal(products, small_.sigma * std::exp(step), log_prior, node);
    }
  }

  // Mixes the normal posterior of β for one σ into the node.
  void AddNormal(const Products& products, double sigma, double log_prior, Node& node) const {
    const double weight = 1 / (sigma * sigma);
    double lambda[kMaxLinear][kMaxLinear] = {};
    Linear h = {};
    double fixed = weight * products.zz;
    for (int i = 0; i < linear_; ++i) {
      h[static_cast<size_t>(i)] = weight * products.xz[static_cast<size_t>(i)];
      for (int j = 0; j < linear_; ++j) {
        const double mean = small_.law.linear[static_cast<size_t>(j)].mean;
        h[static_cast<size_t>(i)] += precision_[i][j] * mean;
        fixed += small_.law.linear[static_cast<size_t>(i)].mean * precision_[i][j] * mean;
        lambda[i][j] = precision_[i][j] + weight * products.xx[std::max(i, j)][std::min(i, j)];
      }
    }
    const SmallCholesky cholesky(lambda, linear_);
    const Linear mean = cholesky.Solve(h);
    double explained = 0;
    for (int i = 0; i < linear_; ++i) {
      explained += h[static_cast<size_t>(i)] * mean[static_cast<size_t>(i)];
    }
    const auto samples = static_cast<double>(small_.record.time_s.size());
    const double log_weight = log_prior - samples * std::log(sigma) - 0.5 * (fixed - explained) -
                              0.5 * cholesky.LogDeterminant();
    if (!std::isfinite(log_weight)) return;
    const double total = std::max(node.log_weight, log_weight) +
                         std::log1p(std::exp(-std::abs(node.log_weight - log_weight)));
    const double share = std::exp(log_weight - total);
    for (size_t i = 0; i < static_cast<size_t>(linear_); ++i) {
      Linear unit = {};
      unit[i] = 1;
      const double square = cholesky.Solve(unit)[i] + mean[i] * mean[i];
      node.mean[i] += share * (mean[i] - node.mean[i]);
      node.square[i] += share * (square - node.square[i]);
    }
    node.log_weight = total;
  }

  template <class Use>
  Moments MomentsOf(const std::vector<Node>& cells, const Use& use) const {
    double best = -std::numeric_limits<double>::infinity();
    for (const Node& node : cells) best = std::max(best, node.log_weight);
    const int n = nonlinear_ + linear_;
    Vector first = Vector::Zero(n), second = Vector::Zero(n);
    double sum = 0;
    for (const Node& node : cells) {
      if (!use(node)) continue;
      const double weight = std::exp(node.log_weight - best);
      sum += weight;
      for (int i = 0; i < nonlinear_; ++i) {
        const double theta = density(i).ToParameter(node.c[static_cast<size_t>(i)]);
        first[i] += weight * theta;
        second[i] += weight * theta * theta;
      }
      for (int j = 0; j < linear_; ++j) {
        first[nonlinear_ + j] += weight * node.mean[static_cast<size_t>(j)];
        second[nonlinear_ + j] += weight * node.square[static_cast<size_t>(j)];
      }
    }
    first /= sum;
    second /= sum;
    return {first, (second - first.cwiseAbs2()).cwiseMax(0).cwiseSqrt()};
  }

  static bool Agree(const Moments& a, const Moments& b) {
    for (Eigen::Index i = 0; i < a.mean.size(); ++i) {
      const double sd = b.std_dev[i];
      if (!(std::abs(a.mean[i] - b.mean[i]) <= kAgreement * sd)) return false;
      if (!(std::abs(a.std_dev[i] - sd) <= kAgreement * sd)) return false;
    }
    return true;
  }

  const SmallProblem& small_;
  int nonlinear_, linear_;
  double precision_[kMaxLinear][kMaxLinear] = {};
  std::array<double, 2> size_ = {};  // of the cells
};

}  // namespace

std::optional<Moments> ExactPosterior(const SmallProblem& problem) { return Grid(problem).Run(); }

}  // namespace polyest::internal::properties
