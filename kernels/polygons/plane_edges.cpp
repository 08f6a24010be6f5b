#include "kernels/polygons/plane_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace slabwright {

namespace {

using Wide = __int128;  // products of differences of int32

/// Twice the signed area of a, b, p.
Wide turn(Point2 a, Point2 b, Point2 p) {
    return static_cast<Wide>(std::int64_t{b.x} - a.x) * (std::int64_t{p.y} - a.y) -
           static_cast<Wide>(std::int64_t{b.y} - a.y) * (std::int64_t{p.x} - a.x);
}
int sign(Wide w) { return w > 0 ? 1 : w < 0 ? -1 : 0; }

/// Whether p lies on an edge, its ends left out.
bool within(const PlaneEdge& e, Point2 p) {
    if (p == e.a || p == e.b || turn(e.a, e.b, p) != 0) return false;
    return std::min(e.a.x, e.b.x) <= p.x && p.x <= std::max(e.a.x, e.b.x) && std::min(e.a.y, e.b.y) <= p.y &&
           p.y <= std::max(e.a.y, e.b.y);
}

/// Whether two edges cross away from their ends.
bool cross(const PlaneEdge& e, const PlaneEdge& f) {
    return sign(turn(e.a, e.b, f.a)) * sign(turn(e.a, e.b, f.b)) < 0 &&
           sign(turn(f.a, f.b, e.a)) * sign(turn(f.a, f.b, e.b)) < 0;
}

Point2 crossing(const PlaneEdge& e, const PlaneEdge& f) {
    const auto from = static_cast<double>(turn(f.a, f.b, e.a)), to = static_cast<double>(turn(f.a, f.b, e.b));
    const double t = from / (from - to);
    return {static_cast<std::int32_t>(std::llround(e.a.x + t * (double(e.b.x) - e.a.x))),
            static_cast<std::int32_t>(std::llround(e.a.y + t * (double(e.b.y) - e.a.y)))};
}

double squared_length(const PlaneEdge& e) {
    const double x = double(e.b.x) - e.a.x, y = double(e.b.y) - e.a.y;
    return x * x + y * y;
}

/// Edges sorted into the cells of a grid, so that only those near each other are compared.
class NearEdges {
public:
    explicit NearEdges(const std::vector<PlaneEdge>& edges) : edges_(edges) {
        double total = 1;
        std::int64_t x1 = INT32_MIN, y1 = INT32_MIN;
        for (const PlaneEdge& e : edges) {
            total += std::sqrt(squared_length(e));
            x0_ = std::min<std::int64_t>({x0_, e.a.x, e.b.x});
            y0_ = std::min<std::int64_t>({y0_, e.a.y, e.b.y});
            x1 = std::max<std::int64_t>({x1, e.a.x, e.b.x});
            y1 = std::max<std::int64_t>({y1, e.a.y, e.b.y});
        }
        const double longest = double(std::max(x1 - x0_, y1 - y0_)) + 1;
        cell_ = static_cast<std::int64_t>(
            std::ceil(std::max({total / double(edges.size()), longest / 4096, 1.0})));
        for (std::uint32_t i = 0; i < edges.size(); ++i)
            each_cell(edges[i], [&](std::uint64_t c) { entries_.emplace_back(c, i); });
        std::sort(entries_.begin(), entries_.end());
    }

    /// take(i, j), i < j, for all pairs that share a cell; a pair may come more than once.
    template <class Take>
    void each_pair(Take&& take) const {
        for (std::size_t i = 0; i < entries_.size(); ++i)
            for (std::size_t j = i + 1; j < entries_.size() && entries_[j].first == entries_[i].first; ++j)
                take(entries_[i].second, entries_[j].second);
    }

private:
    template <class Use>
    void each_cell(const PlaneEdge& e, Use&& use) const {
        const PlaneEdge s = e.a.x <= e.b.x ? e : PlaneEdge{e.b, e.a};
        const std::int64_t c0 = (s.a.x - x0_) / cell_, c1 = (s.b.x - x0_) / cell_;
        for (std::int64_t c = c0; c <= c1; ++c) {
            // The heights at which it passes this column, a unit more on either side.
            const auto at = [&](std::int64_t x) {
                if (s.b.x == s.a.x) return double(s.a.y);
                const double t = std::clamp((double(x) - s.a.x) / (double(s.b.x) - s.a.x), 0.0, 1.0);
                return s.a.y + t * (double(s.b.y) - s.a.y);
            };
            double low = at(x0_ + c * cell_), high = at(x0_ + (c + 1) * cell_);
            if (s.b.x == s.a.x) high = s.b.y;
            if (low > high) std::swap(low, high);
            const auto row = [&](double y) {
                return static_cast<std::int64_t>(std::max(0.0, y - double(y0_))) / cell_;
            };
            for (std::int64_t r = row(low - 1); r <= row(high + 1); ++r)
                use(static_cast<std::uint64_t>(r) << 32U | static_cast<std::uint64_t>(c));
        }
    }

