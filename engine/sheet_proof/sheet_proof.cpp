#include "engine/sheet_proof/sheet_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <span>

#include "engine/sheet_proof/common_place.h"
#include "engine/sheet_proof/engraving_proof.h"
#include "engine/sheet_proof/hold_proof.h"
#include "engine/sheet_proof/swept.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/border_distance.h"
#include "kernels/polygons/loops.h"
#include "kernels/polygons/pieces.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr int kHeights = 9;  ///< at which a sheet is looked at: the middles of equal parts
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kFinestTurn = 1.5;  ///< degrees of the head between two places that are looked at
constexpr double kArcTolerance = 0.002;
constexpr double kThrough = 0.002;  ///< mm above the bottom at which a routed cut still counts as through

/// The places of a way between its points too: x, y, A and C all change evenly along a move.
std::vector<ReadHead> fine(const std::vector<ReadHead>& points) {
    std::vector<ReadHead> all;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (i > 0) {
            const ReadHead &p = points[i - 1], &q = points[i];
            const double turn = std::abs(q.a - p.a) + (p.a > 0 || q.a > 0 ? std::abs(q.c - p.c) : 0);
            const int pieces = std::clamp(static_cast<int>(std::ceil(turn / kFinestTurn)), 1, 400);
            for (int k = 1; k < pieces; ++k) {
                const double t = double(k) / pieces;
                all.push_back({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y), p.a + t * (q.a - p.a),
                               p.c + t * (q.c - p.c)});
            }
        }
        all.push_back(points[i]);
    }
    return all;
}

std::vector<AxisPoint> at_depth(const std::vector<ReadHead>& way, double depth) {
    std::vector<AxisPoint> points;
    for (const ReadHead& h : way) {
        const double lean = std::tan(h.a * kDegree);
        const double lx = lean * std::cos(h.c * kDegree), ly = lean * std::sin(h.c * kDegree);
        points.push_back({h.x + depth * lx, h.y + depth * ly, lx, ly});
    }
    return points;
}

/// Regions as one, put together from halves.
Loops united(std::span<const Loops> regions) {
    if (regions.size() == 1) return regions[0];
    const std::size_t half = regions.size() / 2;
    return unite(united(regions.first(half)), united(regions.subspan(half)));
}

/// A way at a level as a region: what it runs around. The way in is not part of its loop.
Loops around(const std::vector<AxisPoint>& axis, std::size_t first, bool is_hole) {
    Loops loop;
    for (std::size_t i = first; i + 1 < axis.size(); ++i)
        loop.points.push_back(unit_point(axis[i].x, axis[i].y));
    if (is_hole) std::reverse(loop.points.begin(), loop.points.end());
    loop.close_loop();
    return unite(loop, {});
}

struct WayBox {
    double x0 = 1e300, y0 = 1e300, x1 = -1e300, y1 = -1e300;
    void add(double x, double y, double more) {
        x0 = std::min(x0, x - more), y0 = std::min(y0, y - more);
        x1 = std::max(x1, x + more), y1 = std::max(y1, y + more);
    }
    [[nodiscard]] bool meets(const WayBox& o) const {
        return x0 <= o.x1 && o.x0 <= x1 && y0 <= o.y1 && o.y0 <= y1;
    }
};

/// A way of a program, with all places that are looked at.
struct FineWay {
    const ReadWay* read = nullptr;
    std::vector<ReadHead> heads;
    std::size_t loop_from = 0;  ///< index in heads where the loop begins
    WayBox box;
};

struct PieceResult {
    double made_mm3 = 0, gouge = 0, left_over = 0;
    int islands = 0;
    PieceHold hold;
    std::vector<Diagnostic> violations;
    Loops top, bottom;  ///< what stays there, where engravings ask for it
};

class PieceProof {
public:
    PieceProof(const ReadSheetProgram& program, const ReadPiece& piece, const std::vector<FineWay>& ways,
               const SheetProofRules& rules)
        : program_(program),
          piece_(piece),
          ways_(ways),
          rules_(rules),
          hold_(read_hold(piece)),
          bodies_(piece) {}

