#include "engine/paths/runs/flask_room.h"

#include <algorithm>

#include "engine/paths/runs/plan_view.h"

namespace slabwright {

namespace {

constexpr double kBeyond = 20;  // mm that the flask's region reaches past the stock

// A rectangle well past the stock and the tool's reach.
Loops around_stock(const LayerCut& cut, double r) {
    const auto &lo = cut.layer.stock_min, &hi = cut.layer.stock_max;
    const double beyond = 2 * r + kBeyond;
    return rectangle(lo[0] - beyond, lo[1] - beyond, hi[0] + beyond, hi[1] + beyond);
}

}  // namespace

Loops flask_room(const LayerCut& cut, double r) {
    return subtract(cut.layer.opening, offset(subtract(around_stock(cut, r), cut.layer.opening), r, 0.01));
}

Loops beyond_room(const LayerCut& cut, double r, const Loops& room) {
    return subtract(around_stock(cut, r), room);
}

Fibres beside_flask(const LayerCut& cut, const Loops& room, Fibres forbidden, Axis axis,
                    std::span<const std::int32_t> lines) {
    if (cut.layer.opening.empty()) return forbidden;
    // Along y, the room is looked at with its axes swapped, which turns its loops over.
    Loops turned;
    if (axis == Axis::y)
        for (std::size_t l = 0; l < room.size(); ++l) {
            const auto loop = room.loop(l);
            for (std::size_t k = loop.size(); k-- > 0;) turned.points.push_back({loop[k].y, loop[k].x});
            turned.close_loop();
        }
    const Loops& seen = axis == Axis::y ? turned : room;
    constexpr double far = 1e6;  // mm
    Fibres result;
    const std::vector<std::vector<Span>> inside =
        line_spans(seen, std::vector<double>(lines.begin(), lines.end()));
    for (std::size_t i = 0; i < lines.size(); ++i) {
        std::vector<Forbidden> all(forbidden.line(i).begin(), forbidden.line(i).end());
        double end = -far;
        for (const Span& s : inside[i]) {
            all.push_back({end, s.low / kUnitsPerMm, 0, 0});
            end = s.high / kUnitsPerMm;
        }
        all.push_back({end, far, 0, 0});
        std::sort(all.begin(), all.end(), [](const Forbidden& a, const Forbidden& b) {
            return a.low != b.low ? a.low < b.low : a.high < b.high;
        });
        for (const Forbidden& f : all) {
            if (result.intervals.size() > result.starts.back() && f.low < result.intervals.back().high) {
                Forbidden& last = result.intervals.back();
                if (f.high > last.high) last.high = f.high, last.nz_high = f.nz_high;
            } else {
                result.intervals.push_back(f);
            }
        }
        result.starts.push_back(static_cast<std::uint32_t>(result.intervals.size()));
    }
    return result;
}

}  // namespace slabwright
