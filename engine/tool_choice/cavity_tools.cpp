#include "engine/tool_choice/cavity_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/catalogue.h"
#include "kernels/forces/deflection.h"

namespace slabwright {

namespace {

constexpr double kLeastLeft = 1;    // mm²: less is not worth a tool
constexpr double kMostLeft = 0.05;  // of what the library leaves, that a named tool may leave
constexpr double kHalf = 0.5;
constexpr double kSameLength = 1e-6;  // mm

double step_of(const Job& job, double diameter, double stickout, double modulus_mpa) {
    const double edges = std::hypot(job.material.kte, job.material.kfe);  // N for each mm of depth
    const double bends = cutter_deflection(edges, stickout, diameter, modulus_mpa);
    return bends > 0 ? std::min(diameter / 2, job.tolerances.cusp / bends) : diameter / 2;
}

CavityTool of_library(const Job& job, const NarrowCavity& cavity, const Tool& tool) {
    CavityTool found{tool.number, tool.name, tool.diameter, tool.flute_length, tool.stickout};
    found.left_mm2 = cavity.area_under(tool.diameter);
    found.step_mm = step_of(job, tool.diameter, tool.stickout, 1e3 * tool.modulus_gpa);
    return found;
}

CavityTool of_catalogue(const Job& job, const NarrowCavity& cavity, const CatalogueSize& size,
                        double flutes) {
    CavityTool found{0, fmt::format("flat end mill {} x {:g} mm", size.words, flutes), size.diameter_mm,
                     flutes, flutes + kCatalogueGrip};
    found.left_mm2 = cavity.area_under(size.diameter_mm);
    found.step_mm = step_of(job, size.diameter_mm, found.stickout_mm, kSteelMpa);
    return found;
}

/// The widest of those that leave least; with the ones that are too short where `long_enough` is false.
const Tool* best_of(const Job& job, const CavityAdvice& advice, bool long_enough) {
    const Tool* best = nullptr;
    double best_left = 0;
    for (const Tool& tool : job.tools) {
        if (!is_end_mill(tool.kind)) continue;
        if (long_enough && max_layer_of(job, tool) < advice.reach_mm - kSameLength) continue;
        const double left = advice.cavity.area_under(tool.diameter);
        if (best == nullptr || left < best_left || (left == best_left && tool.diameter > best->diameter)) {
            best = &tool;
            best_left = left;
        }
    }
    return best;
}

/// A boundary up to which a tool of this length reaches from the floor, if that lies within the cavity.
std::optional<double> boundary_for(const CavityAdvice& advice, double length) {
    for (const CavityInLayer& in : advice.cavity.layers)
        if (in.layer == advice.layer && length > 0 && in.low_mm + length < in.layer_top_mm - kSameLength)
            return in.low_mm + length;
    return {};
}

/// The thickest size that leaves at most a twentieth of what the library leaves; where there is none, the one
/// from which on thinner ones gain little.
template <class Fits>
const CatalogueSize* thickest(const std::vector<CatalogueSize>& sizes, const NarrowCavity& cavity,
                              double left, Fits&& fits) {
    const CatalogueSize* chosen = nullptr;
    for (const CatalogueSize& size : sizes) {
        const double leaves = cavity.area_under(size.diameter_mm);
        if (left - leaves < kLeastLeft || !fits(size)) continue;
        if (chosen == nullptr || leaves < (1 - kMostLeft) * cavity.area_under(chosen->diameter_mm))
            chosen = &size;
        if (leaves <= kMostLeft * left) break;
    }
    return chosen;
}

void name_missing(const Job& job, CavityAdvice& advice, double left) {
    const NarrowCavity& cavity = advice.cavity;
    const std::vector<CatalogueSize> sizes = catalogue_sizes(job.units == LengthUnit::inch);
    const double needed = advice.reach_mm + job.cutting.holder_clearance;
    const auto flutes = [&](const CatalogueSize& size) { return catalogue_flutes(size.diameter_mm, needed); };
    const CatalogueSize* any = thickest(sizes, cavity, left, [](const CatalogueSize&) { return true; });
    if (any == nullptr) return;
    // A tool that can be had is worth more than a boundary, if it does at least half.
    const CatalogueSize* long_enough =
        thickest(sizes, cavity, left, [&](const CatalogueSize& size) { return flutes(size).has_value(); });
    if (long_enough != nullptr &&
        (flutes(*any) || cavity.area_under(long_enough->diameter_mm) <= kHalf * left)) {
        advice.missing = of_catalogue(job, cavity, *long_enough, *flutes(*long_enough));
        return;
    }
    const double longest = longest_catalogue_flutes(any->diameter_mm);
    advice.boundary_mm = boundary_for(advice, longest - job.cutting.holder_clearance);
    if (advice.boundary_mm) advice.missing = of_catalogue(job, cavity, *any, longest);
}

CavityAdvice advise(const Job& job, const NarrowCavity& cavity) {
    CavityAdvice advice;
    advice.cavity = cavity;
    for (const CavityInLayer& in : cavity.layers)
        if (in.reach_mm() > advice.reach_mm) {
            advice.reach_mm = in.reach_mm();
            advice.layer = in.layer;
        }
    advice.stickout_mm = advice.reach_mm + job.cutting.holder_clearance;
    double left = cavity.area_mm2();
    if (const Tool* tool = best_of(job, advice, true)) {
        const CavityTool best = of_library(job, cavity, *tool);
        if (best.left_mm2 < left) advice.tool = best;
        left = best.left_mm2;
    }
    // A tool of one's own that is only too short wants a boundary, not a purchase.
    const Tool* narrow = best_of(job, advice, false);
    if (narrow != nullptr && left - cavity.area_under(narrow->diameter) >= kLeastLeft)
        advice.boundary_mm = boundary_for(advice, max_layer_of(job, *narrow));
    if (left >= kLeastLeft && !advice.boundary_mm) name_missing(job, advice, left);
    return advice;
}

}  // namespace

std::vector<CavityAdvice> advise_on_cavities(const Job& job, std::span<const NarrowCavity> cavities) {
    std::vector<CavityAdvice> advice;
    for (const NarrowCavity& cavity : cavities) advice.push_back(advise(job, cavity));
    return advice;
}

}  // namespace slabwright
