#include "engine/schedule/standing_walls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "engine/forces/op_forces.h"
#include "engine/schedule/footing.h"
#include "engine/tools/tools.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

constexpr double kArc = 0.02;      // mm, tolerance of offsets
constexpr double kLeastArea = 1;   // mm²: less is a sliver
constexpr double kCovered = 0.02;  // of a wall's area: less thick wood under it does not carry it
constexpr double kBeside = 0.1;    // mm: wood that near lies against it
constexpr double kStub = 3;        // thicknesses
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

/// Follows the walls of one layer down to their feet.
class FeetOfLayer {
public:
    explicit FeetOfLayer(std::span<const Level> levels) : levels_(levels) {}

    /// By level and part: how high what stands on it in the layer reaches, mm.
    std::map<std::pair<std::size_t, std::size_t>, double> tops(std::size_t layer) const {
        std::map<std::pair<std::size_t, std::size_t>, double> found;
        for (std::size_t i = 0; i < levels_.size(); ++i)
            if (levels_[i].layer == layer)
                for (std::size_t p = 0; p < levels_[i].thin.size(); ++p) follow(i, p, found);
        return found;
    }

private:
    // From a thin part down, as long as what is under it is thin.
    void follow(std::size_t from, std::size_t part,
                std::map<std::pair<std::size_t, std::size_t>, double>& found) const {
        const Loops& wall = levels_[from].thin[part];
        // As high as half of it is known to stand: a ridge is thin near its top too, but not tall.
        double top = levels_[from].z;
        for (const auto& [z, stands] : levels_[from].over)
            if (area(intersect(wall, *stands)) < area(wall) / 2) break;
            else top = z;
        if (!(top > levels_[from].z)) return;
        const auto stands_on = [&](std::size_t level, std::size_t foot) {
            double& height = found[{level, foot}];
            height = std::max(height, top);
        };
        stands_on(from, part);
        for (std::size_t i = from; i-- > 0;) {
            const Level& below = levels_[i];
            if (area(intersect(wall, below.thick)) > kCovered * area(wall)) return;
            const std::size_t foot = under(below, wall);
            if (foot == below.thin.size()) return;
            stands_on(i, foot);
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

    std::span<const Level> levels_;
};

// The wall of one layer that its operations load most.
LoadedWall most_loaded(std::span<const StandingFoot> feet, const Push& push, const Job& job) {
    LoadedWall worst;
    for (const StandingFoot& at : feet) {
        const double height = at.top - at.z;
        // Roughing leaves its allowance on either side of the wall.
        const WallFoot roughed = at.in_layer ? at.foot.thicker_by(job.cutting.wall_allowance) : at.foot;
        const double arm = at.in_layer ? std::min(height, push.step_mm) : height,
                     by_rough = roughed.stress_mpa(push.rough_n, arm),
                     by_finish = at.foot.stress_mpa(push.finish_n, height);
        if (std::max(by_rough, by_finish) <= worst.stress_mpa) continue;
        worst = by_rough > by_finish ? LoadedWall{&at, arm, push.rough_n, by_rough}
                                     : LoadedWall{&at, height, push.finish_n, by_finish};
    }
    return worst;
}

}  // namespace

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

std::vector<std::vector<StandingFoot>> standing_feet(Context& context, const Plan& plan,
                                                     std::span<const std::vector<JointWood>> wood) {
    std::vector<Level> levels = levels_of(plan, wood);
    parallel_each(context, levels.size(), [&](std::size_t i) {
        Level& level = levels[i];
        level.thin = thin_parts(*level.wood, level.contact_mm);
        if (level.thin.empty()) return;
        const double r = kRungs.back().thickness / 2;
        level.thick = offset(offset(*level.wood, -r, kArc), r, kArc);
    });
    std::vector<std::map<std::pair<std::size_t, std::size_t>, double>> tops(plan.layers.size());
    const FeetOfLayer search(levels);
    parallel_each(context, tops.size(), [&](std::size_t l) { tops[l] = search.tops(l); });
    // A foot carries what stands in several layers, and is measured once.
    std::map<std::pair<std::size_t, std::size_t>, StandingFoot> measured;
    for (const auto& of_layer : tops)
        for (const auto& [at, top] : of_layer) measured.try_emplace(at);
    std::vector<std::pair<const std::pair<std::size_t, std::size_t>, StandingFoot>*> order;
    for (auto& entry : measured) order.push_back(&entry);
    parallel_each(context, order.size(), [&](std::size_t k) {
        const auto [level, part] = order[k]->first;
        StandingFoot& foot = order[k]->second;
        foot.outline = std::make_shared<const Loops>(levels[level].thin[part]);
        foot.foot = wall_foot(*foot.outline);
        foot.foot.contact_mm = levels[level].contact_mm[part];
        foot.z = levels[level].z;
        const AreaMoments m = area_moments(*foot.outline);
        foot.middle = {m.x, m.y};
    });
    std::vector<std::vector<StandingFoot>> feet(plan.layers.size());
    for (std::size_t l = 0; l < feet.size(); ++l)
        for (const auto& [at, top] : tops[l]) {
            StandingFoot foot = measured.at(at);
            // A bump, or a web as short as it is thick, is part of what it stands against.
            if (foot.foot.contact_mm > 0 && foot.foot.reach_mm() < kStub * foot.foot.thickness_mm) continue;
            foot.top = top;
            foot.in_layer = levels[at.first].layer == l;
            feet[l].push_back(std::move(foot));
        }
    return feet;
}

double widest_beside_walls(const Job& job) {
    double widest = 0;
    for (const Tool& tool : job.tools)
        if (is_end_mill(tool.kind)) widest = std::max(widest, tool.diameter / 2);
    return widest;
}

std::vector<Diagnostic> weak_walls(const Plan& plan, std::span<const std::vector<StandingFoot>> feet) {
    const double strength = plan.job.material.strength_mpa;
    std::vector<Diagnostic> found;
    for (std::size_t l = 0; l < feet.size(); ++l) {
        const LoadedWall worst = most_loaded(feet[l], push_of(plan.layers[l], plan.job), plan.job);
        if (worst.stress_mpa > strength)
            found.push_back(weak_wall(plan.layers[l].index, worst, strength, WallCare::none));
    }
    return found;
}

}  // namespace slabwright
