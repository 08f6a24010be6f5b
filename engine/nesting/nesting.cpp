#include "engine/nesting/nesting.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <tuple>

#include "engine/nesting/nest_grid.h"
#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

/// A piece in one turn: the cells that it and half of the spacing touch.
struct Turned {
    int turn = 0;
    CellShape cells;
};

std::vector<Turned> turns_of(const Loops& piece, const NestRules& rules, std::int64_t cell) {
    std::vector<Turned> turned;
    for (const int turn : rules.turns)
        turned.push_back(
            {turn, cells_of(offset(placed(piece, {0, turn, {0, 0}}), rules.spacing / 2, 0.05), cell)});
    return turned;
}

struct Spot {
    int stock = 0;
    CellSpot at;
    std::size_t turn = 0;
};

/// Of the turns the one that ends lowest, then leftmost, where it lies lowest.
std::optional<Spot> spot_on(const NestGrid& taken, const std::vector<Turned>& turned) {
    std::optional<Spot> best;
    const auto ends = [&](const Spot& spot) {
        return std::pair{spot.at.row + turned[spot.turn].cells.rows,
                         spot.at.column + turned[spot.turn].cells.columns};
    };
    for (std::size_t t = 0; t < turned.size(); ++t) {
        const auto at = lowest_spot(taken, turned[t].cells, best ? ends(*best).first : taken.rows());
        if (!at) continue;
        const Spot spot{0, *at, t};
        if (!best || ends(spot) < ends(*best)) best = spot;
    }
    return best;
}

/// What pieces are laid on and how; the same for all orders.
struct NestTask {
    std::vector<std::vector<Turned>> turned;  ///< of every piece; empty for a piece that is nothing
    std::vector<NestGrid> offcuts;
    NestGrid sheet;
};

/// How good a layout is, less is better: whole sheets, rows in use of the last, and how high pieces end on
/// it.
using LayoutCost = std::tuple<std::size_t, int, std::int64_t>;

struct Layout {
    std::vector<Spot> spots;             ///< of every piece
    std::size_t stock = 0;               ///< offcuts and whole sheets
    std::optional<std::size_t> missing;  ///< a piece for which there is no room
    LayoutCost cost{};
};

/// Lays pieces in an order.
Layout laid(const NestTask& task, const std::vector<std::size_t>& order) {
    Layout layout;
    layout.spots.resize(task.turned.size());
    std::vector<NestGrid> taken = task.offcuts;
    for (const std::size_t i : order) {
        const std::vector<Turned>& turned = task.turned[i];
        if (turned.empty()) continue;
        std::optional<Spot> spot;
        std::size_t s = 0;
        for (; s < taken.size(); ++s)
            if ((spot = spot_on(taken[s], turned))) break;
        if (!spot) {
            taken.push_back(task.sheet);
            spot = spot_on(taken[s], turned);
        }
        if (!spot) {  // it fits an offcut only, and that is taken
            taken.pop_back();
            layout.missing = i;
            continue;
        }
        spot->stock = static_cast<int>(s);
        taken[s].take(turned[spot->turn].cells, spot->at.column, spot->at.row);
        layout.spots[i] = *spot;
    }
    layout.stock = taken.size();
    auto& [sheets, rows, ends] = layout.cost;
    sheets = layout.missing ? SIZE_MAX : taken.size();
    for (const std::size_t i : order) {
        if (task.turned[i].empty() || layout.spots[i].stock + 1 != static_cast<int>(taken.size())) continue;
        const int end = layout.spots[i].at.row + task.turned[i][layout.spots[i].turn].cells.rows;
        rows = std::max(rows, end);
        ends += end;
    }
    return layout;
}

using Order = std::vector<std::size_t>;

