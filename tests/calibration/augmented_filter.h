#pragma once

// The usual way to estimate parameters of an imperfect model: one cubature Kalman filter whose
// states are those of the model and its parameters (Arasaratnam and Haykin, IEEE Transactions on
// Automatic Control 54 (2009) 1254–1269). It is told the process noise.

#include <Eigen/Dense>
#include <cmath>
#include <functional>

namespace polyest::internal::calibration {

class AugmentedFilter {
 public:
  // Returns the derivatives of all states.
  using Dynamics = std::function<Eigen::VectorXd(double time_s, const Eigen::VectorXd& states)>;

  // `spectral_densities`: of the states' process noise.
  AugmentedFilter(Dynamics dynamics, Eigen::VectorXd mean, Eigen::MatrixXd covariance,
                  Eigen::VectorXd spectral_densities)
      : dynamics_(std::move(dynamics)),
        mean_(std::move(mean)),
        covariance_(std::move(covariance)),
        spectral_densities_(std::move(spectral_densities)) {}

  // Takes a sample of the first state at `time_s`, with noise of standard deviation sigma.
  void Take(double time_s, double z, double sigma) {
    const double step_s = time_s - time_s_;
    Diffuse(step_s / 6);
    Move(step_s / 2);
    Diffuse(4 * step_s / 6);
    Move(step_s / 2);
    Diffuse(step_s / 6);
    const double S = covariance_(0, 0) + sigma * sigma;
    const Eigen::VectorXd gain = covariance_.col(0) / S;
    mean_ += gain * (z - mean_[0]);
    covariance_ -= S * gain * gain.transpose();
  }

  double mean(Eigen::Index state) const { return mean_[state]; }
  double deviation(Eigen::Index state) const { return std::sqrt(covariance_(state, state)); }

 private:
  void Diffuse(double duration_s) { covariance_.diagonal() += duration_s * spectral_densities_; }

  void Move(double duration_s) {
    const Eigen::Index n = mean_.size();
    const Eigen::MatrixXd root =
        std::sqrt(static_cast<double>(n)) * Eigen::MatrixXd(covariance_.llt().matrixL());
    Eigen::MatrixXd points(n, 2 * n);
    for (Eigen::Index j = 0; j < n; ++j) {
      points.col(j) = Moved(mean_ + root.col(j), duration_s);
      points.col(n + j) = Moved(mean_ - root.col(j), duration_s);
    }
    mean_ = points.rowwise().mean();
    points.colwise() -= mean_;
    covariance_ = points * points.transpose() / static_cast<double>(2 * n);
    time_s_ += duration_s;
  }

  // Two steps of the classical Runge–Kutta method.
  Eigen::VectorXd Moved(Eigen::VectorXd x, double duration_s) const {
    constexpr int kSteps = 2;
    const double h = duration_s / kSteps;
    for (int step = 0; step < kSteps; ++step) {
      const double t = time_s_ + step * h;
      const Eigen::VectorXd a = dynamics_(t, x), b = dynamics_(t + h / 2, x + h / 2 * a),
                            c = dynamics_(t + h / 2, x + h / 2 * b),
                            d = dynamics_(t + h, x + h * c);
      x += h / 6 * (a + 2 * b + 2 * c + d);
    }
    return x;
  }

  Dynamics dynamics_;
  Eigen::VectorXd mean_;
  Eigen::MatrixXd covariance_;
  Eigen::VectorXd spectral_densities_;
  double time_s_ = 0;
};

}  // namespace polyest::internal::calibration
