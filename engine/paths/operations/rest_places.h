// Where a rest pass may put its cutter, and what it does there.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/paths/operations/line_directions.h"
#include "engine/paths/operations/rest.h"
#include "engine/paths/operations/rest_targets.h"
#include "kernels/cutting/drop.h"

namespace slabwright {

/// A place of the cutter on the surface.
struct RestPlace {
    std::int32_t x = 0, y = 0, z = 0;  // 0.1 µm
    std::int32_t along = 0;            // 0.1 µm, on its line
    double tip = 0;  // mm; of a ball's place that lies over all that stands near, that height: it lies as
                     // high or higher
    std::array<double, 3> contact{};  // mm, where `touches`: a point of the surface
    bool reachable = false, touches = false, useful = false, cut = false;
    bool stair = false;  // between two others it takes off a stair
};

/// Places of one cutter in one pass: how deep it goes, whether something is lowered there, whether places
/// between two are worth a look.
class RestPlaces {
public:
    RestPlaces(const LayerCut& cut, LayerStock& stock, const Tool& tool, const RestPass& pass);

protected:
    using Place = RestPlace;
    /// mm by which a flat end mill's tip may step between neighbouring places.
    static constexpr double kJump = 0.05;

    /// What a cell must lose, mm along the normal, for a place to be visited.
    [[nodiscard]] double worth(std::size_t cell) const;

    /// mm: what the pass has brought within this is no reason to go there again. Flats leave stairs on
    /// slopes: where they finish, more stands beside a cell's middle than there.
    [[nodiscard]] double enough() const { return (pass_.in_steps || ball_ ? 1 : 0.5) * pass_.limit; }

    /// Whether the cutter, here or up to `slack` mm beside, lowers a cell that is worth it.
    [[nodiscard]] bool lowers(double x, double y, double tip, double slack = 0) const;

    /// Whether the cutter stands clear of the flask, by the cell that its middle is in.
    [[nodiscard]] bool beside_flask(double x, double y) const;

    /// Notes the cells where the cutter stands clear of the flask.
    void find_room();

    /// @param high also where a ball lies over all that stands for it
    [[nodiscard]] Place place(std::int32_t ux, std::int32_t uy, MetPoints& met, bool high = false) const;

    /// The place on a line, 0.1 µm along it.
    [[nodiscard]] Place on_line(const LineDirection& direction, std::int32_t along, std::int32_t across,
                                MetPoints& met) const;

    /// No higher than a ball's tip anywhere in the rectangle from one place to another and `beside` (mm) to
    /// the sides of that way: where it touched at either of them keeps it up, the less the farther away it
    /// is, and nothing of a rectangle is farther away than one of its corners.
    [[nodiscard]] double lowest_between(const Place& a, const Place& b, double beside) const;

    /// Whether places between these two are worth a look, and `beside` (mm) to their sides.
    [[nodiscard]] bool too_far(const Place& a, const Place& b, double beside) const;

    /// Whether a ball would go over a corner from one place to the next (append) although places between them
    /// may do without.
    [[nodiscard]] bool too_steep(const Place& a, const Place& b) const;

    /// Where the cutter ends that slides down from a place until it rests on all sides; nowhere if that is
    /// farther off than it is wide, for what is left there is near places of its own.
    [[nodiscard]] Place slide(const Place& from) const;

    const LayerCut& cut_;
    LayerStock& stock_;
    const Tool& tool_;
    const RestPass& pass_;
    bool ball_;         // its tip is one
    double r_, tip_r_;  // mm: of the cutter, and of the ball that its tip is
    double wide_,
        under_;  // mm: the radius of the tip that is dropped, and how far it then lies under this one's
    CutterEnd end_;
    Envelope lowering_;  // of a cutter with a taper: what of it is deeper than the pass's skin
    RestTargets targets_;
    double tolerance_;  // mm of which chords and thinning take their shares: the gouge tolerance, or the
                        // allowance
    double chord_;
    std::int32_t step_, finest_, finest_step_;
    const DropIndex* index_ = nullptr;
    std::vector<char> room_;  // by the stock's cells, with a flask only
};

}  // namespace slabwright