/// Pieces from the largest down: by box, area, longer side, shorter side.
std::vector<Order> first_orders(const std::vector<Loops>& pieces) {
    std::vector<std::array<double, 4>> sizes;
    for (const Loops& piece : pieces) {
        Box2 box;
        for (const Point2 p : piece.points) box.grow(p);
        const double x = piece.points.empty() ? 0 : to_mm(box.max.x) - to_mm(box.min.x),
                     y = piece.points.empty() ? 0 : to_mm(box.max.y) - to_mm(box.min.y);
        sizes.push_back({x * y, area(piece), std::max(x, y), std::min(x, y)});
    }
    std::vector<Order> orders;
    for (std::size_t by = 0; by < 4; ++by) {
        Order order(pieces.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(),
                         [&](std::size_t a, std::size_t b) { return sizes[a][by] > sizes[b][by]; });
        orders.push_back(std::move(order));
    }
    return orders;
}

/// The order with two pieces changed for each other, or one laid earlier or later.
Order changed(Order order, std::mt19937_64& random) {
    const auto any = [&] { return static_cast<std::size_t>(random() % order.size()); };
    const std::size_t i = any(), j = any();
    if (random() % 2 == 0) {
        std::swap(order[i], order[j]);
    } else {
        const std::size_t piece = order[i];
        order.erase(order.begin() + static_cast<long>(i));
        order.insert(order.begin() + static_cast<long>(j), piece);
    }
    return order;
}

/// The best of `tries` orders. Changes are tried by eights, which does not depend on threads.
Layout best_layout(Context& context, const NestTask& task, const std::vector<Loops>& pieces, int tries) {
    constexpr std::size_t at_once = 8;
    std::vector<Order> orders = first_orders(pieces);
    orders.resize(std::min(orders.size(), static_cast<std::size_t>(tries)));
    Order best_order;
    Layout best;
    std::mt19937_64 random(34);
    for (std::size_t tried = 0;;) {
        std::vector<Layout> layouts(orders.size());
        parallel_each(context, orders.size(), [&](std::size_t k) { layouts[k] = laid(task, orders[k]); });
        for (std::size_t k = 0; k < orders.size(); ++k)
            if (best_order.empty() || layouts[k].cost <= best.cost) {
                if (!best_order.empty() && tried == 0 && layouts[k].cost == best.cost) continue;
                best = std::move(layouts[k]);
                best_order = orders[k];
            }
        tried += orders.size();
        if (tried >= static_cast<std::size_t>(tries) || pieces.size() < 2) return best;
        context.throw_if_cancelled();
        orders.clear();
        while (orders.size() < std::min(at_once, static_cast<std::size_t>(tries) - tried))
            orders.push_back(changed(best_order, random));
    }
}

[[noreturn]] void refuse(const Loops& piece, std::size_t i, const StockSheet& sheet) {
    Box2 box;
    for (const Point2 p : piece.points) box.grow(p);
    throw Error(ErrorKind::no_plan, "sheets.size",
                fmt::format("a piece of {:.1f} x {:.1f} mm does not fit on stock of {} x {} mm",
                            to_mm(box.max.x) - to_mm(box.min.x), to_mm(box.max.y) - to_mm(box.min.y),
                            sheet.length, sheet.width),
                fmt::format("piece {}", i + 1), "give larger sheets, or stack along another axis");
}

void require_rules(const StockSheet& sheet, const std::vector<StockSheet>& offcuts, const NestRules& rules) {
    bool good = rules.tries >= 1 && rules.tries <= 1000000 && rules.spacing >= 0 && rules.margin >= 0 &&
                rules.cell > 0.01 && !rules.turns.empty();
    for (const int turn : rules.turns) good = good && turn % 90 == 0;
    std::vector<StockSheet> all = offcuts;
    all.push_back(sheet);
    for (const StockSheet& s : all)
        good = good && s.length > 0 && s.width > 0 && s.length < 1e5 && s.width < 1e5 &&
               s.length / rules.cell < 20000 && s.width / rules.cell < 20000;
    if (!good)
        throw Error(
            ErrorKind::usage, "sheets.nest", "stock, spacing or turns are out of range", "",
            "sizes over 0 and under 100 m, spacing 0 or more, turns of 0, 90, 180 or 270 degrees, a try "
            "or more");
}

}  // namespace

