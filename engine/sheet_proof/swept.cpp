#include "engine/sheet_proof/swept.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace slabwright {

namespace {

constexpr double kChord = 0.0005;     ///< mm by which an axis may leave the chord that it is taken for
constexpr double kSameHalf = 0.001;   ///< mm by which halves of the kerf along a chord may differ
constexpr std::size_t kLongest = 16;  ///< pieces of an axis in one chord
constexpr double kOverlap =
    0.001;                  ///< mm by which chords reach into each other, so that nothing stays between
constexpr int kAround = 8;  ///< corners of each half circle, less one
constexpr double kSharp = std::numbers::pi / kAround;  ///< a turn that needs a round of its own

/// Straight pieces of the axis that are one within kChord.
struct Chord {
    AxisPoint from, to;
    double dx = 1, dy = 0;  ///< of length 1; any where the chord has no length
    double half = 0;        ///< mm: the greatest along it
    bool is_place = false;  ///< the axis stands, and its head may turn
};

/// The chord from one point to a later one. @param least the smallest half along it
Chord chord_of(std::span<const AxisPoint> axis, std::size_t from, std::size_t to, double kerf,
               double& least) {
    Chord chord{axis[from], axis[to]};
    const double x = chord.to.x - chord.from.x, y = chord.to.y - chord.from.y, l = std::hypot(x, y);
    chord.is_place = !(l > 1e-6);
    chord.half = least = kerf / 2;
    if (chord.is_place) return chord;
    chord.dx = x / l, chord.dy = y / l;
    chord.half = 0, least = 1e300;
    for (std::size_t i = from; i <= to; ++i) {
        const double half = kerf / 2 * std::hypot(1, axis[i].lean_x * chord.dy - axis[i].lean_y * chord.dx);
        chord.half = std::max(chord.half, half), least = std::min(least, half);
    }
    return chord;
}

/// Whether the points between run along the chord, none of them back.
bool runs_along(std::span<const AxisPoint> axis, std::size_t from, std::size_t to, const Chord& chord) {
    double last = 0;
    for (std::size_t i = from + 1; i <= to; ++i) {
        const double x = axis[i].x - chord.from.x, y = axis[i].y - chord.from.y;
        const double along = x * chord.dx + y * chord.dy;
        if (std::abs(x * chord.dy - y * chord.dx) > kChord || along < last - kChord) return false;
        last = along;
    }
    return true;
}

std::vector<Chord> chords_of(std::span<const AxisPoint> axis, double kerf) {
    std::vector<Chord> chords;
    double least = 0;
    for (std::size_t i = 0; i + 1 < axis.size();) {
        std::size_t end = i + 1;
        Chord chord = chord_of(axis, i, end, kerf, least);
        while (end + 1 < axis.size() && end - i < kLongest) {
            const Chord longer = chord_of(axis, i, end + 1, kerf, least);
            if (longer.half - least > kSameHalf || !runs_along(axis, i, end + 1, longer)) break;
            chord = longer;
            ++end;
        }
        chords.push_back(chord);
        i = end;
    }
    return chords;
}

/// By how much the axis turns from one chord to the next, to the left over 0.
double turn_between(const Chord& a, const Chord& b) {
    if (a.is_place || b.is_place) return std::numbers::pi;
    return std::atan2(a.dx * b.dy - a.dy * b.dx, a.dx * b.dx + a.dy * b.dy);
}

/// The outline of what one chord takes. An end with a sharp turn is round; one with a turn that is none has a
/// corner on the outer side where the next chord's begins.
void append_outline(const Chord& c, double turn_before, double turn_after, Loops& loops) {
    const auto put = [&](const AxisPoint& at, double ahead, double angle) {
        loops.points.push_back(unit_point(at.x + ahead * c.dx + c.half * std::cos(angle),
                                          at.y + ahead * c.dy + c.half * std::sin(angle)));
    };
    const double left = std::atan2(c.dx, -c.dy);  // the left normal
    const auto put_round = [&](const AxisPoint& at, double first) {
        for (int k = 0; k <= kAround; ++k) put(at, 0, first + std::numbers::pi * k / kAround);
    };
    if (std::abs(turn_before) > kSharp) {
        put_round(c.from, left);
    } else {
        put(c.from, -kOverlap, left);
        put(c.from, -kOverlap, left + std::numbers::pi);
    }
    if (std::abs(turn_after) > kSharp) {
        put_round(c.to, left + std::numbers::pi);
    } else {
        const double right = left + std::numbers::pi;
        put(c.to, kOverlap, right);
        if (turn_after > 0) put(c.to, kOverlap, right + turn_after);
        if (turn_after < 0) put(c.to, kOverlap, left + turn_after);
        put(c.to, kOverlap, left);
    }
    loops.close_loop();
}

/// What chords take, put together from halves: clipping is slow where many outlines lie one over the other,
/// as they do where a head turns in one place.
Loops taken_by(std::span<const Chord> chords, std::span<const double> turns) {
    constexpr std::size_t at_once = 24;
    if (chords.size() > at_once) {
        const std::size_t half = chords.size() / 2;
        return unite(taken_by(chords.first(half), turns.first(half + 1)),
                     taken_by(chords.subspan(half), turns.subspan(half)));
    }
    Loops loops;
    for (std::size_t i = 0; i < chords.size(); ++i) append_outline(chords[i], turns[i], turns[i + 1], loops);
    return unite(loops, {});
}

}  // namespace

Loops swept(std::span<const AxisPoint> axis, double kerf) {
    const std::vector<Chord> chords = chords_of(axis, kerf);
    if (chords.empty()) return {};
    std::vector<double> turns{std::numbers::pi};  // before each chord, and after the last
    for (std::size_t i = 0; i + 1 < chords.size(); ++i)
        turns.push_back(turn_between(chords[i], chords[i + 1]));
    turns.push_back(std::numbers::pi);
    return taken_by(chords, turns);
}

ReadHead unplaced(const ReadHead& head, const ReadPiece& piece) {
    const double x = head.x - piece.x, y = head.y - piece.y;
    switch (((piece.turn % 360) + 360) % 360) {
        case 90:
            return {y, -x, head.a, head.c - 90};
        case 180:
            return {-x, -y, head.a, head.c - 180};
        case 270:
            return {-y, x, head.a, head.c - 270};
        default:
            return {x, y, head.a, head.c};
    }
}

}  // namespace slabwright
