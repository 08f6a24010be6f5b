// The places that a program can name: whole steps of its last decimal. What a plan has in 0.1 µm is rounded
// to them once, here, for the text and for what plan.json says of it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/moves/feed_lengths.h"
#include "io/posts/dialect.h"
#include "io/text/decimal.h"

namespace slabwright {

class ProgramGrid {
public:
    explicit ProgramGrid(const Dialect& dialect);

    /// Whether its steps are the plan's own, 0.1 µm: nothing is rounded.
    [[nodiscard]] bool exact() const { return exact_; }
    /// Whether arcs are written by their radius.
    [[nodiscard]] bool by_radius() const { return dialect_->radius_arcs; }
    /// The nearest step to a place in 0.1 µm, halves away from zero: off by half a step at most.
    [[nodiscard]] std::int64_t steps(std::int64_t units) const { return exact_ ? units : rounded(units); }
    /// Where a step lies, mm.
    [[nodiscard]] double mm(std::int64_t steps) const;
    [[nodiscard]] double mm(double steps) const;
    /// Appends a place as the dialect spells it: "-1.25", "29." where points are needed, "+29" for
    /// HEIDENHAIN.
    void append(std::string& text, std::int64_t steps) const {
        if (plain_) append_mm(text, steps);
        else append_spelled(text, steps);
    }
    /// A feed in mm/min, as F says it.
    [[nodiscard]] std::string feed(std::uint32_t mm_min) const;
    /// A length in mm that is no place: to four decimals, in inch to six and never more than it is.
    [[nodiscard]] std::string length(double mm) const;

private:
    [[nodiscard]] std::int64_t rounded(std::int64_t units) const;
    void append_spelled(std::string& text, std::int64_t steps) const;
    const Dialect* dialect_;
    bool exact_, plain_;     // plain: exact, and spelled as everywhere
    std::int64_t per_unit_;  // steps of a mm or inch
};

/// A move as it is written: rounded to the grid.
struct WrittenMove {
    std::int64_t x = 0, y = 0, z = 0;                                                ///< steps
    std::int64_t cx = 0, cy = 0;                                                     ///< of an arc's centre
    enum class Kind { none, line, clockwise, counter_clockwise } kind = Kind::none;  ///< none: it stays there
};

/// An arc, or half of one, as a line with R says it.
struct RadiusArc {
    std::int64_t x = 0, y = 0;  ///< its end, steps
    std::int64_t radius = 0;    ///< steps
    double cx = 0, cy = 0;      ///< where a reader finds the centre, steps
};

/// A written arc by radius, steps. One that turns by more than 100 degrees comes in two halves: the nearer an
/// arc is to half a circle, the further the last decimal of its radius moves the centre.
/// @param x,y where it begins
[[nodiscard]] std::vector<RadiusArc> radius_arcs(std::int64_t x, std::int64_t y, const WrittenMove& arc);

/// What a program's coordinates count from, 0.1 µm, pattern-base.
struct ProgramOrigin {
    std::int64_t x = 0, y = 0, z = 0;
};

/// Rounds an operation's moves one after another.
class WrittenMoves {
public:
    WrittenMoves(const ProgramGrid& grid, const ProgramOrigin& origin) : grid_(grid), origin_(origin) {}

    /// Takes up a height; x and y stay as they are.
    std::int64_t height(std::int64_t z_units);
    /// An arc whose rounded ends are less than ten steps apart is a line: by then rounding could turn it into
    /// a full circle.
    WrittenMove next(const Move& to);

private:
    const ProgramGrid& grid_;
    ProgramOrigin origin_;
    bool known_ = false;                  // x and y are
    std::int64_t ux_ = 0, uy_ = 0;        // 0.1 µm
    std::int64_t x_ = 0, y_ = 0, z_ = 0;  // steps
};

/// What plan.json says of a program: feed_lengths() of the moves as the dialect writes them.
/// @param origin as for WrittenMoves; places are pattern-base all the same
[[nodiscard]] std::vector<FeedLength> written_feed_lengths(const Dialect& dialect,
                                                           std::span<const Move> moves,
                                                           const ProgramOrigin& origin);

/// What the programs of a layer count from: machine.zero in x and y, machine.frame in z.
[[nodiscard]] ProgramOrigin program_origin(const Plan& plan, const Layer& layer);

}  // namespace slabwright
