// Where a rest pass goes: a raster of drops over what is left, refined where the cutter's rest jumps and
// something stands that could be lowered there, and finer lines over what coarser ones leave. So a wide rest
// is cleared by an even raster, and a corner by the few places along it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/paths/operations/line_directions.h"
#include "engine/paths/operations/rest_places.h"

namespace slabwright {

/// Places one after the other. Those that were found off all lines are lines by themselves.
struct RestLine {
    std::size_t direction = 0;  // of LineDirections
    std::int32_t across = 0;    // 0.1 µm
    std::vector<RestPlace> places;
};

/// Lays the lines of one pass: those places have cut that lower the stock, in the order in which they are
/// laid.
class RestLines : protected RestPlaces {
public:
    using RestPlaces::RestPlaces;

protected:
    /// Lays them; the stock stands as before.
    void lay();

    /// 0.1 µm in plan.
    static double apart(const RestPlace& a, const RestPlace& b);

    std::int32_t spacing_ = 0;  // 0.1 µm, of the even raster
    std::vector<RestLine> lines_;

private:
    // The cutter, thicker all around by what is kept off walls; a flat end mill on its side alone.
    [[nodiscard]] CutterShape dropped() const;

    void append_between(RestLine& line, RestPlace b, MetPoints& met) const;

    [[nodiscard]] RestPlace on(const RestLine& line, std::int32_t along, MetPoints& met) const;

    static const RestPlace* at(const RestLine& line, std::int32_t along);

    // In each direction an even raster over its targets, then lines between its lines where the rest jumps
    // from one to the next.
    void lay_lines();

    [[nodiscard]] std::vector<RestLine> even_lines(std::size_t direction) const;

    // What the lines so far leave decides where the next ones go.
    void lay_between(std::vector<RestLine>& lines);

    // Whether a line ends at a place of a flat end mill, or is stopped by a wall there, short of something
    // that stands: in a channel that narrows a line between it and the next goes on.
    [[nodiscard]] bool ends(const RestPlace& p, const RestLine& line) const;

    // How steeply the places of a line rise about one of them.
    [[nodiscard]] double rise_along(const RestLine& line, const RestPlace& p) const;

    // A flat end mill that finishes leaves stairs on slopes along its lines, which may be narrower than a
    // cell: whether there is one over the limit between a place and one of another line, of which the higher
    // has cut, and the lower too, or stands at the slope's foot. Lines that go up or down the slope pass the
    // other's height where they come nearer to the stair, to the ridge between two circles.
    [[nodiscard]] bool leaves_stair(const RestPlace& a, const RestPlace& b, double along) const;

    // Places that no cell has called for cut, too, where those of lines beside them leave a stair.
    void cut_stairs(std::vector<RestLine>& lines);

    // Of steps along a line those in rows as long as stairs are that cells may not see.
    void keep_rows(std::vector<std::int32_t>& steps) const;

    // The lines in their order across, each direction's by themselves.
    static std::vector<std::size_t> by_place(const std::vector<RestLine>& lines);

    // Across from a line of `ranked`, up to the next of the even raster, for lines between may not come by
    // here: the first place there that is wanted, or the last that is not.
    [[nodiscard]] const RestPlace* place_beside(const std::vector<RestLine>& lines,
                                                const std::vector<std::size_t>& ranked, std::size_t rank,
                                                bool after, std::int32_t along,
                                                bool (*is_wanted)(const RestPlace&)) const;

    // A line between two, over what is too far from one to the other; without places where nothing is.
    [[nodiscard]] RestLine middle(const RestLine& a, const RestLine& b) const;

    // Where the cutter sinks deepest between walls (a slot hardly wider than itself, a hole narrower, the
    // meeting of three faces) no raster hits the place: from where a line, or the lines beside it, are higher
    // on both sides it slides down to where it rests on all sides. What lies in a row is travelled as a line.
    void settle();

    // A slot so narrow that the raster's places on both sides of it stand on its walls' tops, which are
    // level, shows nowhere. Where much is left, a flat end mill is held with its rim over it, all around, and
    // slides down from where it is lowest. A ball slides from over what is left: where its places on a slot's
    // walls lie over all that still stands, the raster has not looked at them.
    void probe();

    // What a place no longer lowers after those before it is not visited.
    void keep_what_lowers(std::vector<RestLine>& lines);

    std::optional<LineDirections> directions_;
};

}  // namespace slabwright
