#include "engine/paths/runs/level_runs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>

#include "engine/moves/order.h"
#include "engine/paths/runs/leads.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

// Which runs, counted through all levels from the top, wait for which: a run for those on higher levels that
// lie within `reach` (0.1 µm) of it, some up to twice as far, for they may hold up wood over its cutter.
// Of each place only the nearest level above is told; that has waited for those over it.
class Waiting {
public:
    Waiting(const std::vector<std::vector<LevelRun>>& levels, std::int32_t reach)
        : cell_((reach + kFine - 1) / kFine) {
        for (std::size_t l = 0; l < levels.size(); ++l)
            for (const LevelRun& run : levels[l]) {
                level_of_.push_back(static_cast<std::uint32_t>(l));
                visit(run);
            }
        std::sort(visits_.begin(), visits_.end());
        for_.assign(level_of_.size(), 0);
        std::vector<std::array<std::uint32_t, 2>> pairs;  // higher run, lower run
        for (const Visit& v : visits_)
            for (std::int32_t x = v.x - kFine; x <= v.x + kFine; ++x)
                for (std::int32_t y = v.y - kFine; y <= v.y + kFine; ++y) append_above(x, y, v.run, pairs);
        std::sort(pairs.begin(), pairs.end());
        pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
        starts_.assign(level_of_.size() + 1, 0);
        for (const auto& [higher, lower] : pairs) ++starts_[higher + 1], ++for_[lower];
        for (std::size_t k = 1; k < starts_.size(); ++k) starts_[k] += starts_[k - 1];
        for (const auto& pair : pairs) lower_.push_back(pair[1]);
    }

    [[nodiscard]] bool waits(std::uint32_t run) const { return for_[run] > 0; }
    /// The runs that waited for this one alone, once it is cut.
    [[nodiscard]] std::vector<std::uint32_t> freed_by(std::uint32_t run) {
        std::vector<std::uint32_t> freed;
        for (std::uint32_t k = starts_[run]; k < starts_[run + 1]; ++k)
            if (--for_[lower_[k]] == 0) freed.push_back(lower_[k]);
        return freed;
    }

private:
    struct Visit {
        std::int32_t x, y;
        std::uint32_t run;
        auto operator<=>(const Visit&) const = default;
    };
    void visit(const LevelRun& run) {
        const auto id = static_cast<std::uint32_t>(level_of_.size() - 1);
        const auto cell = [&](double v) { return static_cast<std::int32_t>(std::floor(v / cell_)); };
        for (std::size_t k = 0; k < run.points.size(); ++k) {
            const PathPoint &p = run.points[k], &q = run.points[k == 0 ? 0 : k - 1];
            const int steps = 1 + static_cast<int>(std::hypot(static_cast<double>(p.x) - q.x,
                                                              static_cast<double>(p.y) - q.y) /
                                                   cell_ * 2);
            for (int s = 0; s < steps; ++s) {
                const double t = static_cast<double>(s) / steps;
                const Visit v{cell(p.x + t * (static_cast<double>(q.x) - p.x)),
                              cell(p.y + t * (static_cast<double>(q.y) - p.y)), id};
                if (visits_.empty() || visits_.back() != v) visits_.push_back(v);
            }
        }
    }
    void append_above(std::int32_t x, std::int32_t y, std::uint32_t run,
                      std::vector<std::array<std::uint32_t, 2>>& pairs) const {
        // Runs of a cell stand in the order of their levels.
        auto at = std::lower_bound(visits_.begin(), visits_.end(), Visit{x, y, run});
        const auto is_here = [&] { return at != visits_.begin() && (at - 1)->x == x && (at - 1)->y == y; };
        while (is_here() && level_of_[(at - 1)->run] == level_of_[run]) --at;
        if (!is_here()) return;
        for (const std::uint32_t level = level_of_[(at - 1)->run];
             is_here() && level_of_[(at - 1)->run] == level; --at)
            pairs.push_back({(at - 1)->run, run});
    }

    static constexpr std::int32_t kFine = 2;  // cells in a reach
    std::int32_t cell_;                       // 0.1 µm
    std::vector<std::uint32_t> level_of_;
    std::vector<Visit> visits_;
    std::vector<std::uint32_t> for_;             // how many a run waits for
    std::vector<std::uint32_t> starts_, lower_;  // by run, those that wait for it
};

constexpr std::uint32_t kBackwards = 1;  // the place of an open run's beginning at its last point

