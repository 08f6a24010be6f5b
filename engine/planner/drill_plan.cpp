#include "engine/planner/drill_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "engine/base_board.h"
#include "engine/paths/operations/drilling.h"
#include "engine/prepare/drilled_holes.h"
#include "kernels/features/holes.h"
#include "kernels/features/rounded_holes.h"
#include "kernels/mesh/weld.h"

namespace slabwright {

namespace {

constexpr double kUpright = 0.99999848;  // cosine of .1°
constexpr double kSame = 1e-3;           // mm: heights nearer than this are one
constexpr double kGougeShare = 0.5;      // of the tolerance, for chords; roundings and the axis take the rest
constexpr double kCuspShare = 0.9;
constexpr double kHelixShare = 0.2;  // of the cusp, of which the chords of a helix take .15 (drill_holes)

double point_length(const Tool& drill) {
    return drill.diameter / 2 / std::tan(cutter_shape(drill).taper_rad);
}

class Driller {
public:
    Driller(Context& context, MeshView pattern, const Plan& plan)
        : context_(context), mesh_(pattern), plan_(plan) {
        result_.layers.resize(plan.layers.size());
    }

    DrillPlan run() {
        std::vector<std::uint8_t> gone(mesh_.size(), 0);
        std::vector<std::vector<std::uint32_t>> rims;
        for (const RoundHole& found : find_holes(context_, mesh_)) {
            const RoundHole hole = narrowest_part(found).value_or(found);
            const Tool* const drill = nearest(hole);
            if (drill == nullptr && !plan_.job.cutting.bore_holes) continue;
            const std::vector<std::vector<std::uint32_t>> around = rims_of(mesh_, hole);
            const std::string reason = drill != nullptr ? why_not(hole, *drill, around) : "no drill is there";
            if (reason.empty()) {
                drill_layers(hole, *drill);
            } else if (!bored(hole, around)) {
                if (drill != nullptr) tell(hole, reason);
                continue;
            }
            for (const std::uint32_t f : hole.facets) gone[f] = 1;
            rims.insert(rims.end(), around.begin(), around.end());
        }
        tell_bored();
        if (!rims.empty()) result_.closed = without(gone, rims);
        return std::move(result_);
    }

private:
    // The drill that is nearest to a hole in diameter, if it was meant for it.
    [[nodiscard]] const Tool* nearest(const RoundHole& hole) const {
        const Tool* best = nullptr;
        const auto off = [&](const Tool& t) { return std::abs(t.diameter - hole.diameter_mm); };
        for (const Tool& tool : plan_.job.tools)
            if (tool.kind == ToolKind::drill && off(tool) <= kMeantFor && (!best || off(tool) < off(*best)))
                best = &tool;
        return best;
    }

    // Why a hole is milled, in words; "" where it can be drilled.
    [[nodiscard]] std::string why_not(const RoundHole& hole, const Tool& drill,
                                      const std::vector<std::vector<std::uint32_t>>& rims) const {
        if (std::abs(hole.into[2]) < kUpright)
            return fmt::format("it is tilted (axis {:.4f} {:.4f} {:.4f})", hole.into[0], hole.into[1],
                               hole.into[2]);
        if (hole.kind != HoleKind::plain || hole.into[2] > 0)
            return fmt::format("it is {}", hole.into[2] > 0 ? "open below only" : name(hole.kind));
        const bool is_open = hole.bottom == HoleBottom::open;
        if (!is_open && hole.bottom != HoleBottom::cone)
            return hole.bottom == HoleBottom::flat ? "its bottom is flat" : "its bottom is not a drill's";
        if (rims.size() != (is_open ? 2 : 1) ||
            !std::all_of(rims.begin(), rims.end(), [&](const auto& rim) { return is_level(mesh_, rim); }))
            return "its mouth is not level, or another hole opens into it";
        const double radius = hole.diameter_mm / 2, reach = drill.diameter / 2;
        const Tolerances& t = plan_.job.tolerances;
        if (reach > radius + kGougeShare * t.gouge)
            return fmt::format("the drill of {:.4g} mm is too thick by more than half of tolerances.gouge",
                               drill.diameter);
        if (reach > radius - hole.chord_mm + kGougeShare * t.gouge)
            return fmt::format(
                "its chords lie {:.3f} mm within the circle, and the facets around a rim leave no room to "
                "make it "
                "round: export it finer",
                hole.chord_mm);
        if (reach < radius - kCuspShare * t.cusp)
            return fmt::format("the drill of {:.4g} mm is too thin by more than tolerances.cusp",
                               drill.diameter);
        return why_not_deep(hole, drill);
    }