    const std::vector<PlaneEdge>& edges_;
    std::int64_t x0_ = INT32_MAX, y0_ = INT32_MAX, cell_ = 1;
    std::vector<std::pair<std::uint64_t, std::uint32_t>> entries_;
};

/// Each once, in order; those that run to and fro wall nothing off and go.
void make_unique(std::vector<PlaneEdge>& edges) {
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    std::vector<PlaneEdge> kept;
    for (const PlaneEdge& e : edges)
        if (e.a != e.b && !std::binary_search(edges.begin(), edges.end(), PlaneEdge{e.b, e.a}))
            kept.push_back(e);
    edges = std::move(kept);
}

/// Divides the edges at every point where another meets them away from their ends. @return whether any did
bool divide(std::vector<PlaneEdge>& edges) {
    std::vector<std::pair<std::uint32_t, Point2>> cuts;
    NearEdges(edges).each_pair([&](std::uint32_t i, std::uint32_t j) {
        const PlaneEdge &e = edges[i], &f = edges[j];
        for (const Point2 p : {f.a, f.b})
            if (within(e, p)) cuts.emplace_back(i, p);
        for (const Point2 p : {e.a, e.b})
            if (within(f, p)) cuts.emplace_back(j, p);
        if (!cross(e, f)) return;
        const Point2 p = crossing(e, f);
        if (p != e.a && p != e.b) cuts.emplace_back(i, p);
        if (p != f.a && p != f.b) cuts.emplace_back(j, p);
    });
    if (cuts.empty()) return false;
    const auto from_begin = [&](const std::pair<std::uint32_t, Point2>& cut) {
        return squared_length({edges[cut.first].a, cut.second});
    };
    std::sort(cuts.begin(), cuts.end(), [&](const auto& c, const auto& d) {
        if (c.first != d.first) return c.first < d.first;
        const double at = from_begin(c), other = from_begin(d);
        return at != other ? at < other : c.second < d.second;
    });
    std::vector<PlaneEdge> divided;
    std::size_t next = 0;
    for (std::uint32_t i = 0; i < edges.size(); ++i) {
        Point2 begin = edges[i].a;
        for (; next < cuts.size() && cuts[next].first == i; ++next) {
            divided.push_back({begin, cuts[next].second});
            begin = cuts[next].second;
        }
        divided.push_back({begin, edges[i].b});
    }
    make_unique(divided);
    edges = std::move(divided);
    return true;
}

/// Leaves out the shorter of any two edges that meet otherwise than in their ends.
void leave_out_crossing(std::vector<PlaneEdge>& edges) {
    std::vector<char> out(edges.size(), 0);
    NearEdges(edges).each_pair([&](std::uint32_t i, std::uint32_t j) {
        const PlaneEdge &e = edges[i], &f = edges[j];
        if (!cross(e, f) && !within(e, f.a) && !within(e, f.b) && !within(f, e.a) && !within(f, e.b)) return;
        out[squared_length(e) <= squared_length(f) ? i : j] = 1;
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < edges.size(); ++i)
        if (!out[i]) edges[kept++] = edges[i];
    edges.resize(kept);
}

}  // namespace

std::vector<PlaneEdge> edges_meeting_in_ends(const Loops& loops) {
    std::vector<PlaneEdge> edges;
    for (std::size_t l = 0; l < loops.size(); ++l) {
        const auto loop = loops.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i)
            edges.push_back({loop[i], loop[i + 1 < loop.size() ? i + 1 : 0]});
    }
    return edges_meeting_in_ends(std::move(edges));
}

std::vector<PlaneEdge> edges_meeting_in_ends(std::vector<PlaneEdge> edges) {
    make_unique(edges);
    constexpr int rounds = 4;
    for (int round = 0; round < rounds; ++round)
        if (edges.empty() || !divide(edges)) return edges;
    leave_out_crossing(edges);
    return edges;
}

}  // namespace slabwright
