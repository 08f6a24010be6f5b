#include "engine/mend/patches.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/forces/split_cuts.h"

namespace slabwright {

namespace {

constexpr double kPitch = 0.25;       // mm between the points of a lifted way
constexpr double kArcChord = 2e-4;    // mm by which chords may miss an arc
constexpr double kFirstStep = 0.005;  // mm by which a piece between free points is raised that is not free
constexpr double kRampLength = 4;     // of the cutter's radius, at most
constexpr double kLegShare = 0.4;     // of a core's recess that a leg of a ramp goes down
constexpr int kMostLegs = 200;
constexpr double kOverStock = 0.1;  // mm over what stands, where a ramp begins

struct Place {
    double x = 0, y = 0, z = 0;  // mm
    std::uint32_t feed = 0;      // on the way there
};

Point3 point(const Place& p, double up = 0) { return {p.x, p.y, p.z + up}; }
double apart(const Place& a, const Place& b) { return std::hypot(b.x - a.x, b.y - a.y); }

Place place_of_move(const Move& m) { return {to_mm(m.x), to_mm(m.y), to_mm(m.z), m.feed}; }

// Never below where it was.
Move move_to(const Place& p, double up = 0) {
    Move m;
    m.x = to_units(p.x), m.y = to_units(p.y);
    m.z = static_cast<std::int32_t>(std::ceil((p.z + up) * kUnitsPerMm - 0.5));
    m.feed = p.feed;
    return m;
}

void add(std::vector<Move>& moves, const Move& m, const Move& before) {
    const Move& last = moves.empty() ? before : moves.back();
    if (last.x != m.x || last.y != m.y || last.z != m.z) moves.push_back(m);
}

Move vertical(const Move& at, std::int32_t z, std::uint32_t feed) { return {at.x, at.y, z, feed, 0, 0}; }

// The ends of straight pieces of a move, no longer than `pitch` mm.
void append_pieces(std::vector<Place>& places, const Move& from, const Move& to, double pitch) {
    const Place a = place_of_move(from), b = place_of_move(to);
    if (to.is_arc()) {
        const ArcShape arc = arc_shape(from, to);
        const double chord = std::min(pitch, std::sqrt(8 * arc.radius * kArcChord));
        const int n = std::max(1, static_cast<int>(std::ceil(arc.length() / std::max(chord, 1e-3))));
        for (int k = 1; k < n; ++k) {
            const double angle = arc.start + arc.sweep * k / n;
            places.push_back(
                {arc.x + arc.radius * std::cos(angle), arc.y + arc.radius * std::sin(angle), b.z, to.feed});
        }
    } else {
        const double length = std::hypot(b.x - a.x, b.y - a.y, b.z - a.z);
        const int n = std::max(1, static_cast<int>(std::ceil(length / pitch)));
        for (int k = 1; k < n; ++k) {
            const double t = static_cast<double>(k) / n;
            places.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z), to.feed});
        }
    }
    places.push_back(b);
}

}  // namespace

std::size_t apply_patches(std::vector<Move>& moves, std::vector<MovePatch> patches) {
    std::stable_sort(patches.begin(), patches.end(),
                     [](const MovePatch& a, const MovePatch& b) { return a.first < b.first; });
    std::vector<Move> result;
    std::size_t next = 0, applied = 0;
    for (const MovePatch& patch : patches) {
        if (patch.first < std::max<std::size_t>(next, 1) || patch.last >= moves.size() ||
            patch.first >= patch.last)
            continue;
        result.insert(result.end(), moves.begin() + static_cast<std::ptrdiff_t>(next),
                      moves.begin() + static_cast<std::ptrdiff_t>(patch.first));
        result.insert(result.end(), patch.moves.begin(), patch.moves.end());
        next = patch.last;
        ++applied;
    }
    result.insert(result.end(), moves.begin() + static_cast<std::ptrdiff_t>(next), moves.end());
    moves = std::move(result);
    // A program ends with a rapid in z alone, wherever that now is.
    if (applied > 0 && moves.size() > 1) {
        const Move& before = moves[moves.size() - 2];
        moves.back().x = before.x, moves.back().y = before.y;
    }
    return applied;
}

MovePatch lifted_over_part(const std::vector<Move>& moves, std::size_t first, std::size_t last,
                           const FreeCutter& cutter) {
    std::vector<Place> places{place_of_move(moves[first - 1])};
    places.back().feed = moves[first].feed;
    for (std::size_t k = first; k < last; ++k) append_pieces(places, moves[k - 1], moves[k], kPitch);
    const std::size_t n = places.size();
    std::vector<double> up(n), step(n, kFirstStep);
    for (std::size_t k = 0; k < n; ++k) up[k] = cutter.lift(point(places[k]));
    // What is free at both ends may touch the part between them. Every round doubles the step, so that a
    // piece is soon over all that stands.
    for (bool all = false; !all;) {
        all = true;
        for (std::size_t k = 1; k < n; ++k) {
            if (cutter.is_free(point(places[k - 1], up[k - 1]), point(places[k], up[k]))) continue;
            all = false;
            for (const std::size_t end : {k - 1, k}) up[end] += step[end], step[end] *= 2;
        }
    }
    MovePatch patch{first, last, {}};
    const Move& before = moves[first - 1];
    for (std::size_t k = 0; k < n; ++k) add(patch.moves, move_to(places[k], up[k]), before);
    // An arc begins in its own plane; where one follows that is no gouge, its begin is free.
    const Move& end = moves[last - 1];
    if (last < moves.size() && moves[last].is_arc()) add(patch.moves, vertical(end, end.z, end.feed), before);
    return patch;
}