    PieceResult run(const std::vector<const Section*>& sections, bool wants_top, bool wants_bottom) {
        for (int k = 0; k < kHeights; ++k) level(k, sections[static_cast<std::size_t>(k)]->loops);
        if (wants_top) result_.top = made_at(0);
        if (wants_bottom) result_.bottom = made_at(program_.thickness);
        result_.hold = hold_of(piece_, program_.file, bodies_);
        return std::move(result_);
    }

private:
    void violate(const char* code, std::string message) {
        for (const Diagnostic& d : result_.violations)
            if (d.code == code) return;  // once a piece
        result_.violations.push_back({Severity::error,
                                      code,
                                      fmt::format("{}: piece {}: {}", program_.file, piece_.number, message),
                                      {}});
    }

    /// What the loops of this piece hold together, before the kerf is taken: what lies left of all passes of
    /// an outline, less what lies right of any pass of a hole.
    [[nodiscard]] Loops held(double depth) const {
        struct Ring {
            bool is_hole = false;
            Loops region;
        };
        std::map<std::pair<bool, int>, Ring> rings;  // by loop
        for (const FineWay& way : ways_) {
            if (way.read->piece != piece_.number) continue;
            const bool is_hole = way.read->is_hole;
            const Loops region = around(at_depth(own_frame(way), depth), way.loop_from, is_hole);
            const auto [ring, is_new] = rings.try_emplace({is_hole, way.read->loop}, Ring{is_hole, region});
            if (is_new) continue;
            ring->second.region =
                is_hole ? unite(ring->second.region, region) : intersect(ring->second.region, region);
        }
        // From the widest to the narrowest: what stands within a hole is put back after it.
        std::vector<std::pair<double, const Ring*>> order;
        for (const auto& [loop, ring] : rings) order.push_back({area(ring.region), &ring});
        std::stable_sort(order.begin(), order.end(),
                         [](const auto& a, const auto& b) { return a.first > b.first; });
        Loops all;
        for (std::size_t i = 0; i < order.size();) {
            const bool is_hole = order[i].second->is_hole;
            Loops alike;  // one after another: they are clipped at once
            for (; i < order.size() && order[i].second->is_hole == is_hole; ++i)
                append_loops(order[i].second->region, alike);
            all = is_hole ? subtract(all, alike) : unite(all, alike);
        }
        return all;
    }

    [[nodiscard]] std::vector<ReadHead> own_frame(const FineWay& way) const {
        std::vector<ReadHead> heads;
        for (const ReadHead& head : way.heads) heads.push_back(unplaced(head, piece_));
        return heads;
    }

    /// What the cuts leave at a depth; the same at all of them where every cut is upright and goes through.
    Loops made_at(double depth) {
        if (same_at_all_depths_) return *same_at_all_depths_;
        std::vector<Loops> taken;
        bool is_same = program_.taper == 0;
        for (const FineWay& way : ways_) {
            // A cut of another piece that comes near is one of this piece too.
            if (way.read->piece != piece_.number && !way.box.meets(box_)) continue;
            is_same = is_same && std::all_of(way.heads.begin(), way.heads.end(),
                                             [](const ReadHead& head) { return head.a == 0; });
            is_same = is_same && (!program_.is_routed || way.read->deepest >= program_.thickness);
            if (program_.is_routed && way.read->deepest < program_.thickness - kThrough)
                violate("sheets.depth",
                        fmt::format("the cut of line {} ends {:.3f} mm above the sheet's bottom",
                                    way.read->line, program_.thickness - way.read->deepest));
            if (program_.is_routed && way.read->deepest < depth) continue;
            taken.push_back(swept(at_depth(own_frame(way), depth),
                                  std::max(0.0, program_.kerf - 2 * depth * program_.taper)));
        }
        const Loops whole = held(depth);
        Loops made = taken.empty() ? whole : subtract(whole, united(taken));
        if (is_same) same_at_all_depths_ = made;
        return made;
    }

