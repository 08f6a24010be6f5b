#include "engine/schedule/cut_list.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "engine/schedule/fit.h"
#include "engine/schedule/nested_boards.h"

namespace slabwright {

namespace {

constexpr double kSameThickness = 1e-6;  // mm
constexpr double kMm2InM2 = 1e-6;

std::vector<BlankToSaw> blanks_of(const Plan& plan, Blanks as) {
    const Blank stock{plan.stock_min, plan.stock_max};
    std::vector<BlankToSaw> blanks;
    if (plan.job.machine.base_board_thickness > 0)
        blanks.push_back({0, 0, plan.job.machine.base_board_thickness, {stock.length(), stock.width()}});
    for (const Layer& layer : plan.layers) {
        const Blank blank = as == Blanks::layer ? slab_of(plan, layer) : stock;
        for (int k = 1; k <= layer.slabs; ++k)
            blanks.push_back(
                {layer.index, k, layer.slab_thickness / layer.slabs, {blank.length(), blank.width()}});
    }
    return blanks;
}

/// @throws Error(no_plan, "slabs.board") for the largest that no board holds
void require_on_board(const std::vector<BlankToSaw>& blanks, const Slabs& slabs) {
    const SawnSize board = board_size(slabs);
    const SawnSize* largest = nullptr;
    for (const BlankToSaw& blank : blanks) {
        const SawnSize& s = blank.size;
        if (fits_on(board, s)) continue;
        if (largest == nullptr || s.length * s.width > largest->length * largest->width) largest = &s;
    }
    if (largest == nullptr) return;
    throw refusal("slabs.board",
                  fmt::format("a slab of {:.1f} x {:.1f} mm is larger than a board of {:g} x {:g} mm",
                              largest->length, largest->width, board.length, board.width),
                  {}, "give larger boards (slabs.board_length, slabs.board_width) or less margin");
}

/// The price of a square metre of a board; 0: none is stated.
double price_of(const Job& job, const Amounts::Boards& boards) {
    const Prices& prices = job.prices;
    if (boards.base && prices.base_board_m2 > 0) return prices.base_board_m2;
    const std::vector<double>& stocked = job.slabs.thicknesses;
    for (std::size_t i = 0; i < stocked.size() && !prices.board_m2.empty(); ++i)
        if (std::abs(stocked[i] - boards.thickness) <= kSameThickness)
            return prices.board_m2[std::min(i, prices.board_m2.size() - 1)];
    return 0;
}

}  // namespace

double CutList::bought_m2() const {
    double sum = 0;
    for (const BoardToSaw& board : boards) sum += board.size.length * board.size.width * kMm2InM2;
    return sum;
}

double CutList::sawn_m2() const {
    double sum = 0;
    for (const BlankToSaw& blank : blanks) sum += blank.size.length * blank.size.width * kMm2InM2;
    return sum;
}

SawnSize board_size(const Slabs& slabs) {
    return {slabs.board_length > 0 ? slabs.board_length : slabs.length,
            slabs.board_width > 0 ? slabs.board_width : slabs.width};
}

void check_boards(const Plan& plan) { require_on_board(blanks_of(plan, Blanks::layer), plan.job.slabs); }

CutList cut_list(const Plan& plan, Blanks blanks) {
    CutList list;
    list.blanks = blanks_of(plan, blanks);
    require_on_board(list.blanks, plan.job.slabs);
    list.layout = plan.job.slabs.layout;
    const SawnSize board = board_size(plan.job.slabs);
    std::vector<double> thicknesses;
    for (const BlankToSaw& blank : list.blanks) thicknesses.push_back(blank.thickness);
    std::sort(thicknesses.begin(), thicknesses.end());
    double before = -1;
    for (const double thickness : thicknesses) {
        if (thickness - before <= kSameThickness) continue;
        before = thickness;
        std::vector<SawnSize> sizes;
        std::vector<std::size_t> which;
        for (std::size_t i = 0; i < list.blanks.size(); ++i) {
            const BlankToSaw& blank = list.blanks[i];
            if (std::abs(blank.thickness - thickness) > kSameThickness) continue;
            sizes.push_back(blank.size);
            which.push_back(i);
        }
        const auto lay = list.layout == BoardLayout::nested ? nest_on_boards : lay_on_boards;
        std::vector<SawnBoard> laid = lay(sizes, board, plan.job.slabs.kerf);
        for (SawnBoard& sawn : laid) {
            for (SawnPiece& piece : sawn.pieces) piece.piece = which[piece.piece];
            list.boards.push_back({thickness, board, std::move(sawn)});
        }
    }
    return list;
}

Amounts amounts_of(const Plan& plan, const CutList& list) {
    Amounts amounts;
    for (const BoardToSaw& board : list.boards) {
        const bool base =
            std::none_of(board.sawn.pieces.begin(), board.sawn.pieces.end(),
                         [&](const SawnPiece& piece) { return list.blanks[piece.piece].layer > 0; });
        amounts.boards.push_back({board.thickness, board.size.length * board.size.width * kMm2InM2, base});
    }
    for (const Layer& layer : plan.layers) {
        amounts.dowels += layer.dowels.size();
        for (const Joint& joint : layer.joints) amounts.glue_m2 += joint.area_mm2 * kMm2InM2;
    }
    amounts.minutes = plan.totals.build_minutes;
    return amounts;
}

std::optional<Cost> cost_of(const Job& job, const Amounts& amounts) {
    Cost cost;
    bool stated = false;
    const auto add = [&](std::optional<double>& sum, double more) {
        sum = sum.value_or(0) + more;
        cost.total += more;
        stated = true;
    };
    for (const Amounts::Boards& boards : amounts.boards)
        if (const double price = price_of(job, boards); price > 0)
            add(boards.base ? cost.base_board : cost.boards, price * boards.m2);
    if (job.prices.glue_kg > 0 && job.bonding.glue_g_per_m2 > 0)
        add(cost.glue, amounts.glue_m2 * job.bonding.glue_g_per_m2 * 1e-3 * job.prices.glue_kg);
    if (job.prices.machine_hour > 0) add(cost.machine, amounts.minutes / 60 * job.prices.machine_hour);
    if (job.prices.dowel > 0 && amounts.dowels > 0)
        add(cost.dowels, static_cast<double>(amounts.dowels) * job.prices.dowel);
    if (!stated) return std::nullopt;
    return cost;
}

}  // namespace slabwright
