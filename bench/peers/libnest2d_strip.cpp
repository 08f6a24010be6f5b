#define LIBNEST2D_GEOMETRIES_clipper
#define LIBNEST2D_OPTIMIZER_nlopt
#define LIBNEST2D_THREADING_std
#include "bench/peers/libnest2d_strip.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <libnest2d/libnest2d.hpp>

PeerStrip pack_by_libnest2d(const std::vector<PeerPolygon>& pieces, std::int64_t width,
                            const std::vector<int>& turns, bool along_strip) {
    using namespace libnest2d;
    std::vector<Item> items;
    for (const PeerPolygon& piece : pieces) {
        PolygonImpl shape;
        for (const auto& p : piece) shape.Contour.push_back({p[0], p[1]});
        std::reverse(shape.Contour.begin(), shape.Contour.end());  // it wants them clockwise and closed
        shape.Contour.push_back(shape.Contour.front());
        items.emplace_back(shape);
    }
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
    std::int64_t x0 = INT64_MAX, y0 = INT64_MAX;
    for (const Item& item : items)
        for (const auto& p : item.transformedShape().Contour)
            x0 = std::min<std::int64_t>(x0, p.X), y0 = std::min<std::int64_t>(y0, p.Y);
    for (const Item& item : items) {
        strip.fits = strip.fits && item.binId() == 0;
        PeerPolygon piece;
        for (const auto& p : item.transformedShape().Contour) piece.push_back({p.X - x0, p.Y - y0});
        piece.pop_back();
        std::reverse(piece.begin(), piece.end());
        strip.pieces.push_back(std::move(piece));
    }
    return strip;
}