    void level(int k, const Loops& section) {
        const double depth = program_.thickness * (1 - (k + 0.5) / kHeights);
        Loops made = made_at(depth);
        if (made.empty()) {
            violate("sheets.nothing", "its cuts leave nothing of it");
            return;
        }
        // Slivers between a lead and its loop are waste.
        made = without_waste(made, section);
        if (k == kHeights / 2) {
            int parts = 0;
            for (std::size_t i = 0; i < made.size(); ++i) parts += signed_area(made.loop(i)) > 0;
            result_.islands = std::max(0, parts - 1);
        }
        require_walls(section, depth);
        const bool is_as_below = k > 0 && made.points == cut_.points && made.starts == cut_.starts;
        if (!is_as_below) bodies_.add_level(made);
        if (!is_as_below || !hold_.tabs.empty()) {
            cut_ = made;
            // Dowels fill their holes, and tabs come off.
            if (!hold_.holes.empty()) made = unite(made, hold_.holes);
            if (!hold_.tabs.empty()) made = subtract(made, subtract(hold_.tabs, section));
            made_ = std::move(made);
            to_made_.emplace(made_);
        }
        result_.made_mm3 += area(made_) * program_.thickness / kHeights;
        compare(section, depth);
    }

    /// What is made at a level, with what should be there.
    void compare(const Loops& section, double depth) {
        const BorderDistance to_section(section);
        const Loops gouged = subtract(section, made_), left = beside_tabs(subtract(made_, section));
        const double deepest = farthest_from_border(gouged, *to_made_, 0.5);
        result_.gouge = std::max(result_.gouge, deepest);
        if (!section.empty())  // else there is no border to be far from; the volume tells
            result_.left_over = std::max(result_.left_over, farthest_from_border(left, to_section, 0.5));
        if (!rules_.part_may_lose && !gouged.empty() &&
            !subtract(gouged, offset(made_, rules_.gouge, kArcTolerance)).empty())
            violate("sheets.gouge",
                    fmt::format("a cut enters the part by {:.3f} mm, {:.3f} mm below the sheet's top",
                                deepest, depth));
        if (rules_.left_over > 0 && !subtract(left, offset(section, rules_.left_over, kArcTolerance)).empty())
            violate("sheets.left_over", fmt::format("{:.3f} mm are left, {:.3f} mm below the sheet's top",
                                                    farthest_from_border(left, to_section, 0.5), depth));
    }

    /// Of what the cuts leave, the parts that hold something of the section.
    static Loops without_waste(const Loops& made, const Loops& section) {
        bool has_waste = false;
        Loops kept;
        for (std::size_t i = 0; i < made.size(); ++i) {
            if (signed_area(made.loop(i)) <= 0) continue;
            Loops part;
            const auto add = [&](std::size_t l) {
                const auto loop = made.loop(l);
                part.points.insert(part.points.end(), loop.begin(), loop.end());
                part.close_loop();
            };
            add(i);
            for (std::size_t h = 0; h < made.size(); ++h)
                if (h < made.parents.size() && made.parents[h] == static_cast<std::int32_t>(i)) add(h);
            if (!have_common_place(part, section)) {
                has_waste = true;
                continue;
            }
            kept.points.insert(kept.points.end(), part.points.begin(), part.points.end());
            for (std::size_t l = 1; l < part.starts.size(); ++l)
                kept.starts.push_back(kept.starts.back() + part.starts[l] - part.starts[l - 1]);
        }
        return has_waste ? unite(kept, {}) : made;
    }

    /// What is left over by more than the cutter's round corners between part and tabs.
    [[nodiscard]] Loops beside_tabs(const Loops& left) const {
        if (hold_.tabs.empty() || left.empty()) return left;
        return subtract(left, offset(hold_.tabs, program_.kerf + 0.05, kArcTolerance));
    }

    /// Every hole leaves something of the part, or of its tabs, all around it.
    void require_walls(const Loops& section, double depth) {
        constexpr double wall = 0.3;  // mm
        if (hold_.holes.empty()) return;
        const Loops around = offset(hold_.holes, wall, kArcTolerance);
        const Loops solid = hold_.tabs.empty() ? section : unite(section, hold_.tabs);
        if (!subtract(around, solid).empty())
            violate("sheets.hold",
                    fmt::format("a hole for a dowel or a rod breaks through the surface, {:.3f} mm "
                                "below the sheet's top",
                                depth));
    }

