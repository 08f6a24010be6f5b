#include "engine/schedule/standing_walls.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "engine/forces/op_forces.h"
#include "engine/schedule/footing.h"
#include "engine/tools/tools.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

constexpr double kArc = 0.02;           // mm, tolerance of offsets
constexpr double kLeastArea = 1;        // mm²: less is a sliver
constexpr double kCovered = 0.02;       // of a wall's area: less thick wood under it does not carry it
constexpr double kStripHeights = 1.96;  // of the height, the length of a plate that bends under a point force
constexpr double kBeside = 0.1;         // mm: wood that near lies against it
constexpr double kStub = 3;             // thicknesses
/// Walls are looked for up to each of these, mm; what is thinner than a share of it is a corner, or one of
/// the rung before.
struct Rung {
    double thickness, least_share;
};
constexpr std::array<Rung, 3> kRungs{{{2.4, 0.2}, {5.5, 0.42}, {12, 0.42}}};

double thickest(const Loops& piece, double low, double high) {
    while (high - low > 0.01) {
        const double middle = (low + high) / 2;
        (offset(piece, -middle / 2, kArc).empty() ? high : low) = middle;
    }
    return low;
}

/// By a force in the worst direction: 1 / max |I⁻¹·(p − g)| over the border's points p, g the middle.
double weakest_modulus(const Loops& piece) {
    const AreaMoments m = area_moments(piece);
    const double determinant = m.ixx * m.iyy - m.ixy * m.ixy;
    double most = 0;
    for (const Point2 p : piece.points) {
        const double x = to_mm(p.x) - m.x, y = to_mm(p.y) - m.y;
        most = std::max(most, std::hypot(m.iyy * x - m.ixy * y, m.ixx * y - m.ixy * x) / determinant);
    }
    return 1 / most;
}

/// A level of the build at which walls are looked for.
struct Level {
    std::size_t layer = 0;
    double z = 0;
    const Loops* wood = nullptr;
    std::vector<std::pair<double, const Loops*>> over{};  ///< heights over it, and what stands there
    std::vector<Loops> thin{};
    std::vector<double> contact_mm{};
    Loops thick{};  ///< what is as thick as the last rung
};

std::vector<Level> levels_of(const Plan& plan, std::span<const std::vector<JointWood>> wood) {
    std::vector<Level> levels;
    for (std::size_t l = 0; l < plan.layers.size(); ++l)
        for (std::size_t k = 0; k < wood[l].size(); ++k) {
            const JointWood& joint = wood[l][k];
            const bool inner = k + 1 < wood[l].size();
            const double top = inner ? wood[l][k + 1].z : plan.layers[l].z_top, part = (top - joint.z) / 4;
            const Loops* at_top = inner                                         ? &wood[l][k + 1].below
                                  : l + 1 < wood.size() && !wood[l + 1].empty() ? &wood[l + 1].front().below
                                                                                : nullptr;
            Level low{l, joint.z, &joint.above}, middle{l, joint.z + 2 * part, &joint.higher[1]};
            for (std::size_t r = 0; r < JointWood::kRungs; ++r) {
                const std::pair<double, const Loops*> stands{joint.z + part * static_cast<double>(r + 1),
                                                             &joint.higher[r]};
                low.over.push_back(stands);
                if (r > 1) middle.over.push_back(stands);
            }
            if (at_top != nullptr) low.over.emplace_back(top, at_top), middle.over.emplace_back(top, at_top);
            levels.push_back(std::move(low));
            levels.push_back(std::move(middle));
        }
    return levels;
}

/// What pushes at the walls of one layer, N.
struct Push {
    double rough_n = 0, step_mm = 0, finish_n = 0;
};

Push push_of(const Layer& layer, const Job& job) {
    Push push;
    for (const Operation& op : layer.operations) {
        const auto tool = std::find_if(job.tools.begin(), job.tools.end(),
                                       [&](const Tool& t) { return t.number == op.tool; });
        if (op.kind == OperationKind::face || tool == job.tools.end() || !mills(tool->kind)) continue;
        if (op.kind == OperationKind::rough) {
            push.rough_n = std::max(push.rough_n, op.peak_force_n);
            push.step_mm = std::max(push.step_mm, op.stepdown);
            continue;
        }
        const CutSegment cut = heaviest_cut(op, *tool, job);
        if (cut.high_mm > 0)
            push.finish_n =
                std::max(push.finish_n, std::min(op.peak_force_n, peak_force(cut).peak_in_plane_n));
    }
    return push;
}

/// The foot that bears most of one layer's walls.
struct Worst {
    double stress = 0, thickness = 0, height = 0, force = 0;
    std::array<double, 3> at{};
};

class WallSearch {
public:
    WallSearch(const Plan& plan, std::span<const Level> levels) : plan_(plan), levels_(levels) {}

    Worst of_layer(std::size_t layer) const {
        const Push push = push_of(plan_.layers[layer], plan_.job);
        Worst worst;
        for (std::size_t i = 0; i < levels_.size(); ++i)
            if (levels_[i].layer == layer)
                for (std::size_t p = 0; p < levels_[i].thin.size(); ++p) follow(i, p, push, worst);
        return worst;
    }

private:
    // From a thin part down, as long as what is under it is thin.
    void follow(std::size_t from, std::size_t part, const Push& push, Worst& worst) const {
        const Loops& wall = levels_[from].thin[part];
        const std::size_t layer = levels_[from].layer;
        // As high as half of it is known to stand: a ridge is thin near its top too, but not tall.
        double top = levels_[from].z;
        for (const auto& [z, stands] : levels_[from].over)
            if (area(intersect(wall, *stands)) < area(wall) / 2) break;
            else top = z;
        if (!(top > levels_[from].z)) return;
        rate({&levels_[from], &wall, levels_[from].contact_mm[part]}, layer, top, push, worst);
        for (std::size_t i = from; i-- > 0;) {
            const Level& below = levels_[i];
            if (area(intersect(wall, below.thick)) > kCovered * area(wall)) return;
            const std::size_t foot = under(below, wall);
            if (foot == below.thin.size()) return;
            rate({&below, &below.thin[foot], below.contact_mm[foot]}, layer, top, push, worst);
        }
    }
    static std::size_t under(const Level& level, const Loops& wall) {
        std::size_t best = level.thin.size();
        double most = 0;
        for (std::size_t p = 0; p < level.thin.size(); ++p)
            if (const double common = area(intersect(level.thin[p], wall)); common > most)
                most = common, best = p;
        return best;
    }