    [[nodiscard]] std::string why_not_deep(const RoundHole& hole, const Tool& drill) const {
        const double bottom = bottom_of(hole), point = point_length(drill);
        const Tolerances& t = plan_.job.tolerances;
        if (hole.bottom == HoleBottom::open) {
            if (std::abs(bottom) > kSame) return "it opens into a hollow";
            // Never deeper into the board than the job lets cutters go.
            const double board = board_cut_limit(plan_.job.machine, plan_.job.tools);
            for (const Layer& layer : plan_.layers)
                if (layer.z_bottom - point < -board && layer.z_bottom < hole.mouth[2] - kSame)
                    return fmt::format(
                        "the drill's point would go {:.2f} mm into the base board, {:.2f} mm are allowed "
                        "(machine.base_board_cut)",
                        point - layer.z_bottom, board);
        } else if (std::abs(hole.mouth[2] - hole.depth_mm - (bottom - point)) > t.cusp / 2) {
            return "its cone is not that of the drill's point";
        }
        for (const Layer& layer : plan_.layers) {
            if (layer.z_top <= bottom + kSame || layer.z_bottom >= hole.mouth[2] - kSame) continue;
            const double deep = layer.z_top - tip_in(layer, hole, drill);
            const double reach =
                std::min(drill.flute_length, drill.stickout - plan_.job.cutting.holder_clearance);
            if (deep > reach)
                return fmt::format("layer {} needs a drill that reaches {:.1f} mm, it reaches {:.1f}",
                                   layer.index, deep, reach);
        }
        return "";
    }

    // Whether the hole is bored.
    bool bored(const RoundHole& hole, const std::vector<std::vector<std::uint32_t>>& rims) {
        const bool is_open = hole.bottom == HoleBottom::open;
        if (!plan_.job.cutting.bore_holes || hole.into[2] > -kUpright || hole.kind != HoleKind::plain ||
            (!is_open && hole.bottom != HoleBottom::flat) || rims.size() != (is_open ? 2 : 1) ||
            !std::all_of(rims.begin(), rims.end(), [&](const auto& rim) { return is_level(mesh_, rim); }) ||
            (is_open && std::abs(bottom_of(hole)) > kSame))
            return false;
        const Tolerances& t = plan_.job.tolerances;
        const double full = hole.diameter_mm / 2;
        const double radius = std::min(full, full - hole.chord_mm + kGougeShare * t.gouge);
        if (radius < full - (kCuspShare - kHelixShare) * t.cusp) return false;
        const Tool* widest = nullptr;
        for (const Tool& tool : plan_.job.tools)
            if (can_bore(tool, 2 * radius) && reaches(hole, tool) &&
                (widest == nullptr || tool.diameter > widest->diameter))
                widest = &tool;
        if (widest == nullptr) return false;
        bore_layers(hole, *widest, radius - widest->diameter / 2);
        ++bored_[{widest->number, std::lround(hole.diameter_mm * 1000)}];
        return true;
    }

    [[nodiscard]] bool reaches(const RoundHole& hole, const Tool& tool) const {
        const double reach = std::min(tool.flute_length, tool.stickout - plan_.job.cutting.holder_clearance);
        return std::all_of(plan_.layers.begin(), plan_.layers.end(), [&](const Layer& layer) {
            return !is_in(layer, hole) || layer.z_top - std::max(layer.z_bottom, bottom_of(hole)) <= reach;
        });
    }
    [[nodiscard]] static bool is_in(const Layer& layer, const RoundHole& hole) {
        return layer.z_top > bottom_of(hole) + kSame && layer.z_bottom < hole.mouth[2] - kSame;
    }
    void bore_layers(const RoundHole& hole, const Tool& tool, double around) {
        for (std::size_t i = 0; i < plan_.layers.size(); ++i) {
            const Layer& layer = plan_.layers[i];
            if (is_in(layer, hole))
                result_.layers[i].push_back({hole.mouth[0], hole.mouth[1],
                                             std::min(hole.mouth[2], layer.z_top),
                                             std::max(layer.z_bottom, bottom_of(hole)), tool.number, around});
        }
    }
    void tell_bored() {
        for (const auto& [what, count] : bored_)
            result_.diagnostics.push_back(
                {Severity::note,
                 "hole.bored",
                 fmt::format("{} hole{} of {:.3f} mm {} bored on a helix by tool {}", count,
                             count == 1 ? "" : "s", static_cast<double>(what.second) / 1000,
                             count == 1 ? "is" : "are", what.first),
                 {}});
    }

