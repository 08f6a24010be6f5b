// Linear least squares.
#pragma once

#include <Eigen/Core>

namespace slabwright {

/// y ≈ X·b with the least sum of squared residuals.
struct LeastSquares {
    Eigen::VectorXd coefficients;
    Eigen::MatrixXd unscaled_covariance;  ///< (XᵀX)⁻¹; times the variance of y, the coefficients' covariance
    Eigen::VectorXd residuals;
    Eigen::VectorXd leverages;  ///< diagonal of X (XᵀX)⁻¹ Xᵀ
    double residual_ss = 0;     ///< sum of squared residuals
};

/// @param x one row an observation, columns independent; no fewer rows than columns
/// @throws Error(usage, "statistics.rank") where columns depend on each other or rows are too few
[[nodiscard]] LeastSquares least_squares(const Eigen::MatrixXd& x, const Eigen::VectorXd& y);

}  // namespace slabwright
