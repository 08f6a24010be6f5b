#include "kernels/features/alpha_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kSlopes = 901;  // tenths of a degree, 0 … 90
constexpr double kLevel = 0.999999;   // upward part of a normal: above it a facet counts as level
constexpr std::size_t kWords = (kSlopes + 63) / 64;
constexpr std::size_t kGrain = std::size_t{1} << 15;

/// Which slopes occur, by bin.
using Seen = std::vector<std::array<std::uint64_t, kWords>>;

struct Part {
    Seen seen;
    double area = 0, vertical_area = 0, least = std::numbers::pi / 2, least_steep = std::numbers::pi / 2;
};

using P3 = std::array<double, 3>;

// What of a triangle lies between two heights.
double area_between(const std::array<P3, 3>& t, double area, double low, double high) {
    const double z0 = std::min({t[0][2], t[1][2], t[2][2]}), z1 = std::max({t[0][2], t[1][2], t[2][2]});
    if (z0 >= low && z1 <= high) return area;
    // The share below a height is quadratic on either side of the middle corner.
    const double middle = t[0][2] + t[1][2] + t[2][2] - z0 - z1;
    auto below = [&](double z) {
        if (z <= z0) return 0.0;
        if (z >= z1) return 1.0;
        if (z <= middle) return (z - z0) * (z - z0) / ((z1 - z0) * (middle - z0));
        return 1 - (z1 - z) * (z1 - z) / ((z1 - z0) * (z1 - middle));
    };
    return area * std::max(0.0, below(high) - below(low));
}

}  // namespace

double AlphaMap::least(double z0, double z1, double at_least) const {
    double least = std::numbers::pi / 2;
    if (slopes.empty()) return least;
    auto bin = [&](double z) {
        return std::clamp<long>(static_cast<long>((z - z_low) / step), 0,
                                static_cast<long>(slopes.size()) - 1);
    };
    for (long b = bin(z0); b <= bin(z1); ++b) {
        const auto& s = slopes[static_cast<std::size_t>(b)];
        const auto it = std::lower_bound(s.begin(), s.end(), at_least);
        if (it != s.end()) least = std::min(least, *it);
    }
    return least;
}

std::vector<AlphaMap::Band> AlphaMap::bands(double at_least, double same_rad, double least_height) const {
    constexpr double rounding = 1e-9;
    std::vector<Band> found;
    double least = 0, most = 0;  // of the band that grows
    for (std::size_t b = 0; b < slopes.size(); ++b) {
        const auto it = std::lower_bound(slopes[b].begin(), slopes[b].end(), at_least);
        const double alpha = it != slopes[b].end() ? *it : std::numbers::pi / 2;
        const double low = z_low + static_cast<double>(b) * step, high = std::min(z_high, low + step);
        if (!(low < high)) continue;
        if (!found.empty() && std::max(most, alpha) - std::min(least, alpha) <= same_rad + rounding) {
            least = std::min(least, alpha);
            most = std::max(most, alpha);
            found.back().z_high = high;
            found.back().alpha = least;
        } else {
            found.push_back({low, high, alpha});
            least = most = alpha;
        }
    }
    // The lowest band joins the neighbour that is nearer in α, until all are high enough.
    while (found.size() > 1) {
        std::size_t lowest = 0;
        for (std::size_t i = 1; i < found.size(); ++i)
            if (found[i].z_high - found[i].z_low < found[lowest].z_high - found[lowest].z_low) lowest = i;
        if (found[lowest].z_high - found[lowest].z_low >= least_height - rounding) break;
        auto gap = [&](std::size_t i) { return std::abs(found[i].alpha - found[lowest].alpha); };
        const bool up = lowest == 0 || (lowest + 1 < found.size() && gap(lowest + 1) < gap(lowest - 1));
        const std::size_t keep = up ? lowest : lowest - 1;
        found[keep].z_high = found[keep + 1].z_high;
        found[keep].alpha = std::min(found[keep].alpha, found[keep + 1].alpha);
        found.erase(found.begin() + static_cast<std::ptrdiff_t>(keep) + 1);
    }
    return found;
}