    // Of the full diameter.
    [[nodiscard]] static double bottom_of(const RoundHole& hole) {
        const HoleStep& wall = hole.steps.front();
        return hole.mouth[2] - wall.to_mm;
    }

    [[nodiscard]] static double tip_in(const Layer& layer, const RoundHole& hole, const Tool& drill) {
        const double bottom = bottom_of(hole), point = point_length(drill);
        const double tip = std::max(layer.z_bottom, bottom) - point;
        return hole.bottom == HoleBottom::cone ? std::max(tip, hole.mouth[2] - hole.depth_mm) : tip;
    }

    void drill_layers(const RoundHole& hole, const Tool& drill) {
        for (std::size_t i = 0; i < plan_.layers.size(); ++i) {
            const Layer& layer = plan_.layers[i];
            if (!is_in(layer, hole)) continue;
            result_.layers[i].push_back({hole.mouth[0], hole.mouth[1], std::min(hole.mouth[2], layer.z_top),
                                         tip_in(layer, hole, drill), drill.number});
        }
    }

    void tell(const RoundHole& hole, const std::string& reason) {
        result_.diagnostics.push_back(
            {Severity::note, std::abs(hole.into[2]) < kUpright ? "hole.tilted" : "hole.milled",
             fmt::format("a hole of {:.3f} mm is not drilled: {}", hole.diameter_mm, reason),
             std::array<double, 3>{hole.mouth[0], hole.mouth[1], hole.mouth[2]}});
    }

    // The pattern without some facets, each of the rims closed around its middle.
    [[nodiscard]] Mesh without(const std::vector<std::uint8_t>& gone,
                               const std::vector<std::vector<std::uint32_t>>& rims) const {
        Mesh mesh;
        mesh.vertices.assign(mesh_.vertices.begin(), mesh_.vertices.end());
        for (std::size_t f = 0; f < mesh_.size(); ++f) {
            if (gone[f] != 0) continue;
            mesh.facets.push_back(mesh_.facets[f]);
            if (!mesh_.roles.empty()) mesh.roles.push_back(mesh_.roles[f]);
        }
        for (const std::vector<std::uint32_t>& rim : rims) {
            double x = 0, y = 0;
            for (const std::uint32_t v : rim) x += mesh_.vertices[v].x, y += mesh_.vertices[v].y;
            const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
            const auto n = static_cast<double>(rim.size());
            mesh.vertices.push_back(
                {static_cast<float>(x / n), static_cast<float>(y / n), mesh_.vertices[rim.front()].z});
            // The wall ran along the rim this way, and so does what takes its place.
            for (std::size_t i = 0; i < rim.size(); ++i) {
                mesh.facets.push_back({rim[i], rim[(i + 1) % rim.size()], middle});
                if (!mesh_.roles.empty()) mesh.roles.push_back(FacetRole::surface);
            }
        }
        pair_edges(context_, mesh);
        return mesh;
    }

    Context& context_;
    MeshView mesh_;
    const Plan& plan_;
    DrillPlan result_;
    std::map<std::pair<int, long>, int> bored_;  // by tool and diameter, µm: how many
};

}  // namespace

DrillPlan plan_drilling(Context& context, MeshView pattern, const Plan& plan) {
    const bool has_drill = std::any_of(plan.job.tools.begin(), plan.job.tools.end(),
                                       [](const Tool& tool) { return tool.kind == ToolKind::drill; });
    if (!has_drill && !plan.job.cutting.bore_holes) {
        DrillPlan none;
        none.layers.resize(plan.layers.size());
        return none;
    }
    return Driller(context, pattern, plan).run();
}

}  // namespace slabwright
