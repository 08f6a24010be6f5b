// A strip packed by libnest2d, without a type of its own: its headers are C++17 at most.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

/// Corners of a polygon, counter-clockwise, in 0.1 µm.
using PeerPolygon = std::vector<std::array<std::int64_t, 2>>;

struct PeerStrip {
    double seconds = 0;               ///< that the packing took
    bool fits = true;                 ///< all pieces lie on the one strip
    std::vector<PeerPolygon> pieces;  ///< where they lie
};

/// @param width of the strip along x, 0.1 µm; along y it has 20 m
/// @param turns in degrees. @param along_strip pieces lie as far back on the strip as they go; otherwise by
/// libnest2d's own rule
/// @param as_hulls pieces keep clear of each other by their convex hulls: it lays other pieces one over the
/// other
PeerStrip pack_by_libnest2d(const std::vector<PeerPolygon>& pieces, std::int64_t width,
                            const std::vector<int>& turns, bool along_strip, bool as_hulls);
