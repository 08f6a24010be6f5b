// Puts moves one after another into an operation: rapids only above the stock, down by feed.
#pragma once

#include <span>

#include "engine/plan.h"

namespace slabwright {

class PathBuilder {
public:
    /// @param clearance_z where the program begins and ends, mm
    /// @param link_z      above all standing stock, mm: rapids between cuts run here
    PathBuilder(Operation& operation, const Tool& tool, double feed, double clearance_z, double link_z);

    /// Rapid to above (x, y), if not there already (0.1 µm).
    void go_above(Point2 at);
    /// Straight down (or up) by plunge feed to z.
    void plunge(std::int32_t z);
    /// Fast down to z through air that is known to be empty: space already cut, or beside the stock. Still by feed.
    void sink(std::int32_t z);
    /// Cuts to a point.
    void cut(Point2 to, std::int32_t z);
    /// Up to the link height.
    void retract();
    /// Ends the program; drops it when nothing was cut. Returns whether something was.
    bool finish();

    [[nodiscard]] bool is_down() const { return down_; }
    [[nodiscard]] Point2 at() const { return {x_, y_}; }
    [[nodiscard]] std::int32_t z() const { return z_; }

private:
    void add(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t feed);
    Operation& operation_;
    std::uint32_t feed_, plunge_feed_, sink_feed_;
    std::int32_t clearance_, link_;
    std::int32_t x_ = 0, y_ = 0, z_ = 0;
    bool started_ = false, down_ = false;
};

/// Leaves out points of a polyline that lie within `tolerance` (0.1 µm units) of the chord between kept ones
/// (Ramer–Douglas–Peucker in three dimensions). First and last stay. Every point of the result lies within `tolerance`
/// of the polyline given.
struct PathPoint {
    std::int32_t x = 0, y = 0, z = 0;
    friend bool operator==(const PathPoint&, const PathPoint&) = default;
};
[[nodiscard]] std::vector<PathPoint> simplify(std::span<const PathPoint> line, double tolerance);

}  // namespace slabwright