MovePatch raised_by(const std::vector<Move>& moves, std::size_t first, std::size_t last, double up) {
    const std::int32_t by = static_cast<std::int32_t>(std::ceil(up * kUnitsPerMm));
    const Move& before = moves[first - 1];
    MovePatch patch{first, last, {vertical(before, before.z + by, moves[first].feed)}};
    for (std::size_t k = first; k < last; ++k) {
        patch.moves.push_back(moves[k]);
        patch.moves.back().z += by;
    }
    const Move& end = moves[last - 1];
    patch.moves.push_back(vertical(end, end.z, end.feed));
    return patch;
}

MovePatch rapids_above(const std::vector<Move>& moves, std::size_t at, std::int32_t clearance,
                       std::uint32_t feed, const FreeCutter& cutter) {
    std::size_t first = at, last = at + 1;
    while (first > 1 && moves[first - 1].feed == 0) --first;
    while (last + 1 < moves.size() && moves[last].feed == 0) ++last;
    MovePatch patch{first, last, {}};
    const Move &before = moves[first - 1], &end = moves[last - 1];
    add(patch.moves, vertical(before, clearance, 0), before);
    for (std::size_t k = first; k < last; ++k) add(patch.moves, vertical(moves[k], clearance, 0), before);
    Place down = place_of_move(end);
    down.feed = feed;
    const bool arc_follows = last < moves.size() && moves[last].is_arc();
    add(patch.moves, move_to(down, arc_follows ? 0 : cutter.lift(point(down))), before);
    return patch;
}

MovePatch in_passes(const std::vector<Move>& moves, std::size_t first, std::size_t last, double depth,
                    int passes, std::uint32_t plunge_feed) {
    const std::vector<Move> part(moves.begin() + static_cast<std::ptrdiff_t>(first) - 1,
                                 moves.begin() + static_cast<std::ptrdiff_t>(last));
    const Passes raised = passes_of({1, static_cast<std::uint32_t>(part.size() - 1), depth, passes});
    std::vector<Move> split = split_runs(part, {&raised, 1}, plunge_feed, false).moves;
    split.erase(split.begin());
    return {first, last, std::move(split)};
}

MovePatch ramped_in(const std::vector<Move>& moves, std::size_t at, double depth, const Tool& tool,
                    double ramp_deg) {
    const double core = core_diameter_of(tool), recess = core_recess(tool);
    if (core <= 0 || at == 0 || at + 1 >= moves.size()) return {};
    const Move& down = moves[at];
    std::vector<Place> way{place_of_move(down)};
    double length = 0, far = 0;
    for (std::size_t k = at + 1; k < moves.size() && length < kRampLength * tool.diameter / 2; ++k) {
        if (moves[k].feed == 0 || moves[k].z != down.z) break;
        const std::size_t known = way.size();
        append_pieces(way, moves[k - 1], moves[k], 1);
        for (std::size_t p = known; p < way.size(); ++p) {
            length += apart(way[p - 1], way[p]);
            far = std::max(far, apart(way[0], way[p]));
        }
    }
    // A core that never leaves what it stands on would keep a post there.
    if (far < 2 * core || recess <= 0) return {};
    const double steepest = std::tan(std::min(ramp_deg, ramp_limit_deg(tool)) * std::numbers::pi / 180);
    const double leg = std::min(kLegShare * recess, 0.9 * steepest * length), up = depth + kOverStock;
    const int legs = 2 * static_cast<int>(std::ceil(up / (2 * leg)));
    if (legs > kMostLegs) return {};
    const auto feed = static_cast<std::uint32_t>(std::max(1.0, tool.plunge_feed));
    const auto top = static_cast<std::int32_t>(std::ceil(up * kUnitsPerMm));
    MovePatch patch{at, at + 1, {}};
    const Move& before = moves[at - 1];
    const std::int32_t over = std::max(before.z, down.z + top);
    if (over > before.z) patch.moves.push_back(vertical(before, over, feed));
    add(patch.moves, vertical(down, over, down.feed), before);
    add(patch.moves, vertical(down, down.z + top, feed), before);
    double done = 0;
    for (int k = 0; k < legs + 2; ++k) {
        for (std::size_t p = 1; p < way.size(); ++p) {
            done += apart(way[p - 1], way[p]);
            Place to = way[p];
            to.feed = feed;
            add(patch.moves, move_to(to, std::max(0.0, up * (1 - done / (length * legs)))), before);
        }
        std::reverse(way.begin(), way.end());
    }
    return patch;
}

MovePatch left_out(const std::vector<Move>& moves, std::size_t at, std::int32_t clearance) {
    std::size_t last = at;
    while (last + 1 < moves.size() && moves[last].feed != 0) ++last;
    MovePatch patch{at, last, {}};
    const Move& before = moves[at - 1];
    add(patch.moves, vertical(before, clearance, 0), before);
    for (; patch.last + 1 < moves.size() && moves[patch.last].feed == 0; ++patch.last)
        add(patch.moves, vertical(moves[patch.last], clearance, 0), before);
    return patch;
}

}  // namespace slabwright
