#include "engine/sheets/sheet_cost.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr SheetMaterial kMaterials[] = {{"plywood", 680}, {"mdf", 750}, {"aluminium", 2700}, {"steel", 7850}};

constexpr double kPsi = 0.00689476;  ///< MPa

constexpr SheetBond kBonds[] = {
    {"glue", 0.1, 10, "EN 204: what every class of wood glue holds dry"},
    {"solder", 0.0254, 1628.3 * kPsi, "FDFF equation 6.1 at its best corner; thickness L1336"},
    {"braze", 0.0254, 4646.8 * kPsi, "FDFF table A.3, mean of 24 joints; thickness L1336"}};

template <class Item>
const Item* named(std::span<const Item> items, std::string_view name) {
    const auto found =
        std::find_if(items.begin(), items.end(), [&](const Item& i) { return name == i.name; });
    return found == items.end() ? nullptr : &*found;
}

SheetCost other_way(Context& context, const Mesh& mesh, const SheetJob& job, std::string way, double density,
                    const SheetPrices& prices) {
    try {
        const SheetsPlan plan = plan_sheets(context, mesh, job);
        return cost_of(plan, std::move(way), density, prices);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::no_plan) throw;
        SheetCost cost;
        cost.way = std::move(way);
        cost.why_not = error.message();
        return cost;
    }
}

}  // namespace

std::span<const SheetMaterial> sheet_materials() { return kMaterials; }
std::span<const SheetBond> sheet_bonds() { return kBonds; }
const SheetMaterial* sheet_material(std::string_view name) { return named(sheet_materials(), name); }
const SheetBond* sheet_bond(std::string_view name) { return named(sheet_bonds(), name); }

SheetCost cost_of(const SheetsPlan& plan, std::string way, double density, const SheetPrices& prices) {
    constexpr double kMm3PerM3 = 1e9;
    SheetCost cost;
    cost.way = std::move(way);
    cost.sheets = plan.pieces.size();
    cost.stock_sheets = plan.programs.size();
    cost.stair_mm3 = plan.stack.stair_mm3;
    double part = 0, stock = 0;
    for (const SheetPiece& piece : plan.pieces) {
        part += piece.area_mm2 * (piece.span.top - piece.span.bottom);
        cost.deviation = std::max(cost.deviation, piece.deviation);
    }
    for (const SheetProgram& program : plan.programs) {
        cost.cut_mm += program.cut_mm;
        cost.minutes += program.minutes;
        stock += program.stock.length * program.stock.width * program.thickness;
    }
    cost.part_kg = part / kMm3PerM3 * density;
    cost.stock_kg = stock / kMm3PerM3 * density;
    cost.money = stock / kMm3PerM3 * prices.per_m3 + cost.minutes / 60 * prices.per_hour;
    return cost;
}

std::vector<SheetCost> compare_costs(Context& context, const Mesh& mesh, const SheetsPlan& plan,
                                     double density, const SheetPrices& prices) {
    const bool is_tilted = plan.job.cutting.most_tilt_deg > 0;
    const bool is_uniform = plan.job.slicing.strategy == SheetStrategy::uniform;
    SheetJob upright = plan.job;
    upright.cutting.most_tilt_deg = 0;
    SheetJob uniform = upright;
    uniform.slicing.strategy = SheetStrategy::uniform;
    if (is_uniform) upright.slicing.strategy = SheetStrategy::optimal;
    std::vector<SheetCost> costs;
    if (is_uniform && !is_tilted) costs.push_back(cost_of(plan, "uniform", density, prices));
    else costs.push_back(other_way(context, mesh, uniform, "uniform", density, prices));
    if (is_uniform || is_tilted)
        costs.push_back(other_way(context, mesh, upright, "adaptive", density, prices));
    else costs.push_back(cost_of(plan, "adaptive", density, prices));
    if (is_tilted) costs.push_back(cost_of(plan, "curved", density, prices));
    return costs;
}

StockSheet offcut_of(const SheetsPlan& plan, std::size_t index, double least) {
    const SheetProgram& program = plan.programs[index];
    double right = 0, top = 0;
    for (const SheetWay& way : program.ways) {
        right = std::max(right, to_mm(way.pierce.x)), top = std::max(top, to_mm(way.pierce.y));
        for (const HeadPoint& p : way.points) {
            const double reach = plan.job.cutting.kerf / 2 / std::cos(p.a_deg * std::numbers::pi / 180);
            for (const Point2 end : {p.top, bottom_of(p, program.thickness)}) {
                right = std::max(right, to_mm(end.x) + reach);
                top = std::max(top, to_mm(end.y) + reach);
            }
        }
    }
    const double spacing = plan.job.nesting.spacing;
    const double beside = program.stock.length - right - spacing, above = program.stock.width - top - spacing;
    const StockSheet strip = beside * program.stock.width > above * program.stock.length
                                 ? StockSheet{beside, program.stock.width}
                                 : StockSheet{program.stock.length, above};
    return strip.length >= least && strip.width >= least ? strip : StockSheet{};
}

}  // namespace slabwright
