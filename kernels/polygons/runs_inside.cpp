#include "kernels/polygons/runs_inside.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace slabwright {

namespace {

using Wide = __int128;  // products of differences of int32 (loops.cpp)

struct Edge {
    Point2 a, b;
};

/// Twice the area of a, b, p: positive where p lies on the left of a → b.
Wide side(const Point2& a, const Point2& b, const Point2& p) {
    return (static_cast<Wide>(b.x) - a.x) * (static_cast<Wide>(p.y) - a.y) -
           (static_cast<Wide>(b.y) - a.y) * (static_cast<Wide>(p.x) - a.x);
}

/// Edges by the cells of a grid that their boxes meet.
class EdgeGrid {
public:
    explicit EdgeGrid(const Loops& region) {
        for (std::size_t l = 0; l < region.size(); ++l) {
            const std::span<const Point2> loop = region.loop(l);
            for (std::size_t k = 0; k < loop.size(); ++k)
                edges_.push_back({loop[k], loop[k + 1 < loop.size() ? k + 1 : 0]});
        }
        if (edges_.empty()) return;
        for (const Edge& e : edges_)
            low_ = {std::min(low_.x, e.a.x), std::min(low_.y, e.a.y)},
            high_ = {std::max(high_.x, e.a.x), std::max(high_.y, e.a.y)};
        // About one cell to an edge.
        const double across =
            std::max({1.0, static_cast<double>(high_.x) - low_.x, static_cast<double>(high_.y) - low_.y});
        cell_ = static_cast<std::int64_t>(
                    across / std::clamp(std::sqrt(static_cast<double>(edges_.size())), 1.0, 1024.0)) +
                1;
        columns_ = (std::int64_t{high_.x} - low_.x) / cell_ + 1;
        const std::int64_t rows = (std::int64_t{high_.y} - low_.y) / cell_ + 1;
        starts_.assign(static_cast<std::size_t>(columns_ * rows) + 1, 0);
        for (const bool filling : {false, true}) {
            for (std::size_t e = 0; e < edges_.size(); ++e)
                for_cells(edges_[e].a, edges_[e].b, [&](std::size_t c) {
                    if (filling) in_cells_[--starts_[c]] = static_cast<std::uint32_t>(e);
                    else ++starts_[c];
                });
            if (filling) break;
            for (std::size_t c = 1; c < starts_.size(); ++c) starts_[c] += starts_[c - 1];
            in_cells_.resize(starts_.back());
        }
        asked_.assign(edges_.size(), 0);
    }

    /// Hands on each edge that may meet p → q, once.
    template <class Visit>
    void near(const Point2& p, const Point2& q, Visit&& visit) {
        if (edges_.empty()) return;
        ++question_;
        for_cells(p, q, [&](std::size_t c) {
            for (std::uint32_t k = starts_[c]; k < starts_[c + 1]; ++k)
                if (std::exchange(asked_[in_cells_[k]], question_) != question_) visit(edges_[in_cells_[k]]);
        });
    }

private:
    template <class Visit>
    void for_cells(const Point2& p, const Point2& q, Visit&& visit) const {
        const std::int64_t x0 = std::max(std::min(p.x, q.x), low_.x),
                           x1 = std::min(std::max(p.x, q.x), high_.x);
        const std::int64_t y0 = std::max(std::min(p.y, q.y), low_.y),
                           y1 = std::min(std::max(p.y, q.y), high_.y);
        if (x0 > x1 || y0 > y1) return;
        for (std::int64_t r = (y0 - low_.y) / cell_; r <= (y1 - low_.y) / cell_; ++r)
            for (std::int64_t c = (x0 - low_.x) / cell_; c <= (x1 - low_.x) / cell_; ++c)
                visit(static_cast<std::size_t>(r * columns_ + c));
    }

    std::vector<Edge> edges_;
    Point2 low_{INT32_MAX, INT32_MAX}, high_{INT32_MIN, INT32_MIN};
    std::int64_t cell_ = 1, columns_ = 0;
    std::vector<std::uint32_t> starts_, in_cells_, asked_;  // asked_: the last question that met this edge
    std::uint32_t question_ = 0;
};

void append(std::vector<Point2>& points, Point2 p) {
    if (points.empty() || !(points.back() == p)) points.push_back(p);
}

/// The stretches of one line; none where the crossings contradict each other.
std::optional<std::vector<RunInside>> stretches(std::span<const Point2> line, std::size_t index,
                                                const Loops& region, EdgeGrid& grid) {
    struct Crossing {
        double at = 0;  // share of the segment
        int change = 0;
    };
    std::vector<RunInside> runs;
    std::vector<Crossing> crossings;
    const int first = winding(region, line.front());
    int around = first;
    if (around > 0) runs.push_back({{line.front()}, index, false});
    for (std::size_t k = 0; k < line.size(); ++k) {
        const Point2 p = line[k], q = line[k + 1 < line.size() ? k + 1 : 0];
        crossings.clear();
        grid.near(p, q, [&](const Edge& e) {
            const Wide from = side(e.a, e.b, p), to = side(e.a, e.b, q);
            if ((from > 0) == (to > 0) || (side(p, q, e.a) > 0) == (side(p, q, e.b) > 0)) return;
            crossings.push_back(
                {static_cast<double>(from) / (static_cast<double>(from) - static_cast<double>(to)),
                 to > 0 ? 1 : -1});
        });
        std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
            return std::pair(a.at, a.change) < std::pair(b.at, b.change);
        });
        for (const Crossing& c : crossings) {
            const bool was_inside = around > 0;
            around += c.change;
            if ((around > 0) == was_inside) continue;
            if (!was_inside) runs.push_back({{}, index, false});
            append(runs.back().points,
                   {static_cast<std::int32_t>(std::lround(p.x + c.at * (static_cast<double>(q.x) - p.x))),
                    static_cast<std::int32_t>(std::lround(p.y + c.at * (static_cast<double>(q.y) - p.y)))});
        }
        if (around > 0) append(runs.back().points, q);
    }
    if (around != first) return std::nullopt;
    if (first <= 0) return runs;
    if (runs.size() == 1) {  // never left
        runs.front().closed = true;
        if (runs.front().points.size() > 1) runs.front().points.pop_back();
        return runs;
    }
    RunInside& last = runs.back();  // goes on with the first
    last.points.insert(last.points.end(), runs.front().points.begin() + 1, runs.front().points.end());
    runs.erase(runs.begin());
    return runs;
}

}  // namespace

std::vector<RunInside> runs_inside(const Loops& lines, const Loops& region) {
    std::vector<RunInside> result;
    EdgeGrid grid(region);
    for (std::size_t l = 0; l < lines.size(); ++l) {
        const std::span<const Point2> line = lines.loop(l);
        if (line.size() < 2) continue;
        std::optional<std::vector<RunInside>> runs = stretches(line, l, region, grid);
        if (!runs) {
            result.push_back({{line.begin(), line.end()}, l, true});
            continue;
        }
        for (RunInside& run : *runs)
            if (run.points.size() > 1) result.push_back(std::move(run));
    }
    return result;
}

}  // namespace slabwright