    struct Foot {
        const Level* level;
        const Loops* piece;
        double contact_mm;
    };
    void rate(const Foot& at, std::size_t layer, double top, const Push& push, Worst& worst) const {
        WallFoot foot = wall_foot(*at.piece);
        foot.contact_mm = at.contact_mm;
        // A bump, or a web as short as it is thick, is part of what it stands against.
        if (at.contact_mm > 0 && foot.reach_mm() < kStub * foot.thickness_mm) return;
        const double height = top - at.level->z;
        // Roughing leaves its allowance on either side of the wall.
        WallFoot roughed = foot;
        if (at.level->layer == layer) {
            const double thicker = 1 + 2 * plan_.job.cutting.wall_allowance / foot.thickness_mm;
            roughed.thickness_mm *= thicker;
            roughed.weakest_mm3 *= thicker * thicker;
        }
        const double arm = at.level->layer == layer ? std::min(height, push.step_mm) : height,
                     by_rough = roughed.stress_mpa(push.rough_n, arm),
                     by_finish = foot.stress_mpa(push.finish_n, height);
        if (std::max(by_rough, by_finish) <= worst.stress) return;
        const AreaMoments m = area_moments(*at.piece);
        const bool rough = by_rough > by_finish;
        worst = {std::max(by_rough, by_finish),
                 foot.thickness_mm,
                 rough ? arm : height,
                 rough ? push.rough_n : push.finish_n,
                 {m.x, m.y, at.level->z}};
    }

    const Plan& plan_;
    std::span<const Level> levels_;
};

}  // namespace

double WallFoot::stress_mpa(double force_n, double height_mm) const {
    if (!(height_mm > 0) || !(force_n > 0)) return 0;
    const double section = thickness_mm * thickness_mm / 6;  // of a millimetre
    if (contact_mm > 0 && reach_mm() < height_mm)
        return force_n * reach_mm() / (std::min(height_mm, kStripHeights * reach_mm()) * section);
    const double strip = std::min(length_mm, kStripHeights * height_mm) * section;
    return force_n * height_mm / (contact_mm > 0 ? strip : std::min(strip, weakest_mm3));
}

double WallFoot::reach_mm() const {
    return contact_mm > 0 ? length_mm / std::max(1.0, contact_mm / thickness_mm) : 0;
}

WallFoot wall_foot(const Loops& piece) {
    WallFoot foot;
    foot.thickness_mm = std::max(0.01, thickest(piece, 0, 2 * kRungs.back().thickness));
    foot.length_mm = area(piece) / foot.thickness_mm;
    foot.weakest_mm3 = weakest_modulus(piece);
    return foot;
}

std::vector<Loops> thin_parts(const Loops& region, std::vector<double>& contact_mm) {
    std::vector<Loops> parts;
    contact_mm.clear();
    for (const Rung& rung : kRungs) {
        const double r = rung.thickness / 2;
        // Grown by a little more than it shrank, so that no skin is left along straight borders.
        const Loops thick = offset(offset(region, -r, kArc), r + kArc, kArc);
        for (Loops& piece : Pieces(subtract(region, thick)).regions) {
            if (area(piece) < kLeastArea) continue;
            if (offset(piece, -rung.least_share * r, kArc).empty()) continue;
            contact_mm.push_back(area(intersect(offset(piece, kBeside, kArc), thick)) / kBeside);
            parts.push_back(std::move(piece));
        }
    }
    return parts;
}

std::vector<Diagnostic> weak_walls(Context& context, const Plan& plan,
                                   std::span<const std::vector<JointWood>> wood) {
    std::vector<Level> levels = levels_of(plan, wood);
    parallel_each(context, levels.size(), [&](std::size_t i) {
        Level& level = levels[i];
        level.thin = thin_parts(*level.wood, level.contact_mm);
        if (level.thin.empty()) return;
        const double r = kRungs.back().thickness / 2;
        level.thick = offset(offset(*level.wood, -r, kArc), r, kArc);
    });
    std::vector<Worst> worst(plan.layers.size());
    const WallSearch search(plan, levels);
    parallel_each(context, worst.size(), [&](std::size_t l) { worst[l] = search.of_layer(l); });
    std::vector<Diagnostic> found;
    for (std::size_t l = 0; l < worst.size(); ++l)
        if (const Worst& w = worst[l]; w.stress > plan.job.material.strength_mpa)
            found.push_back(
                {Severity::warning, "wall.weak",
                 fmt::format(
                     "layer {}: a wall or pin {:.1f} mm thick stands {:.1f} mm high where {:.0f} N push "
                     "at it: {:.0f} MPa at its foot, more than the wood's {:.0f} MPa; cut it with a "
                     "smaller tool or a lower finish_feed, lay a boundary nearer under its top, or make "
                     "it thicker",
                     plan.layers[l].index, w.thickness, w.height, w.force, w.stress,
                     plan.job.material.strength_mpa),
                 w.at});
    return found;
}

}  // namespace slabwright