AlphaMap alpha_map(Context& context, MeshView mesh, double z_low, double z_high,
                   const AlphaOptions& options) {
    if (!(z_low < z_high) || !std::isfinite(z_low) || !std::isfinite(z_high) || !(options.step > 0))
        throw Error(ErrorKind::usage, "alpha_map.range",
                    "the heights of an alpha map do not ascend, or its step is not over 0");
    AlphaMap map;
    map.z_low = z_low;
    map.z_high = z_high;
    map.step = options.step;
    const std::size_t bins = static_cast<std::size_t>((z_high - z_low) / options.step) + 1;
    const double top = z_high - options.cut_off;
    auto bin = [&](double z) {
        return static_cast<std::size_t>(
            std::clamp<long>(static_cast<long>((z - z_low) / options.step), 0, static_cast<long>(bins) - 1));
    };
    Part sum = parallel_reduce(
        context, mesh.size(), kGrain, Part{},
        [&](std::size_t begin, std::size_t end) {
            Part part;
            part.seen.resize(bins);
            for (std::size_t f = begin; f < end; ++f) {
                std::array<P3, 3> t;
                for (int k = 0; k < 3; ++k) {
                    const Vec3f& v = mesh.vertices[mesh.facets[f][k]];
                    t[k] = {v.x, v.y, v.z};
                }
                const auto [low, high] = std::minmax({t[0][2], t[1][2], t[2][2]});
                if (low >= top || high < z_low) continue;
                const double ux = t[1][0] - t[0][0], uy = t[1][1] - t[0][1], uz = t[1][2] - t[0][2];
                const double vx = t[2][0] - t[0][0], vy = t[2][1] - t[0][1], vz = t[2][2] - t[0][2];
                const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
                const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
                const double scale = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz;
                if (!(length > 1e-12 * scale)) continue;
                const double up = nz / length;
                if (up < 0 || up > kLevel || (nx == 0 && ny == 0)) continue;
                const double alpha = std::acos(std::min(1.0, up));
                const std::size_t slope =
                    std::min(kSlopes - 1, static_cast<std::size_t>(alpha / AlphaMap::kTenth));
                for (std::size_t b = bin(low); b <= bin(std::min(high, top)); ++b)
                    part.seen[b][slope / 64] |= std::uint64_t{1} << slope % 64;
                const double area = area_between(t, length / 2, z_low, top);
                if (!(area > 0)) continue;
                part.area += area;
                if (alpha >= options.upright) part.vertical_area += area;
                part.least = std::min(part.least, alpha);
                if (alpha >= options.steep) part.least_steep = std::min(part.least_steep, alpha);
            }
            return part;
        },
        [](Part a, Part b) {
            if (a.seen.empty()) a.seen.swap(b.seen);
            for (std::size_t i = 0; i < b.seen.size(); ++i)
                for (std::size_t w = 0; w < kWords; ++w) a.seen[i][w] |= b.seen[i][w];
            a.area += b.area;
            a.vertical_area += b.vertical_area;
            a.least = std::min(a.least, b.least);
            a.least_steep = std::min(a.least_steep, b.least_steep);
            return a;
        });
    map.area = sum.area;
    map.vertical_area = sum.vertical_area;
    map.least_slope = sum.least;
    map.least_steep = sum.least_steep;
    map.slopes.resize(bins);
    for (std::size_t b = 0; b < sum.seen.size(); ++b)
        for (std::size_t s = 0; s < kSlopes; ++s)
            if ((sum.seen[b][s / 64] >> s % 64 & 1) != 0)
                map.slopes[b].push_back(static_cast<double>(s) * AlphaMap::kTenth);
    return map;
}

}  // namespace slabwright
