#include "engine/paths/operations/rest_lines.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kSettle = 0.01;     // mm by which a low point of a line lies under its neighbours
constexpr float kMuch = 0.25F;       // mm left that are worth a search for a place (probe)
constexpr double kProbed = 1.0;      // mm: of squares of this side one cell is
constexpr int kProbes = 32;          // places around it
constexpr double kStair = 1.25;      // of the limit, the least that is searched for between lines
constexpr double kLeastStair = 1.5;  // mm along it
constexpr double kSteepestFoot = 3;  // slope up from its foot, where stairs are searched for

}  // namespace

void RestLines::lay() {
    find_room();
    index_ = &cut_.drops(dropped());
    directions_.emplace(cut_.context, stock_.grid(), targets_.all_rows(), r_);
    LayerStock::Trial places(stock_);
    lay_lines();
    settle();
    if (!pass_.followed && !(pass_.allowance > 0))
        probe();  // the pass after one that keeps off the walls is the one for narrow slots
    places.undo();
}

CutterShape RestLines::dropped() const {
    if (!ball_) return flat_cutter(wide_);
    if (!has_taper(tool_.kind)) return ball_cutter(wide_);
    return {r_ + pass_.allowance, wide_, cutter_shape(tool_).taper_rad};
}

void RestLines::append_between(RestLine& line, Place b, MetPoints& met) const {
    std::vector<Place>& places = line.places;
    if (!places.empty() && b.along - places.back().along <= step_ &&
        b.along - places.back().along > 2 * finest_ &&
        (too_far(places.back(), b, 0) || too_steep(places.back(), b))) {
        const std::int32_t from = places.back().along;
        append_between(line, on(line, from + (b.along - from) / 2, met), met);
        append_between(line, b, met);
        return;
    }
    places.push_back(b);
}

RestPlace RestLines::on(const RestLine& line, std::int32_t along, MetPoints& met) const {
    return on_line(directions_->all()[line.direction], along, line.across, met);
}

const RestPlace* RestLines::at(const RestLine& line, std::int32_t along) {
    const auto it = std::lower_bound(line.places.begin(), line.places.end(), along,
                                     [](const Place& p, std::int32_t v) { return p.along < v; });
    return it != line.places.end() && it->along == along ? &*it : nullptr;
}

void RestLines::lay_lines() {
    spacing_ = std::max(1, to_units(pass_.in_steps ? 0.7 * tip_r_
                                    : ball_        ? std::sqrt(8 * tip_r_ * cut_.job.tolerances.cusp)
                                                   : std::min(1.0, r_ / 4)));
    for (std::size_t d = 0; d < directions_->all().size(); ++d) {
        std::vector<RestLine> lines = even_lines(d);
        keep_what_lowers(lines);
        lay_between(lines);
        for (RestLine& line : lines) lines_.push_back(std::move(line));
    }
}

std::vector<RestLine> RestLines::even_lines(std::size_t direction) const {
    std::vector<RestLine> even;
    const auto [lowest, highest] = directions_->across(direction);
    if (lowest > highest) return even;
    const std::array<double, 2> x{cut_.low(0, r_), cut_.high(0, r_)}, y{cut_.low(1, r_), cut_.high(1, r_)};
    const auto within = [&](const RestLine& line) {
        return directions_->all()[direction].within(to_mm(line.across), x, y);
    };
    const auto low = static_cast<std::int32_t>(std::floor((lowest - r_) * kUnitsPerMm / spacing_)),
               high = static_cast<std::int32_t>(std::ceil((highest + r_) * kUnitsPerMm / spacing_));
    for (std::int32_t k = low; k <= high; ++k) {
        RestLine line{direction, k * spacing_, {}};
        if (const auto ends = within(line); ends[0] <= ends[1]) even.push_back(std::move(line));
    }
    // A place that helps may lie between the last line that covers a target and the next, which is looked
    // at only where both have places.
    const double covers = pass_.in_steps ? r_ : r_ + to_mm(spacing_);
    parallel_each(cut_.context, even.size(), [&](std::size_t l) {
        RestLine& line = even[l];
        MetPoints met;
        for (const auto& span : directions_->around(direction, to_mm(line.across), covers, within(line))) {
            const std::int32_t from = (span[0] >= 0 ? span[0] / step_ : -((-span[0] + step_ - 1) / step_)),
                               to = span[1] / step_ + 1;
            for (std::int32_t k = from; k <= to; ++k) {
                if (!line.places.empty() && k * step_ <= line.places.back().along) continue;
                append_between(line, on(line, k * step_, met), met);
            }
        }
    });
    return even;
}