    const ReadSheetProgram& program_;
    const ReadPiece& piece_;
    const std::vector<FineWay>& ways_;
    const SheetProofRules& rules_;
    ReadHold hold_;
    SheetBodies bodies_;
    std::optional<Loops> same_at_all_depths_;
    Loops cut_, made_;  ///< of the level below: as cut, and with holes filled and tabs off
    std::optional<BorderDistance> to_made_;
    PieceResult result_;

public:
    WayBox box_;  ///< of the piece's own cuts, on the stock
};

std::vector<FineWay> fine_ways(const ReadSheetProgram& program) {
    const double widest = program.kerf + 2 * std::max(0.0, -program.taper) * program.thickness;
    std::vector<FineWay> ways;
    for (const ReadWay& way : program.ways) {
        FineWay f;
        f.read = &way;
        f.heads = fine(way.points);
        const std::vector<ReadHead> in(
            way.points.begin(), way.points.begin() + std::min<long>(2, static_cast<long>(way.points.size())));
        f.loop_from = fine(in).size() - 1;
        for (const double depth : {0.0, program.thickness})
            for (const AxisPoint& a : at_depth(f.heads, depth))
                f.box.add(a.x, a.y, widest / 2 * std::hypot(1, std::hypot(a.lean_x, a.lean_y)));
        ways.push_back(std::move(f));
    }
    return ways;
}

void require_ways(const ReadSheetProgram& program, const std::vector<FineWay>& ways,
                  std::vector<Diagnostic>& violations) {
    const auto violate = [&](const char* code, const ReadWay& way, const std::string& message) {
        violations.push_back(
            {Severity::error, code, fmt::format("{} line {}: {}", program.file, way.line, message), {}});
    };
    for (const FineWay& fine_way : ways) {
        const ReadWay& way = *fine_way.read;
        if (std::none_of(program.pieces.begin(), program.pieces.end(),
                         [&](const ReadPiece& p) { return p.number == way.piece; }))
            violate("sheets.piece", way,
                    fmt::format("a cut of piece {}, which the program does not place", way.piece));
        if (way.points.size() < 4) {
            violate("sheets.open_way", way, "a cut that goes round nothing");
            continue;
        }
        const ReadHead &first = way.points[1], &last = way.points.back();
        if (std::hypot(first.x - last.x, first.y - last.y) > 2e-3)
            violate("sheets.open_way", way, "a cut that does not close, so that the piece is not free");
        const WayBox& b = fine_way.box;
        if (b.x0 < 0 || b.y0 < 0 || b.x1 > program.length || b.y1 > program.width)
            violate("sheets.leaves_stock", way, "a cut leaves the stock");
    }
}

void require_stack(const std::vector<ReadSheetProgram>& programs, double height, const SheetProofRules& rules,
                   SheetProof& proof) {
    std::vector<const ReadPiece*> pieces;
    for (const ReadSheetProgram& program : programs)
        for (const ReadPiece& piece : program.pieces) {
            pieces.push_back(&piece);
            if (std::abs(piece.high - piece.low - program.thickness) > 1e-3)
                proof.violations.push_back(
                    {Severity::error,
                     "sheets.thickness",
                     fmt::format("{}: piece {} is {:.4g} mm high, its stock {:.4g} mm", program.file,
                                 piece.number, piece.high - piece.low, program.thickness),
                     {}});
        }
    std::sort(pieces.begin(), pieces.end(), [](const auto* a, const auto* b) { return a->low < b->low; });
    double top = 0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        const double gap = pieces[i]->low - top;
        if (gap < -1e-3 || gap > (i == 0 ? 1e-3 : rules.most_gap))
            proof.violations.push_back(
                {Severity::error,
                 "sheets.stack",
                 fmt::format("piece {} begins {:.4g} mm {} the one below ends", pieces[i]->number,
                             std::abs(gap), gap < 0 ? "before" : "after"),
                 {}});
        if (pieces[i]->number != static_cast<int>(i) + 1)
            proof.violations.push_back(
                {Severity::error,
                 "sheets.stack",
                 fmt::format("piece {} is number {} from below", pieces[i]->number, i + 1),
                 {}});
        top = pieces[i]->high;
    }
    if (pieces.empty())
        proof.violations.push_back({Severity::error, "sheets.stack", "the programs place no piece", {}});
    double thinnest = 1e300;
    for (const ReadSheetProgram& program : programs) thinnest = std::min(thinnest, program.thickness);
    proof.left_on_top = std::max(0.0, height - top);
    if (!pieces.empty() && proof.left_on_top >= thinnest - 1e-3)
        proof.violations.push_back(
            {Severity::error,
             "sheets.stack",
             fmt::format("{:.4g} mm of the part stand above the last sheet, and sheets are "
                         "{:.4g} mm",
                         proof.left_on_top, thinnest),
             {}});
    if (proof.left_on_top < 1e-3) proof.left_on_top = 0;
}

}  // namespace

