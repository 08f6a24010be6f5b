#include "kernels/polygons/pieces.h"

#include <algorithm>

namespace slabwright {

namespace {

void append_loop(std::span<const Point2> loop, Loops& to) {
    to.points.insert(to.points.end(), loop.begin(), loop.end());
    to.close_loop();
}

Box2 box_of(std::span<const Point2> points) {
    Box2 box;
    for (const Point2 p : points) box.grow(p);
    return box;
}

}  // namespace

void append_loops(const Loops& loops, Loops& to) {
    for (std::size_t i = 0; i < loops.size(); ++i) append_loop(loops.loop(i), to);
}

Pieces::Pieces(const Loops& region) {
    Loops nested = region;
    if (nested.parents.size() != nested.size()) nest(nested);
    std::vector<std::size_t> piece_of(nested.size(), 0);
    for (std::size_t i = 0; i < nested.size(); ++i)
        if (signed_area(nested.loop(i)) > 0) {
            piece_of[i] = regions.size();
            regions.emplace_back();
            boxes.push_back(box_of(nested.loop(i)));
            append_loop(nested.loop(i), regions.back());
        }
    for (std::size_t i = 0; i < nested.size(); ++i)
        if (signed_area(nested.loop(i)) < 0 && nested.parents[i] >= 0)
            append_loop(nested.loop(i), regions[piece_of[static_cast<std::size_t>(nested.parents[i])]]);
}

Loops Pieces::within(const Loops& region, const Box2& box) const {
    Loops near;
    for (std::size_t i = 0; i < size(); ++i)
        if (boxes[i].meets(box)) append_loops(regions[i], near);
    return near.empty() ? near : intersect(near, region);
}

}  // namespace slabwright