void RestLines::lay_between(std::vector<RestLine>& lines) {
    std::vector<std::array<std::size_t, 2>> neighbours;
    for (std::size_t l = 0; l + 1 < lines.size(); ++l) neighbours.push_back({l, l + 1});
    while (!neighbours.empty()) {
        cut_stairs(lines);
        std::vector<RestLine> middles(neighbours.size());
        parallel_each(cut_.context, neighbours.size(), [&](std::size_t n) {
            middles[n] = middle(lines[neighbours[n][0]], lines[neighbours[n][1]]);
        });
        keep_what_lowers(middles);
        std::vector<std::array<std::size_t, 2>> next;
        for (std::size_t n = 0; n < neighbours.size(); ++n) {
            if (middles[n].places.empty()) continue;
            next.push_back({neighbours[n][0], lines.size()});
            next.push_back({lines.size(), neighbours[n][1]});
            lines.push_back(std::move(middles[n]));
        }
        neighbours = std::move(next);
    }
}

bool RestLines::ends(const Place& p, const RestLine& line) const {
    if (ball_ || !p.reachable) return false;
    const auto goes_on = [&](std::int32_t along) {
        const Place* next = at(line, along);
        return next && next->tip <= p.tip + kJump;
    };
    return !(goes_on(p.along - step_) && goes_on(p.along + step_)) &&
           lowers(to_mm(p.x), to_mm(p.y), p.tip, to_mm(step_));
}

double RestLines::rise_along(const RestLine& line, const Place& p) const {
    const Place *before = at(line, p.along - step_), *after = at(line, p.along + step_);
    if (!before || !before->reachable) before = &p;
    if (!after || !after->reachable) after = &p;
    return before == after ? 0 : (after->tip - before->tip) / to_mm(after->along - before->along);
}

bool RestLines::leaves_stair(const Place& a, const Place& b, double along) const {
    if (ball_ || pass_.in_steps || !a.reachable || !b.reachable) return false;
    const Place &low = a.tip < b.tip ? a : b, &high = a.tip < b.tip ? b : a;
    const double rise = high.tip - low.tip, far = to_mm(std::lround(apart(a, b)));
    if (!high.cut || !(low.cut || rise <= kSteepestFoot * far)) return false;
    if (rise * far <= kStair * pass_.limit * std::hypot(rise, far)) return false;
    const double half = std::hypot(far, rise / along) / 2;  // of the way to the same height
    if (!(half < r_)) return true;
    const double slope = std::hypot(rise / far, along);
    return (r_ - std::sqrt(r_ * r_ - half * half)) * slope / std::hypot(1, slope) > kStair * pass_.limit;
}

void RestLines::cut_stairs(std::vector<RestLine>& lines) {
    if (ball_ || pass_.in_steps) return;
    const std::vector<std::size_t> ranked = by_place(lines);
    const auto beside = [&](std::size_t rank, bool after, std::int32_t along) {
        return place_beside(lines, ranked, rank, after, along, [](const Place& p) { return p.cut; });
    };
    for (std::size_t rank = 0; rank < ranked.size(); ++rank) {
        RestLine& line = lines[ranked[rank]];
        std::vector<std::int32_t> stairs;
        for (const Place& p : line.places) {
            if (p.along % step_ != 0) continue;
            const Place* before = beside(rank, false, p.along);
            const Place* after = before ? beside(rank, true, p.along) : nullptr;
            if (after && leaves_stair(*before, *after, rise_along(line, p)) &&
                p.tip > std::min(before->tip, after->tip) && p.tip < std::max(before->tip, after->tip))
                stairs.push_back(p.along);
        }
        keep_rows(stairs);
        for (Place& p : line.places) {
            if (p.cut || !p.reachable || !std::binary_search(stairs.begin(), stairs.end(), p.along)) continue;
            p.cut = true;
            stock_.cut_at(end_, to_mm(p.x), to_mm(p.y), p.tip);
        }
    }
}

