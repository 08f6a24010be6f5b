// What a part from sheets takes: time, stock, weight and money, of several ways to make it side by side
// (METHOD.md section 13; FDFF table 4.1).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/sheets/sheet_plan.h"

namespace slabwright {

/// What sheets are of.
struct SheetMaterial {
    const char* name;
    double density_kg_m3;
};
/// How they are joined.
struct SheetBond {
    const char* name;
    double thickness_mm;
    double strength_mpa;  ///< in tension, square to the joint
    const char* source;
};

[[nodiscard]] std::span<const SheetMaterial> sheet_materials();
[[nodiscard]] std::span<const SheetBond> sheet_bonds();
/// nullptr for a name that is none of these.
[[nodiscard]] const SheetMaterial* sheet_material(std::string_view name);
[[nodiscard]] const SheetBond* sheet_bond(std::string_view name);

struct SheetPrices {
    double per_m3 = 0;    ///< of stock
    double per_hour = 0;  ///< of the machine
};

/// One way to make the part.
struct SheetCost {
    std::string way;      ///< "uniform", "adaptive" or "curved"
    std::string why_not;  ///< not empty: this way makes no part, and the rest is 0
    std::size_t sheets = 0, stock_sheets = 0;
    double cut_mm = 0, minutes = 0;
    double stair_mm3 = 0;  ///< what upright cuts would leave
    double deviation = 0;  ///< mm: greatest distance between part and sheets
    double part_kg = 0, stock_kg = 0;
    double money = 0;
};

/// @param density kg/m³
[[nodiscard]] SheetCost cost_of(const SheetsPlan& plan, std::string way, double density,
                                const SheetPrices& prices);

/// The thinnest sheets alone and upright; sheets as the job's strategy has them, upright; and with tilted
/// cuts, where the job's head tilts. A way that makes no part says why.
/// @param plan of the job; it is not planned again. @param mesh as for plan_sheets()
[[nodiscard]] std::vector<SheetCost> compare_costs(Context& context, const Mesh& mesh, const SheetsPlan& plan,
                                                   double density, const SheetPrices& prices);

/// The part of a program's stock that is left whole, the larger of the strips beside and above all cuts; none
/// where that is narrower than `least` mm.
[[nodiscard]] StockSheet offcut_of(const SheetsPlan& plan, std::size_t program, double least = 50);

}  // namespace slabwright
