// The boards that a build takes: what is sawn from each, and what it costs (METHOD.md section 18).
#pragma once

#include <optional>
#include <vector>

#include "engine/plan.h"
#include "engine/schedule/guillotine.h"

namespace slabwright {

/// A slab, or the base board, as it is sawn.
struct BlankToSaw {
    int layer = 0;         ///< Layer::index; 0: the base board
    int slab = 0;          ///< within its layer, from 1 upwards; 0: the base board
    double thickness = 0;  ///< mm
    SawnSize size;
    friend bool operator==(const BlankToSaw&, const BlankToSaw&) = default;
};

/// A board as it is bought, and what is sawn from it.
struct BoardToSaw {
    double thickness = 0;  ///< mm
    SawnSize size;
    SawnBoard sawn;  ///< its pieces are indices into CutList::blanks; no cuts where it is nested
};

struct CutList {
    std::vector<BlankToSaw> blanks;  ///< the base board, then slabs from below
    std::vector<BoardToSaw> boards;  ///< thin ones first
    BoardLayout layout = BoardLayout::guillotine;
    [[nodiscard]] double bought_m2() const;
    [[nodiscard]] double sawn_m2() const;  ///< of all blanks
};

/// The boards that slabs are sawn from, mm: slabs.board_length and board_width, or the largest slab.
[[nodiscard]] SawnSize board_size(const Slabs& slabs);

/// Before anything is planned for them.
/// @throws Error(no_plan, "slabs.board") where a slab, or the base board, is larger than a board
void check_boards(const Plan& plan);

/// What to saw for a build: the base board and every slab, those of one thickness together, as
/// slabs.layout says (lay_on_boards, nest_on_boards).
/// @param blanks pattern: as if every slab were as large as the plan's stock, to compare with
/// @throws Error(no_plan, "slabs.board") where a slab is larger than a board
[[nodiscard]] CutList cut_list(const Plan& plan, Blanks blanks = Blanks::layer);

/// What a build costs by the job's prices; what has no price has no value.
struct Cost {
    std::optional<double> boards;      ///< whole boards as they are bought
    std::optional<double> base_board;  ///< where it is sawn from boards of its own thickness
    std::optional<double> glue, machine;
    std::optional<double> dowels;  ///< where the build has some
    double total = 0;              ///< of what has a price
};

/// Amounts that cost something.
struct Amounts {
    struct Boards {
        double thickness = 0;  ///< mm
        double m2 = 0;         ///< whole boards
        bool base = false;     ///< no slab is sawn from them
    };
    std::vector<Boards> boards;
    double glue_m2 = 0;
    double minutes = 0;  ///< of the whole build
    std::size_t dowels = 0;
};

/// What a plan takes. @param list its own
[[nodiscard]] Amounts amounts_of(const Plan& plan, const CutList& list);

/// @return none where the job states no price
[[nodiscard]] std::optional<Cost> cost_of(const Job& job, const Amounts& amounts);

}  // namespace slabwright