SheetProof prove_sheets(Context& context, MeshView mesh, const std::vector<ReadSheetProgram>& programs,
                        const SheetProofRules& rules) {
    SheetProof proof;
    const double height = bounds(mesh).max.z;
    for (const Index3& f : mesh.facets) {
        const Vec3f &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
        proof.part_mm3 +=
            (a.x * (double{b.y} * c.z - double{b.z} * c.y) - a.y * (double{b.x} * c.z - double{b.z} * c.x) +
             a.z * (double{b.x} * c.y - double{b.y} * c.x)) /
            6;
    }
    require_stack(programs, height, rules, proof);
    struct Task {
        const ReadSheetProgram* program;
        const ReadPiece* piece;
        const std::vector<FineWay>* ways;
    };
    std::vector<std::vector<FineWay>> ways(programs.size());
    std::vector<Task> tasks;
    for (std::size_t p = 0; p < programs.size(); ++p) {
        const ReadSheetProgram& program = programs[p];
        ways[p] = fine_ways(program);
        require_ways(program, ways[p], proof.violations);
        for (const ReadPiece& piece : program.pieces) tasks.push_back({&program, &piece, &ways[p]});
    }
    const std::set<int> engraved = engraved_pieces(programs);
    std::vector<PieceResult> results(tasks.size());
    // Some pieces at a time: the sections of all of them are larger than the mesh.
    constexpr std::size_t at_once = 16;
    for (std::size_t first = 0; first < tasks.size(); first += at_once) {
        const std::size_t end = std::min(first + at_once, tasks.size());
        std::vector<Plane> planes;
        for (std::size_t i = first; i < end; ++i)
            for (int k = 0; k < kHeights; ++k)
                planes.push_back(
                    {std::min(tasks[i].piece->low + (k + 0.5) / kHeights * tasks[i].program->thickness,
                              height),
                     Side::above});
        const std::vector<Section> sections = slice(context, mesh, planes);
        parallel_each(context, end - first, [&](std::size_t at) {
            const Task& task = tasks[first + at];
            std::vector<const Section*> own;
            for (int k = 0; k < kHeights; ++k)
                own.push_back(&sections[at * kHeights + static_cast<std::size_t>(k)]);
            PieceProof piece(*task.program, *task.piece, *task.ways, rules);
            for (const FineWay& way : *task.ways)
                if (way.read->piece == task.piece->number)
                    piece.box_.add(way.box.x0, way.box.y0, 0), piece.box_.add(way.box.x1, way.box.y1, 0);
            const int number = task.piece->number;
            results[first + at] = piece.run(own, engraved.count(number) > 0, engraved.count(number - 1) > 0);
        });
    }
    std::vector<PieceHold> holds;
    for (const PieceResult& result : results) {
        proof.made_mm3 += result.made_mm3;
        proof.gouge = std::max(proof.gouge, result.gouge);
        proof.left_over = std::max(proof.left_over, result.left_over);
        proof.islands += result.islands;
        proof.dowels += static_cast<int>(result.hold.holes.size());
        holds.push_back(result.hold);
        proof.violations.insert(proof.violations.end(), result.violations.begin(), result.violations.end());
    }
    std::vector<EngravedPiece> faces;
    for (std::size_t i = 0; i < tasks.size(); ++i)
        faces.push_back(
            {tasks[i].program, tasks[i].piece, std::move(results[i].top), std::move(results[i].bottom)});
    proof.engraved = require_engravings(programs, faces, proof.violations);
    if (proof.dowels > 0) proof.islands = require_held(holds, proof.violations);
    proof.passed = proof.violations.empty();
    return proof;
}

}  // namespace slabwright
