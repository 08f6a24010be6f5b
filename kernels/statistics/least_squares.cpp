#include "kernels/statistics/least_squares.h"

#include <Eigen/QR>

#include "kernels/errors.h"

namespace slabwright {

LeastSquares least_squares(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
    const Eigen::Index n = x.rows(), columns = x.cols();
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(x);
    if (n < columns || qr.rank() < columns)
        throw Error(ErrorKind::usage, "statistics.rank",
                    "the observations do not tell the terms of the model apart");
    LeastSquares fit;
    fit.coefficients = qr.solve(y);
    fit.residuals = y - x * fit.coefficients;
    fit.residual_ss = fit.residuals.squaredNorm();
    // X P = Q R, so (XᵀX)⁻¹ = P R⁻¹ R⁻ᵀ Pᵀ.
    const Eigen::MatrixXd inverse = qr.matrixR().topRows(columns).triangularView<Eigen::Upper>().solve(
        Eigen::MatrixXd::Identity(columns, columns));
    const Eigen::MatrixXd root = qr.colsPermutation() * inverse;
    fit.unscaled_covariance = root * root.transpose();
    fit.leverages = (x * root).rowwise().squaredNorm();
    return fit;
}

}  // namespace slabwright
