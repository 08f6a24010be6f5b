#define LIBNEST2D_GEOMETRIES_clipper
#define LIBNEST2D_OPTIMIZER_nlopt
#define LIBNEST2D_THREADING_std
#include "bench/peers/libnest2d_strip.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <libnest2d/libnest2d.hpp>

namespace {

/// Counter-clockwise, by a monotone chain from left to right and back.
PeerPolygon hull_of(PeerPolygon points) {
    std::sort(points.begin(), points.end());
    PeerPolygon hull;
    const auto add = [&](const std::array<std::int64_t, 2>& p, std::size_t least) {
        const auto turns_left = [&] {
            const auto &a = hull[hull.size() - 2], &b = hull.back();
            return (b[0] - a[0]) * (p[1] - a[1]) > (b[1] - a[1]) * (p[0] - a[0]);
        };
        while (hull.size() > least && !turns_left()) hull.pop_back();
        hull.push_back(p);
    };
    for (const auto& p : points) add(p, 1);
    const std::size_t lower = hull.size();
    for (auto p = points.rbegin() + 1; p != points.rend(); ++p) add(*p, lower);
    hull.pop_back();
    return hull;
}

/// It wants them clockwise and closed.
libnest2d::Item item_of(const PeerPolygon& piece) {
    libnest2d::PolygonImpl shape;
    for (const auto& p : piece) shape.Contour.push_back({p[0], p[1]});
    std::reverse(shape.Contour.begin(), shape.Contour.end());
    shape.Contour.push_back(shape.Contour.front());
    return libnest2d::Item(shape);
}

}  // namespace

PeerStrip pack_by_libnest2d(const std::vector<PeerPolygon>& pieces, std::int64_t width,
                            const std::vector<int>& turns, bool along_strip, bool as_hulls) {
    using namespace libnest2d;
    std::vector<Item> items;
    for (const PeerPolygon& piece : pieces) items.push_back(item_of(as_hulls ? hull_of(piece) : piece));
    NfpPlacer::Config config;
    config.rotations.clear();
    for (const int turn : turns) config.rotations.push_back(Radians(turn * Pi / 180));
    if (along_strip) {
        config.alignment = config.starting_point = NfpPlacer::Config::Alignment::BOTTOM_LEFT;
        config.object_function = [](const Item& item) {
            const auto box = item.boundingBox();
            return double(getY(box.maxCorner())) + 1e-3 * double(getX(box.maxCorner()));
        };
    }
    PeerStrip strip;
    const auto begin = std::chrono::steady_clock::now();
    nest(items, Box(width, 200000000), 0, NestConfig<NfpPlacer, FirstFitSelection>(config));
    strip.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::vector<Item> lying;  // the pieces themselves where their items were laid
    for (std::size_t i = 0; i < items.size(); ++i) {
        strip.fits = strip.fits && items[i].binId() == 0;
        lying.push_back(item_of(pieces[i]));
        lying.back().rotation(items[i].rotation());
        lying.back().translation(items[i].translation());
    }
    std::int64_t x0 = INT64_MAX, y0 = INT64_MAX;
    for (const Item& item : lying)
        for (const auto& p : item.transformedShape().Contour)
            x0 = std::min<std::int64_t>(x0, p.X), y0 = std::min<std::int64_t>(y0, p.Y);
    for (const Item& item : lying) {
        PeerPolygon piece;
        for (const auto& p : item.transformedShape().Contour) piece.push_back({p.X - x0, p.Y - y0});
        piece.pop_back();
        std::reverse(piece.begin(), piece.end());
        strip.pieces.push_back(std::move(piece));
    }
    return strip;
}