void RestLines::keep_rows(std::vector<std::int32_t>& steps) const {
    std::size_t kept = 0;
    for (std::size_t first = 0, last = 0; first < steps.size(); first = last + 1) {
        for (last = first; last + 1 < steps.size() && steps[last + 1] == steps[last] + step_;) ++last;
        if (steps[last] - steps[first] < to_units(kLeastStair)) continue;
        for (std::size_t k = first; k <= last; ++k) steps[kept++] = steps[k];
    }
    steps.resize(kept);
}

std::vector<std::size_t> RestLines::by_place(const std::vector<RestLine>& lines) {
    std::vector<std::size_t> ranked(lines.size());
    std::iota(ranked.begin(), ranked.end(), std::size_t{0});
    std::sort(ranked.begin(), ranked.end(), [&](std::size_t a, std::size_t b) {
        return std::tuple(lines[a].direction, lines[a].across, a) <
               std::tuple(lines[b].direction, lines[b].across, b);
    });
    return ranked;
}

const RestPlace* RestLines::place_beside(const std::vector<RestLine>& lines,
                                         const std::vector<std::size_t>& ranked, std::size_t rank, bool after,
                                         std::int32_t along, bool (*is_wanted)(const Place&)) const {
    const RestLine& from = lines[ranked[rank]];
    const Place* last = nullptr;
    for (std::size_t k = rank; after ? k + 1 < ranked.size() : k > 0;) {
        const RestLine& line = lines[ranked[after ? ++k : --k]];
        if (line.direction != from.direction || std::abs(line.across - from.across) > spacing_) break;
        if (const Place* p = at(line, along)) last = p;
        if (last && is_wanted(*last)) break;
    }
    return last;
}

RestLine RestLines::middle(const RestLine& a, const RestLine& b) const {
    RestLine line{a.direction, a.across + (b.across - a.across) / 2, {}};
    if (b.across - a.across < 2 * finest_) return line;
    std::vector<std::int32_t> over, stairs;
    for (const Place& p : a.places) {
        if (p.along % step_ != 0) continue;
        const Place* other = at(b, p.along);
        if (other && leaves_stair(p, *other, rise_along(a, p))) stairs.push_back(p.along);
        if ((other && too_far(p, *other, to_mm(step_) / 2)) || ends(p, a)) over.push_back(p.along);
    }
    for (const Place& p : b.places)
        if (p.along % step_ == 0 && ends(p, b)) over.push_back(p.along);
    keep_rows(stairs);
    over.insert(over.end(), stairs.begin(), stairs.end());
    std::sort(over.begin(), over.end());
    MetPoints met;
    for (const std::int32_t middle : over)
        for (const std::int32_t along : {middle - step_, middle, middle + step_})
            if (line.places.empty() || along > line.places.back().along)
                append_between(line, on(line, along, met), met);
    for (Place& p : line.places) p.stair = std::binary_search(stairs.begin(), stairs.end(), p.along);
    return line;
}

void RestLines::settle() {
    const std::vector<std::size_t> ranked = by_place(lines_);
    // A place past a wall's foot that only the layer's bottom keeps as high is no wall.
    auto higher = [&](const Place* beside, const Place& p) {
        return beside && (beside->touches || !beside->reachable) && p.tip < beside->tip - kSettle;
    };
    const auto beside = [&](std::size_t rank, bool after, std::int32_t along) {
        return place_beside(lines_, ranked, rank, after, along, [](const Place&) { return true; });
    };
    std::vector<std::vector<RestLine>> found(lines_.size());
    parallel_each(cut_.context, lines_.size(), [&](std::size_t rank) {
        const std::size_t l = ranked[rank];
        const std::vector<Place>& places = lines_[l].places;
        for (std::size_t i = 0; i < places.size(); ++i) {
            const Place& p = places[i];
            if (!p.reachable) continue;
            const bool in_line = i > 0 && i + 1 < places.size() &&
                                 places[i + 1].along - places[i - 1].along <= 2 * step_ &&
                                 higher(&places[i - 1], p) && higher(&places[i + 1], p);
            const bool across = !in_line && p.along % step_ == 0 && higher(beside(rank, false, p.along), p) &&
                                higher(beside(rank, true, p.along), p);
            if (!in_line && !across) continue;
            const Place low = slide(p);
            if (!low.useful) continue;
            std::vector<RestLine>& lines = found[l];
            if (!lines.empty() && apart(lines.back().places.back(), low) <= chord_ * kUnitsPerMm)
                lines.back().places.push_back(low);
            else lines.push_back({0, 0, {low}});
        }
    });
    std::vector<RestLine> all;
    for (std::size_t rank = 0; rank < ranked.size(); ++rank)
        for (RestLine& line : found[ranked[rank]]) all.push_back(std::move(line));
    keep_what_lowers(all);
    for (RestLine& line : all) lines_.push_back(std::move(line));
}