// Where a run may begin: an open one at its first point, from which on it has the part on its right, or at
// either end, a closed one at points all around it.
void append_beginnings(const LevelRun& run, LevelWays ways, std::uint32_t id,
                       std::vector<Beginning>& beginnings) {
    const std::vector<PathPoint>& points = run.points;
    if (!run.closed) {
        const Point2 first{points[0].x, points[0].y}, last{points.back().x, points.back().y};
        beginnings.push_back({first, last, id, 0});
        if (ways == LevelWays::either) beginnings.push_back({last, first, id, kBackwards});
        return;
    }
    double since = kUnbounded;
    for (std::uint32_t p = 0; p + 1 < points.size(); ++p) {
        if (p > 0)
            since += std::hypot(static_cast<double>(points[p].x) - points[p - 1].x,
                                static_cast<double>(points[p].y) - points[p - 1].y);
        if (since < 2 * kUnitsPerMm) continue;
        since = 0;
        const Point2 at{points[p].x, points[p].y};
        beginnings.push_back({at, at, id, p});
    }
}

// A run from one of its beginnings.
void cut_run(PathBuilder& path, const LayerCut& cut, const DropIndex& part, double chord, bool leads,
             const LevelRun& run, std::size_t place) {
    std::vector<PathPoint> points = run.points;
    if (!run.closed) {
        const bool backwards = place == kBackwards;
        if (backwards) std::reverse(points.begin(), points.end());
        if (leads) add_leads(path, cut, part, chord, points, backwards ? PartSide::left : PartSide::right);
    } else {
        // Where there is no room for an arc, perhaps elsewhere around the contour.
        constexpr std::size_t tries = 6;
        const std::size_t n = run.points.size() - 1;
        for (std::size_t attempt = 0; attempt <= tries; ++attempt) {
            const std::size_t first = (place + attempt % tries * n / tries) % n;
            points.assign(run.points.begin(), run.points.end() - 1);
            std::rotate(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(first), points.end());
            points.push_back(points.front());
            if (!leads || add_leads(path, cut, part, chord, points)) break;
        }
    }
    path.follow(points);
}

}  // namespace

void append_level_runs(const Contours& contours, std::size_t c, std::int32_t z,
                       const std::vector<char>& wanted, double tolerance, std::vector<LevelRun>& out) {
    const std::size_t first = contours.starts[c], n = contours.starts[c + 1] - first;
    if (n < 2) return;
    std::size_t start = n;
    for (std::size_t k = 0; k < n && start == n; ++k)
        if (!wanted[k]) start = k;
    auto point = [&](std::size_t k) {
        const Point2 p = contours.points[first + k % n];
        return PathPoint{p.x, p.y, z};
    };
    if (start == n) {
        LevelRun run;
        for (std::size_t k = 0; k <= n; ++k) run.points.push_back(point(k));
        run.points = simplify(run.points, tolerance);
        run.closed = true;
        if (run.points.size() > 2) out.push_back(std::move(run));
        return;
    }
    for (std::size_t k = 0; k < n;) {
        if (!wanted[(start + k) % n]) {
            ++k;
            continue;
        }
        LevelRun run;
        for (; k < n && wanted[(start + k) % n]; ++k) run.points.push_back(point(start + k));
        if (run.points.size() < 2) continue;
        run.points = simplify(run.points, tolerance);
        out.push_back(std::move(run));
    }
}

void cut_levels(PathBuilder& path, const LayerCut& cut, const Tool& tool, const DropIndex& part,
                std::vector<std::vector<LevelRun>>& levels, bool leads, LevelWays ways) {
    const double chord = safe_chord_mm(tool.diameter / 2, cut.job.tolerances.gouge);
    Waiting waiting(levels, to_units(tool.diameter));
    std::vector<const LevelRun*> runs;
    std::vector<Beginning> beginnings;
    for (const std::vector<LevelRun>& level : levels)
        for (const LevelRun& run : level) {
            append_beginnings(run, ways, static_cast<std::uint32_t>(runs.size()), beginnings);
            runs.push_back(&run);
        }
    NearestRuns ready(std::move(beginnings), runs.size());
    for (std::uint32_t k = 0; k < runs.size(); ++k)
        if (waiting.waits(k)) ready.remove(k);
    while (!ready.empty()) {
        cut.context.throw_if_cancelled();
        const Beginning next = ready.nearest(path.at());
        ready.remove(next.run);
        cut_run(path, cut, part, chord, leads, *runs[next.run], next.place);
        for (const std::uint32_t run : waiting.freed_by(next.run)) ready.restore(run);
    }
}

}  // namespace slabwright
