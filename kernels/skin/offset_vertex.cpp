// The working set holds the planes that bind, three at most. The plane that is violated most comes in, the
// program is solved on these four by trying all their subsets, and what does not bind goes out. |V| grows
// with every step, so no set comes twice.
#include "kernels/skin/offset_vertex.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace slabwright {

namespace {

constexpr double kMet = 1e-9;        // by which N·V may fall short of its plane's move
constexpr double kSingular = 1e-12;  // determinant of normals that lie in one line or plane
constexpr double kFarthest = 1e6;    // |V| in skins: longer is none
constexpr int kMostSteps = 1000;

/// V of least length with N·V = move on all planes of a set, and whether every plane pushes (multiplier ≥ 0).
std::optional<Vec3d> binding(std::span<const OffsetPlane> set) {
    const std::size_t n = set.size();
    std::array<std::array<double, 4>, 3> m{};  // Gram matrix and right side
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) m[i][j] = dot(set[i].normal, set[j].normal);
        m[i][3] = set[i].move;
    }
    for (std::size_t i = 0; i < n; ++i) {  // Gauss and Jordan, with pivots
        std::size_t pivot = i;
        for (std::size_t r = i + 1; r < n; ++r)
            if (std::abs(m[r][i]) > std::abs(m[pivot][i])) pivot = r;
        if (std::abs(m[pivot][i]) < kSingular) return std::nullopt;
        std::swap(m[i], m[pivot]);
        for (std::size_t r = 0; r < n; ++r) {
            if (r == i) continue;
            const double share = m[r][i] / m[i][i];
            for (std::size_t c = i; c < 4; ++c) m[r][c] -= share * m[i][c];
        }
    }
    Vec3d v{};
    for (std::size_t i = 0; i < n; ++i) {
        const double push = m[i][3] / m[i][i];
        if (push < -kMet) return std::nullopt;
        v = plus(v, set[i].normal, push);
    }
    return v;
}

bool meets(const Vec3d& v, std::span<const OffsetPlane> planes) {
    const double scale = 1 + length(v);
    return std::all_of(planes.begin(), planes.end(),
                       [&](const OffsetPlane& p) { return dot(p.normal, v) >= p.move - kMet * scale; });
}

/// Solves on four planes at most; leaves in the set those that bind.
std::optional<Vec3d> solve(std::vector<OffsetPlane>& set) {
    for (std::uint32_t size = 0; size <= 3; ++size)
        for (std::uint32_t mask = 0; mask < (1u << set.size()); ++mask) {
            std::vector<OffsetPlane> part;
            for (std::size_t i = 0; i < set.size(); ++i)
                if ((mask >> i & 1u) != 0) part.push_back(set[i]);
            if (part.size() != size) continue;
            const std::optional<Vec3d> v = binding(part);
            if (!v || !meets(*v, set)) continue;
            set = std::move(part);
            return v;
        }
    return std::nullopt;
}

}  // namespace

std::optional<Vec3d> offset_vertex(std::span<const OffsetPlane> planes) {
    std::vector<OffsetPlane> set;
    Vec3d v{};
    for (int step = 0; step < kMostSteps; ++step) {
        const OffsetPlane* worst = nullptr;
        double least = -kMet * (1 + length(v));
        for (const OffsetPlane& p : planes)
            if (const double over = dot(p.normal, v) - p.move; over < least) least = over, worst = &p;
        if (worst == nullptr) return v;
        set.push_back(*worst);
        const std::optional<Vec3d> next = solve(set);
        if (!next || length(*next) > kFarthest) return std::nullopt;
        v = *next;
    }
    return std::nullopt;
}

}  // namespace slabwright