void RestLines::probe() {
    const std::array<int, 2> rows = targets_.rows();
    const int first = rows[0], last = rows[1];
    if (first > last) return;
    const CellGrid& grid = stock_.grid();
    const int side =
        std::max(1, static_cast<int>(kProbed / grid.cell));  // cells of a square, of which one is probed
    const double much = std::max(double{kMuch}, pass_.limit);
    const double beside = r_ - 0.7 * grid.cell, x_low = cut_.low(0, r_), x_high = cut_.high(0, r_),
                 y_low = cut_.low(1, r_), y_high = cut_.high(1, r_);
    std::vector<std::vector<RestLine>> found(static_cast<std::size_t>((last - first) / side + 1));
    parallel_each(cut_.context, found.size(), [&](std::size_t b) {
        cut_.context.throw_if_cancelled();
        std::vector<std::array<int, 2>> cells;  // one of each square
        std::vector<char> taken(static_cast<std::size_t>(grid.nx / side + 1), 0);
        const int row = first + static_cast<int>(b) * side;
        for (int j = row; j <= std::min(last, row + side - 1); ++j)
            for (const auto& [begin, end] : targets_.row(j))
                for (int i = begin; i <= end; ++i) {
                    char& square = taken[static_cast<std::size_t>(i / side)];
                    if (square == 0 && static_cast<double>(stock_.left(grid.index(i, j))) > much)
                        square = 1, cells.push_back({i, j});
                }
        MetPoints met;
        for (const auto& [i, j] : cells) {
            Place lowest;
            lowest.tip = std::numeric_limits<double>::infinity();
            const int probes = ball_ ? 1 : kProbes;
            const double off = ball_ ? 0 : beside;
            for (int k = 0; k < probes; ++k) {
                const double turn = 2 * std::numbers::pi * k / probes, x = grid.x(i) + off * std::cos(turn),
                             y = grid.y(j) + off * std::sin(turn);
                if (x < x_low || x > x_high || y < y_low || y > y_high) continue;
                const Place p = place(to_units(x), to_units(y), met, true);
                if (p.reachable && p.tip < lowest.tip) lowest = p;
            }
            if (std::isinf(lowest.tip)) continue;
            if (const Place low = lowest.useful ? lowest : slide(lowest); low.useful)
                found[b].push_back({0, 0, {low}});
        }
    });
    std::vector<RestLine> all;
    for (std::vector<RestLine>& lines : found)
        for (RestLine& line : lines) all.push_back(std::move(line));
    keep_what_lowers(all);
    for (RestLine& line : all) lines_.push_back(std::move(line));
}

double RestLines::apart(const Place& a, const Place& b) {
    return std::hypot(static_cast<double>(a.x) - b.x, static_cast<double>(a.y) - b.y);
}

void RestLines::keep_what_lowers(std::vector<RestLine>& lines) {
    for (RestLine& line : lines) {
        cut_.context.throw_if_cancelled();
        for (Place& p : line.places) {
            const bool stair = p.stair && p.reachable;
            if (!p.useful && !stair) continue;
            p.useful = false;
            if (!stair && !lowers(to_mm(p.x), to_mm(p.y), p.tip)) continue;
            p.cut = true;
            stock_.cut_at(end_, to_mm(p.x), to_mm(p.y), p.tip);
        }
    }
    targets_.forget(enough());
}

}  // namespace slabwright
