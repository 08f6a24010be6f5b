#include "engine/sheet_proof/common_place.h"

#include <algorithm>
#include <array>

#include "kernels/polygons/pieces.h"

namespace slabwright {

bool have_common_place(const Loops& a, const Loops& b) {
    Box2 box_a, box_b;
    for (const Point2 p : a.points) box_a.grow(p);
    for (const Point2 p : b.points) box_b.grow(p);
    if (a.empty() || b.empty() || !box_a.meets(box_b)) return false;
    const double low = std::max(box_a.min.y, box_b.min.y), high = std::min(box_a.max.y, box_b.max.y);
    std::array<double, 7> lines{};
    for (std::size_t i = 0; i < lines.size(); ++i)
        lines[i] = low + (high - low) * (double(i) + 0.5) / double(lines.size());
    const auto in_a = line_spans(a, lines), in_b = line_spans(b, lines);
    for (std::size_t i = 0; i < lines.size(); ++i)
        for (std::size_t p = 0, q = 0; p < in_a[i].size() && q < in_b[i].size();) {
            const Span &s = in_a[i][p], &t = in_b[i][q];
            if (std::min(s.high, t.high) - std::max(s.low, t.low) > 10) return true;  // units: 1 um
            if (s.high < t.high) ++p;
            else ++q;
        }
    return !intersect(a, b).empty();
}

}  // namespace slabwright
