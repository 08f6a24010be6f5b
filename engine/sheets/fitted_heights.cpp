#include "engine/sheets/fitted_heights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/sheets/sheet_cuts.h"

namespace slabwright {

namespace {

/// Of every sheet which of its even parts hold facets that lean more than the head and are not level.
std::vector<std::array<bool, kCutSections>> steep_parts(MeshView mesh, const std::vector<SheetSpan>& spans,
                                                        double most_tilt_deg) {
    std::vector<std::array<bool, kCutSections>> steep(spans.size());
    if (most_tilt_deg <= 0) return steep;
    const double most = std::sin(most_tilt_deg * std::numbers::pi / 180);
    for (const Index3& f : mesh.facets) {
        const Vec3f &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
        const double low = std::min({a.z, b.z, c.z}), high = std::max({a.z, b.z, c.z});
        if (!(high > low)) continue;
        const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z;
        const double vx = double{c.x} - a.x, vy = double{c.y} - a.y, vz = double{c.z} - a.z;
        const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
        if (std::abs(nz) <= most * std::hypot(nx, ny, nz)) continue;
        auto span = std::upper_bound(spans.begin(), spans.end(), low,
                                     [](double z, const SheetSpan& s) { return z < s.top; });
        for (; span != spans.end() && span->bottom < high; ++span) {
            const double part = (span->top - span->bottom) / kCutSections;
            const int first = std::clamp(int((low - span->bottom) / part), 0, kCutSections - 1),
                      last = std::clamp(int((high - span->bottom) / part), 0, kCutSections - 1);
            auto& own = steep[static_cast<std::size_t>(span - spans.begin())];
            for (int k = first; k <= last; ++k) own[static_cast<std::size_t>(k)] = true;
        }
    }
    return steep;
}

}  // namespace

std::vector<std::vector<double>> heights_to_fit(MeshView mesh, const std::vector<SheetSpan>& spans,
                                                double most_tilt_deg) {
    constexpr double same = 1e-3;
    std::vector<std::vector<double>> heights(spans.size());
    std::vector<std::vector<double>> kinks(spans.size());
    for (const Vec3f& v : mesh.vertices) {
        const auto above = std::upper_bound(spans.begin(), spans.end(), double{v.z},
                                            [](double z, const SheetSpan& span) { return z < span.bottom; });
        if (above == spans.begin()) continue;
        const auto i = static_cast<std::size_t>(above - spans.begin()) - 1;
        if (v.z > spans[i].top || kinks[i].size() > kMostVertexHeights) continue;
        const auto at = std::lower_bound(kinks[i].begin(), kinks[i].end(), v.z - same);
        if (at == kinks[i].end() || *at > v.z + same) kinks[i].insert(at, v.z);
    }
    // Level facets: there sections change at once.
    std::vector<std::vector<double>> steps(spans.size());
    for (const Index3& f : mesh.facets) {
        const double z = mesh.vertices[f[0]].z;
        if (std::abs(mesh.vertices[f[1]].z - z) > same || std::abs(mesh.vertices[f[2]].z - z) > same)
            continue;
        const auto above = std::upper_bound(spans.begin(), spans.end(), z,
                                            [](double h, const SheetSpan& span) { return h < span.bottom; });
        if (above == spans.begin()) continue;
        std::vector<double>& own = steps[static_cast<std::size_t>(above - spans.begin()) - 1];
        const auto at = std::lower_bound(own.begin(), own.end(), z - same);
        if ((at == own.end() || *at > z + same) && own.size() < kMostSteps) own.insert(at, z);
    }
    const std::vector<std::array<bool, kCutSections>> steep = steep_parts(mesh, spans, most_tilt_deg);
    for (std::size_t i = 0; i < spans.size(); ++i) {
        const double thickness = spans[i].top - spans[i].bottom;
        for (int k = 0; k <= kCutSections; ++k) {
            heights[i].push_back(spans[i].bottom + k * thickness / kCutSections);
            if (k == kCutSections || !steep[i][static_cast<std::size_t>(k)]) continue;
            for (int part = 1; part < kFinerSections; ++part)
                heights[i].push_back(spans[i].bottom +
                                     (k + double(part) / kFinerSections) * thickness / kCutSections);
        }
        // At a step the section just below it counts as well as the one just above.
        for (const double z : steps[i])
            for (const double h : {z - same, z})
                if (h > spans[i].bottom && h < spans[i].top &&
                    std::none_of(heights[i].begin(), heights[i].end(),
                                 [&](double other) { return std::abs(other - h) < same / 4; }))
                    heights[i].push_back(h);
        std::sort(heights[i].begin(), heights[i].end());
        if (kinks[i].size() > kMostVertexHeights) continue;
        for (const double z : kinks[i])
            if (std::none_of(heights[i].begin(), heights[i].end(),
                             [&](double h) { return std::abs(h - z) < same; }))
                heights[i].push_back(z);
        std::sort(heights[i].begin(), heights[i].end());
    }
    return heights;
}

}  // namespace slabwright