Point2 placed(Point2 p, const NestPlace& place) {
    switch (((place.turn % 360) + 360) % 360) {
        case 90:
            p = {-p.y, p.x};
            break;
        case 180:
            p = {-p.x, -p.y};
            break;
        case 270:
            p = {p.y, -p.x};
            break;
        default:
            break;
    }
    return {p.x + place.shift.x, p.y + place.shift.y};
}

Loops placed(const Loops& loops, const NestPlace& place) {
    Loops moved = loops;
    for (Point2& p : moved.points) p = placed(p, place);
    return moved;
}

Nest nest_pieces(Context& context, const std::vector<Loops>& pieces, const StockSheet& sheet,
                 const std::vector<StockSheet>& offcuts, const NestRules& rules) {
    require_rules(sheet, offcuts, rules);
    const std::int64_t cell = to_units(rules.cell);
    // Half of the spacing may reach into the margin.
    const double inset = std::max(0.0, rules.margin - rules.spacing / 2);
    const auto grid_of = [&](const StockSheet& s) {
        return NestGrid(std::max(0, static_cast<int>((s.length - 2 * inset) / rules.cell)),
                        std::max(0, static_cast<int>((s.width - 2 * inset) / rules.cell)));
    };
    NestTask task{std::vector<std::vector<Turned>>(pieces.size()), {}, grid_of(sheet)};
    for (const StockSheet& s : offcuts) task.offcuts.push_back(grid_of(s));
    parallel_each(context, pieces.size(), [&](std::size_t i) {
        if (!pieces[i].points.empty()) task.turned[i] = turns_of(pieces[i], rules, cell);
    });
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        const auto fits = [&](const NestGrid& grid) { return spot_on(grid, task.turned[i]).has_value(); };
        if (!pieces[i].points.empty() && !fits(task.sheet) &&
            std::none_of(task.offcuts.begin(), task.offcuts.end(), fits))
            refuse(pieces[i], i, sheet);
    }
    const Layout layout = best_layout(context, task, pieces, rules.tries);
    if (layout.missing) refuse(pieces[*layout.missing], *layout.missing, sheet);
    Nest nest;
    nest.places.resize(pieces.size());
    nest.stock = offcuts;
    nest.stock.resize(std::max(nest.stock.size(), layout.stock), sheet);
    double used = 0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        if (pieces[i].points.empty()) continue;
        used += area(pieces[i]);
        const Spot& spot = layout.spots[i];
        const Turned& t = task.turned[i][spot.turn];
        const std::int32_t low = to_units(inset);
        nest.places[i] = {spot.stock,
                          t.turn,
                          {static_cast<std::int32_t>(low + spot.at.column * cell - t.cells.low.x),
                           static_cast<std::int32_t>(low + spot.at.row * cell - t.cells.low.y)}};
    }
    // Offcuts on which nothing lies are not in use.
    std::set<int> in_use;
    for (std::size_t i = 0; i < pieces.size(); ++i)
        if (!pieces[i].points.empty()) in_use.insert(nest.places[i].stock);
    std::vector<StockSheet> kept;
    for (const int s : in_use) kept.push_back(nest.stock[static_cast<std::size_t>(s)]);
    for (NestPlace& place : nest.places)
        place.stock = static_cast<int>(std::distance(in_use.begin(), in_use.lower_bound(place.stock)));
    nest.stock = std::move(kept);
    double offered = 0;
    for (const StockSheet& s : nest.stock) offered += s.length * s.width;
    nest.utilisation = offered > 0 ? used / offered : 0;
    return nest;
}

}  // namespace slabwright
