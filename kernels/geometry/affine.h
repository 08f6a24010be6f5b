// How a model is placed: turned, scaled, mirrored and shifted at once, as three rows of four numbers.
#pragma once

#include <array>
#include <cstddef>

#include "kernels/geometry/vectors.h"

namespace slabwright {

/// Maps p to A·p + t. Its rows are those of A, each with its t, in mm. Rounds in the order in which it is
/// written.
struct AffineMap {
    std::array<std::array<double, 4>, 3> rows{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

    friend bool operator==(const AffineMap&, const AffineMap&) = default;
    [[nodiscard]] bool is_identity() const { return *this == AffineMap{}; }
    [[nodiscard]] Point3 of(const Point3& p) const {
        Point3 q{};
        for (std::size_t r = 0; r < 3; ++r)
            q[r] = rows[r][0] * p[0] + rows[r][1] * p[1] + rows[r][2] * p[2] + rows[r][3];
        return q;
    }
    /// The map that does `first`, then this one.
    [[nodiscard]] AffineMap after(const AffineMap& first) const {
        AffineMap both;
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 4; ++c) {
                both.rows[r][c] = c == 3 ? rows[r][3] : 0;
                for (std::size_t k = 0; k < 3; ++k) both.rows[r][c] += rows[r][k] * first.rows[k][c];
            }
        return both;
    }
    /// By how much it makes volumes larger; negative where it turns a solid inside out.
    [[nodiscard]] double determinant() const {
        const auto column = [&](std::size_t c) { return Vec3d{rows[0][c], rows[1][c], rows[2][c]}; };
        return dot(column(0), cross(column(1), column(2)));
    }
    /// Whether a facet must be turned over to face outwards again.
    [[nodiscard]] bool mirrors() const { return determinant() < 0; }
};

}  // namespace slabwright
