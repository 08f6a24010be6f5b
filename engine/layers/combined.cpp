#include "engine/layers/combined.h"

#include <algorithm>
#include <cmath>

#include "engine/layers/rules.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

void check_map(std::span<const ToolSlice> slices, std::span<const double> allowed) {
    const auto fail = [](const char* what) {
        throw Error(ErrorKind::usage, "layers.tools", what, {}, "give one map from bottom to top");
    };
    for (std::size_t i = 0; i < slices.size(); ++i) {
        const ToolSlice& s = slices[i];
        if (!(s.z_high > s.z_low) || (i > 0 && s.z_low != slices[i - 1].z_high))
            fail("the slices of a tool map do not follow each other");
        if (s.tool >= allowed.size() || !(allowed[s.tool] > 0))
            fail("a tool of the map has no allowed length");
    }
}

double height_of(const ToolSlice& s) { return s.z_high - s.z_low; }

void join_equal(std::vector<ToolSlice>& runs) {
    std::vector<ToolSlice> joined;
    for (const ToolSlice& s : runs)
        if (!joined.empty() && joined.back().tool == s.tool) joined.back().z_high = s.z_high;
        else joined.push_back(s);
    runs = std::move(joined);
}

}  // namespace

std::vector<ToolSlice> join_slices(std::span<const ToolSlice> slices, std::span<const double> allowed,
                                   double least) {
    check_map(slices, allowed);
    std::vector<ToolSlice> runs(slices.begin(), slices.end());
    join_equal(runs);
    // The thinnest first, the lowest of equals, until none is too thin or one is left.
    while (runs.size() > 1) {
        const auto thinnest = std::min_element(
            runs.begin(), runs.end(),
            [](const ToolSlice& a, const ToolSlice& b) { return height_of(a) < height_of(b) - 1e-9; });
        if (height_of(*thinnest) >= least - kSameHeight) break;
        const auto i = static_cast<std::size_t>(thinnest - runs.begin());
        std::size_t to = i == 0 ? 1 : i - 1;
        if (i > 0 && i + 1 < runs.size()) {
            const auto apart = [&](std::size_t k) {
                return runs[k].tool > runs[i].tool ? runs[k].tool - runs[i].tool
                                                   : runs[i].tool - runs[k].tool;
            };
            if (apart(i + 1) < apart(i - 1) ||
                (apart(i + 1) == apart(i - 1) && height_of(runs[i + 1]) > height_of(runs[i - 1])))
                to = i + 1;
        }
        ToolSlice& both = runs[std::min(i, to)];
        both = {runs[std::min(i, to)].z_low, runs[std::max(i, to)].z_high,
                std::min(runs[i].tool, runs[to].tool)};
        runs.erase(runs.begin() + static_cast<std::ptrdiff_t>(std::max(i, to)));
        join_equal(runs);
    }
    std::vector<ToolSlice> layers;
    for (const ToolSlice& run : runs) {
        const auto count = static_cast<std::size_t>(
            std::max(1.0, std::ceil((height_of(run) - kSameHeight) / allowed[run.tool])));
        for (std::size_t k = 0; k < count; ++k) {
            const double step = height_of(run) / static_cast<double>(count);
            layers.push_back({k == 0 ? run.z_low : layers.back().z_high,
                              k + 1 == count ? run.z_high : run.z_low + step * static_cast<double>(k + 1),
                              run.tool});
        }
    }
    return layers;
}

LayerPlacement placement_of(const LayerRequest& request, const std::vector<double>& tops) {
    const LayerRules rules(request);
    LayerPlacement placement;
    Ticks below = 0;
    for (const double top : tops) {
        const Ticks z = to_ticks(top);
        placement.boundaries.push_back({top, 0, rules.describe(below, z)});
        below = z;
    }
    finish_placement(rules, placement);
    return placement;
}

LayerPlacement place_layers_by_tools(const LayerRequest& request, std::span<const ToolSlice> layers,
                                     std::span<const double> allowed) {
    check_map(layers, allowed);
    if (layers.empty() || std::abs(layers.front().z_low) > kSameHeight ||
        std::abs(layers.back().z_high - request.height) > kSameHeight)
        throw Error(ErrorKind::usage, "layers.tools",
                    "the tool map does not reach from the pattern's bottom to its top");
    std::vector<double> tops;
    for (std::size_t i = 0; i < layers.size(); ++i) {
        const double low = i == 0 ? 0 : layers[i].z_low,
                     high = i + 1 == layers.size() ? request.height : layers[i].z_high;
        LayerRequest part = request;
        part.height = high - low;
        part.max_layer = std::min(request.max_layer, allowed[layers[i].tool]);
        part.features.clear();
        for (Feature f : request.features) {
            f.z_low -= low, f.z_high -= low;
            // What lies above this stretch still wants its material over the boundaries in it.
            if (f.z_high > 0) part.features.push_back(std::move(f));
        }
        if (request.min_material_at)
            part.min_material_at = [&request, low](double z) { return request.min_material_at(z + low); };
        if (request.section_area)
            part.section_area = [&request, low](double z) { return request.section_area(z + low); };
        for (const Boundary& b : place_layers_optimal(part).boundaries) tops.push_back(b.z + low);
        tops.back() = high;
    }
    return placement_of(request, tops);
}

}  // namespace slabwright
