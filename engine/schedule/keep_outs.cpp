#include "engine/schedule/keep_outs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "engine/schedule/fit.h"

namespace slabwright {

namespace {

using Place = std::array<double, 2>;

constexpr double kSagitta = 0.005;  // mm: chords of an arc are at most so far from it
constexpr double kSlack = 2e-4;     // mm: paths are whole tenths of a micrometre
constexpr double kOverlap = 1e-3;   // mm: a fence may touch the slab's edge
constexpr double kAbove = 1;        // mm: where programs begin and end, over the rapids within them

// Of a straight way from a to b, the place nearest to p.
Place nearest_on(const Place& a, const Place& b, const Place& p) {
    const double ux = b[0] - a[0], uy = b[1] - a[1], square = ux * ux + uy * uy;
    const double t =
        square > 0 ? std::clamp(((p[0] - a[0]) * ux + (p[1] - a[1]) * uy) / square, 0.0, 1.0) : 0.0;
    return {a[0] + t * ux, a[1] + t * uy};
}

double distance(const Place& a, const Place& b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

double turn(const Place& a, const Place& b, const Place& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Where two straight ways cross, if both go through the other.
std::optional<Place> crossing(const Place& a, const Place& b, const Place& c, const Place& d) {
    const double abc = turn(a, b, c), abd = turn(a, b, d), cda = turn(c, d, a), cdb = turn(c, d, b);
    if ((abc > 0) == (abd > 0) || (cda > 0) == (cdb > 0)) return std::nullopt;
    const double t = cda / (cda - cdb);
    return Place{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
}

bool is_inside(const std::vector<Place>& corners, const Place& p) {
    bool inside = false;
    for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
        const Place &a = corners[i], &b = corners[j];
        if ((a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]))
            inside = !inside;
    }
    return inside;
}

// A part of a tool that stands over its tip, as a cylinder.
struct ToolPart {
    const char* name;
    double radius, height;  // mm; of its lower end over the tip
};

std::vector<ToolPart> parts_of(const Tool& tool) {
    std::vector<ToolPart> parts{{"cutter", tool.diameter / 2, 0}};
    for (const ToolSection& s : cylinders_of(tool)) parts.push_back({s.name, s.radius, s.above});
    return parts;
}

// A move that enters a zone: where, with what, and how high the tip must be to pass over all that it enters.
struct KeepOutEntry {
    const KeepOutZone* zone = nullptr;
    const char* part = "";
    double distance = 0;  // mm, from the part to the area
    std::array<double, 3> where{};
    double height = -std::numeric_limits<double>::infinity();
};

class Clearing {
public:
    Clearing(const Operation& operation, const Tool& tool, const std::vector<KeepOutZone>& zones)
        : moves_(operation.moves), parts_(parts_of(tool)), zones_(zones) {
        for (const ToolPart& part : parts_) widest_ = std::max(widest_, part.radius);
    }

    // What the move at place i, from 1, enters.
    [[nodiscard]] std::optional<KeepOutEntry> entry(std::size_t i) const {
        const Move &a = moves_[i - 1], &b = moves_[i];
        std::optional<KeepOutEntry> found;
        if (!b.is_arc()) {
            meet({to_mm(a.x), to_mm(a.y), to_mm(a.z)}, {to_mm(b.x), to_mm(b.y), to_mm(b.z)}, 0, found);
            return found;
        }
        const ArcShape arc = arc_shape(a, b);
        if (!is_near(arc.box(), to_mm(b.z))) return found;
        const double step = 2 * std::acos(1 - std::min(1.0, kSagitta / arc.radius));
        const int chords = std::max(1, static_cast<int>(std::ceil(std::abs(arc.sweep) / step)));
        const auto at = [&](int k) -> std::array<double, 3> {
            const double angle = arc.start + arc.sweep * k / chords;
            return {arc.x + arc.radius * std::cos(angle), arc.y + arc.radius * std::sin(angle), to_mm(b.z)};
        };
        for (int k = 0; k < chords; ++k) meet(at(k), at(k + 1), kSagitta, found);
        return found;
    }

    [[nodiscard]] std::array<double, 4> box_of(std::size_t i) const {
        const Move &a = moves_[i - 1], &b = moves_[i];
        if (b.is_arc()) return arc_shape(a, b).box();
        return {to_mm(std::min(a.x, b.x)), to_mm(std::min(a.y, b.y)), to_mm(std::max(a.x, b.x)),
                to_mm(std::max(a.y, b.y))};
    }

private:
    [[nodiscard]] bool is_near(const std::array<double, 4>& box, double low) const {
        return std::any_of(zones_.begin(), zones_.end(), [&](const KeepOutZone& zone) {
            return low < zone.top && reaches(zone, box, widest_ + zone.clearance + kSagitta);
        });
    }
    static bool reaches(const KeepOutZone& zone, const std::array<double, 4>& box, double reach) {
        return box[0] < zone.box_max[0] + reach && box[2] > zone.box_min[0] - reach &&
               box[1] < zone.box_max[1] + reach && box[3] > zone.box_min[1] - reach;
    }

    // Adds what a straight way, which may lie `off` from the true one, enters.
    void meet(const std::array<double, 3>& a, const std::array<double, 3>& b, double off,
              std::optional<KeepOutEntry>& found) const {
        const std::array<double, 4> box{std::min(a[0], b[0]), std::min(a[1], b[1]), std::max(a[0], b[0]),
                                        std::max(a[1], b[1])};
        if (!is_near(box, std::min(a[2], b[2]))) return;
        for (const KeepOutZone& zone : zones_)
            for (const ToolPart& part : parts_) {
                const double below = zone.top - part.height - kSlack;  // the tip is lower than this
                const double reach = part.radius + zone.clearance + off;
                if (std::min(a[2], b[2]) >= below || !reaches(zone, box, reach)) continue;
                std::array<double, 3> low = a, high = b;
                for (auto* const end : {&low, &high})
                    if (const auto& other = end == &low ? high : low; (*end)[2] > below) {
                        const double t = ((*end)[2] - below) / ((*end)[2] - other[2]);
                        for (std::size_t k = 0; k < 3; ++k) (*end)[k] += t * (other[k] - (*end)[k]);
                    }
                Place near;
                const double away = distance_to(zone, {low[0], low[1]}, {high[0], high[1]}, &near);
                if (away >= reach - kSlack) continue;
                if (!found) found.emplace();
                if (found->zone == nullptr || away - part.radius < found->distance) {
                    found->zone = &zone;
                    found->part = part.name;
                    found->distance = away - part.radius;
                    found->where = {near[0], near[1], std::min(low[2], high[2])};
                }
                found->height = std::max(found->height, zone.top + zone.clearance - part.height);
            }
    }

    const std::vector<Move>& moves_;
    std::vector<ToolPart> parts_;
    const std::vector<KeepOutZone>& zones_;
    double widest_ = 0;
};

// Programs begin and end over all zones.
void raise_ends(Operation& operation, const std::vector<KeepOutZone>& zones) {
    double height = operation.clearance_z;
    for (const KeepOutZone& zone : zones) height = std::max(height, zone.top + zone.clearance + kAbove);
    if (height <= operation.clearance_z) return;
    const std::int32_t before = to_units(operation.clearance_z), after = to_units(height);
    for (Move& move : operation.moves)
        if (move.feed == 0 && move.z == before) move.z = after;
    operation.clearance_z = to_mm(after);
}

[[noreturn]] void refuse_entry(const Layer& layer, const Operation& operation, const KeepOutEntry& entry,
                               const Place& origin) {
    throw refusal(
        "keep_out.entered",
        fmt::format(
            "layer {}, {}: the {} of T{} {} \"{}\", which must stay {:.1f} mm away from all tools",
            layer.index, operation.purpose.empty() ? name(operation.kind) : operation.purpose, entry.part,
            operation.tool,
            entry.distance > 0 ? fmt::format("comes within {:.2f} mm of", entry.distance) : "runs into",
            entry.zone->name, entry.zone->clearance),
        fmt::format("layer {}, x {:.2f} y {:.2f} z {:.2f} mm", layer.index, entry.where[0] + origin[0],
                    entry.where[1] + origin[1], entry.where[2]),
        "move it farther from the stock, make it lower, use a larger slab with it outside, or hold the slab "
        "in another way");
}

// Whether the area of a zone covers some of a slab.
bool overlaps(const KeepOutZone& zone, const Blank& slab) {
    const Place low{slab.min[0] + kOverlap, slab.min[1] + kOverlap},
        high{slab.max[0] - kOverlap, slab.max[1] - kOverlap};
    const Place inner = zone.corners.empty() ? Place{zone.x, zone.y} : zone.corners[0];
    if (inner[0] > low[0] && inner[0] < high[0] && inner[1] > low[1] && inner[1] < high[1]) return true;
    const std::array<Place, 5> edge{low, Place{high[0], low[1]}, high, Place{low[0], high[1]}, low};
    for (std::size_t k = 0; k < 4; ++k)
        if (distance_to(zone, edge[k], edge[k + 1]) == 0) return true;
    return false;
}

KeepOutZone zone_of(const KeepOut& keep_out, const Place& shift) {
    KeepOutZone zone;
    zone.name = keep_out.name;
    zone.clearance = keep_out.clearance;
    zone.corners = keep_out.polygon;
    if (const std::vector<double>& r = keep_out.rectangle; !r.empty())
        zone.corners = {{r[0], r[1]}, {r[2], r[1]}, {r[2], r[3]}, {r[0], r[3]}};
    for (Place& p : zone.corners) p = {p[0] + shift[0], p[1] + shift[1]};
    if (const std::vector<double>& c = keep_out.circle; !c.empty()) {
        zone.x = c[0] + shift[0];
        zone.y = c[1] + shift[1];
        zone.radius = c[2];
        zone.box_min = {zone.x - zone.radius, zone.y - zone.radius};
        zone.box_max = {zone.x + zone.radius, zone.y + zone.radius};
        return zone;
    }
    zone.box_min = zone.box_max = zone.corners[0];
    for (const Place& p : zone.corners)
        for (std::size_t k = 0; k < 2; ++k) {
            zone.box_min[k] = std::min(zone.box_min[k], p[k]);
            zone.box_max[k] = std::max(zone.box_max[k], p[k]);
        }
    return zone;
}

// From the programs' X and Y to those of the plan, mm.
Place shift_of(const Plan& plan, const Place& origin) {
    const Point2 zero = work_zero(plan);
    const bool of_model = plan.job.machine.zero == WorkZero::model;
    return {to_mm(zero.x) - (of_model ? origin[0] : 0), to_mm(zero.y) - (of_model ? origin[1] : 0)};
}

double slab_top(const Layer& layer) { return layer.z_bottom + layer.slab_thickness; }

}  // namespace

double distance_to(const KeepOutZone& zone, const Place& from, const Place& to, Place* near) {
    if (zone.corners.empty()) {
        const Place at = nearest_on(from, to, {zone.x, zone.y});
        if (near != nullptr) *near = at;
        return std::max(0.0, distance(at, {zone.x, zone.y}) - zone.radius);
    }
    double least = std::numeric_limits<double>::infinity();
    const auto take = [&](double d, const Place& at) {
        if (d >= least) return;
        least = d;
        if (near != nullptr) *near = at;
    };
    if (is_inside(zone.corners, from)) take(0, from);
    for (std::size_t i = 0, j = zone.corners.size() - 1; i < zone.corners.size() && least > 0; j = i++) {
        const Place &a = zone.corners[j], &b = zone.corners[i];
        if (const std::optional<Place> at = crossing(from, to, a, b)) take(0, *at);
        const Place on = nearest_on(from, to, a);
        take(distance(on, a), on);
        take(distance(from, nearest_on(a, b, from)), from);
        take(distance(to, nearest_on(a, b, to)), to);
    }
    return least;
}

std::vector<KeepOutZone> keep_outs_in(const Plan& plan, const Layer& layer, const Place& origin) {
    std::vector<KeepOutZone> zones;
    const Place shift = shift_of(plan, origin);
    for (const KeepOut& keep_out : plan.job.machine.keep_outs) {
        KeepOutZone zone = zone_of(keep_out, shift);
        const bool on_slab = keep_out.from == KeepOutBase::slab;
        if (on_slab && !overlaps(zone, slab_of(plan, layer))) continue;
        zone.top = keep_out.height + (on_slab ? slab_top(layer) : 0);
        zones.push_back(std::move(zone));
    }
    return zones;
}

std::vector<KeepOut> moved(std::vector<KeepOut> keep_outs, const std::array<double, 2>& by) {
    for (KeepOut& keep_out : keep_outs) {
        for (std::size_t k = 0; k < keep_out.rectangle.size(); ++k) keep_out.rectangle[k] += by[k % 2];
        for (Place& corner : keep_out.polygon)
            for (std::size_t k = 0; k < 2; ++k) corner[k] += by[k];
        for (std::size_t k = 0; k < std::min<std::size_t>(2, keep_out.circle.size()); ++k)
            keep_out.circle[k] += by[k];
    }
    return keep_outs;
}

std::vector<KeepOut> keep_outs_below(const Plan& plan, const Place& origin) {
    const Place shift = shift_of(plan, origin);
    return moved(plan.job.machine.keep_outs, {shift[0] - plan.stock_min[0], shift[1] - plan.stock_min[1]});
}

void place_keep_outs(Plan& plan, const Place& origin) {
    const Place shift = shift_of(plan, origin);
    for (const KeepOut& keep_out : plan.job.machine.keep_outs) {
        const KeepOutZone zone = zone_of(keep_out, shift);
        const double x = (zone.box_min[0] + zone.box_max[0]) / 2 + origin[0],
                     y = (zone.box_min[1] + zone.box_max[1]) / 2 + origin[1];
        std::size_t carrying = 0;
        std::string without;
        for (const Layer& layer : plan.layers) {
            const bool covers = overlaps(zone, slab_of(plan, layer));
            if (covers) ++carrying;
            else without += fmt::format("{}{}", without.empty() ? "" : ", ", layer.index);
            if (covers && keep_out.from == KeepOutBase::board && layer.z_bottom < keep_out.height)
                throw refusal(
                    "keep_out.entered",
                    fmt::format(
                        "the slab of layer {} would lie where \"{}\" stands {:.1f} mm high on the base "
                        "board",
                        layer.index, keep_out.name, keep_out.height),
                    fmt::format("layer {}, x {:.2f} y {:.2f} mm", layer.index, x, y),
                    "move it beside the stock, take a smaller slabs.margin, or hold the slabs in another "
                    "way");
        }
        if (keep_out.from == KeepOutBase::board || without.empty()) continue;
        if (carrying == 0 && !plan.turned)
            throw refusal(
                "keep_out.slab",
                fmt::format("\"{}\" counts from the slab, but stands on no layer's slab", keep_out.name),
                fmt::format("x {:.2f} y {:.2f} mm", x, y), "move it onto the slab, or give from = \"board\"");
        plan.diagnostics.push_back(
            {Severity::warning, "keep_out.slab",
             fmt::format("\"{}\" stands on no slab in layers {}: it is not counted there", keep_out.name,
                         without),
             std::array{x - origin[0], y - origin[1], 0.0}});
    }
}

void keep_clear(const Plan& plan, const Layer& layer, double stock_top, Operation& operation,
                const std::vector<KeepOutZone>& zones, const Place& origin) {
    const std::vector<Tool>& tools = plan.job.tools;
    const auto tool =
        std::find_if(tools.begin(), tools.end(), [&](const Tool& t) { return t.number == operation.tool; });
    if (zones.empty() || operation.moves.size() < 2 || tool == tools.end()) return;
    raise_ends(operation, zones);
    const std::vector<Move>& moves = operation.moves;
    const Clearing clearing(operation, *tool, zones);
    const Blank slab = slab_of(plan, layer);
    const auto cuts_nothing = [&](std::size_t i) {
        if (moves[i].feed == 0 || to_mm(std::min(moves[i - 1].z, moves[i].z)) >= stock_top) return true;
        const std::array<double, 4> box = clearing.box_of(i);
        const double r = tool->diameter / 2;
        return box[0] - r >= slab.max[0] || box[2] + r <= slab.min[0] || box[1] - r >= slab.max[1] ||
               box[3] + r <= slab.min[1];
    };
    std::vector<Move> cleared{moves[0]};
    std::vector<std::uint32_t> places{0};  // where each move stands now
    for (std::size_t i = 1; i < moves.size();) {
        std::size_t end = i;
        double height = -std::numeric_limits<double>::infinity();
        for (; end < moves.size(); ++end) {
            const std::optional<KeepOutEntry> entry = clearing.entry(end);
            if (!entry) break;
            if (!cuts_nothing(end)) refuse_entry(layer, operation, *entry, origin);
            height = std::max(height, entry->height);
        }
        const bool entered = end > i;
        const auto lowest = entered ? static_cast<std::int32_t>(std::ceil(height * kUnitsPerMm))
                                    : std::numeric_limits<std::int32_t>::min();
        if (entered && lowest > moves[i - 1].z)
            cleared.push_back({moves[i - 1].x, moves[i - 1].y, lowest, 0});
        for (std::size_t k = i; k < std::max(end, i + 1); ++k) {
            Move move = moves[k];
            move.z = std::max(move.z, lowest);
            const Move& last = cleared.back();
            const bool stays = entered && move.x == last.x && move.y == last.y && move.z == last.z;
            if (!stays || k + 1 == moves.size()) cleared.push_back(move);
            places.push_back(static_cast<std::uint32_t>(cleared.size() - 1));
        }
        i = std::max(end, i + 1);
        Move down = moves[i - 1];
        down.i = down.j = 0;
        if (entered && cleared.back().z > down.z) cleared.push_back(down);
    }
    if (operation.peak_move && *operation.peak_move < places.size())
        operation.peak_move = places[*operation.peak_move];
    operation.moves = std::move(cleared);
}

void keep_clear(Plan& plan, const Place& origin, const std::vector<bool>& only) {
    if (plan.job.machine.keep_outs.empty()) return;
    for (std::size_t l = 0; l < plan.layers.size(); ++l) {
        if (!only.empty() && !only[l]) continue;
        Layer& layer = plan.layers[l];
        const std::vector<KeepOutZone> zones = keep_outs_in(plan, layer, origin);
        for (Operation& operation : layer.operations)
            keep_clear(plan, layer, slab_top(layer), operation, zones, origin);
    }
}

}  // namespace slabwright
