// What part would result if the machine ran these programs? Programs, tools, layers and the pattern go in as
// values, a report comes out. All but the pattern was read from OUT; the pattern may be the one that was
// planned, as its file was read.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"
#include "engine/simulate/gouge.h"
#include "engine/simulate/program.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// A layer as plan.json states it, mm.
struct SimulatedLayer {
    double z_bottom = 0, z_top = 0, slab_thickness = 0;
    Loops flask{};  ///< what of the slab is to stay around the pattern, over the layer's whole height; empty:
                    ///< no flask
    std::optional<Blank> blank{};      ///< what its slabs cover; none: the whole stock
    std::vector<JointDowel> dowels{};  ///< in the joint on its top, whose holes are no gouges
};

/// All that the simulation starts from. The programs stand in the order of execution, layers ascending.
struct SimulationInput {
    MeshView mesh;  ///< pattern-base, millimetres
    std::array<double, 2> stock_min{}, stock_max{};
    std::vector<SimulatedLayer> layers;
    std::vector<Tool> tools;
    std::vector<Program> programs;
    Machine machine;
};

struct SimulationOptions {
    double cell = 0;                ///< mm between the points of the stock; 0: simulation_cell()
    double gouge = 0.01;            ///< mm along the normal
    double cusp = 0.04;             ///< mm that finish passes may leave
    double slack = 0.05;            ///< mm beyond the cusp that still count as done
    double leftover_limit = 0.5;    ///< mm that nothing reachable may exceed
    double leftover_share = 0.999;  ///< of the surface must be within cusp + slack, of what is reachable
    double board_cut = -1;          ///< mm allowed into the base board; negative: not limited
    bool whole = true;              ///< the layers are to hold the whole part
    bool faults = false;            ///< list every faulty motion and every place where something is left
    bool maps = false;  ///< keep left-over, gouge and kind of every point, LayerFindings::map and kinds
};

/// A size with the place where it is greatest, mm.
struct Extreme {
    double size = 0;
    Point3 where{};
};

/// Something that must not be. The code's family names the kind of fault:
/// stack.short, stack.narrow, stack.blank, stack.gap, stack.thin, gouge.cutter, gouge.stock, gouge.flask,
/// contact.shank, contact.holder, plunge.not_center_cutting, rapid.through_stock, rapid.unknown_start,
/// flute.too_deep, cut.too_deep, spindle.off, travel.exceeded, board.too_deep, operation.empty, tool.wrong,
/// tool.unknown, left.missed, left.too_much; and by io/verify program.order, program.unplanned,
/// program.missing, those of io/posts/program_check and
/// engine/simulate/keep_out_check and dowel_proof, program.dialect, program.number, tool.table,
/// sequence.no_file, sequence.unreadable and those of replay_build.
struct Violation {
    std::string code;
    std::string message;  ///< one line, sizes with units
    std::string file;     ///< the program, "" for what shows in the stock
    std::uint32_t line = 0;
    std::optional<Point3> where;
    double size = 0;                     ///< mm, or a count where the message says so
    std::optional<std::size_t> layer{};  ///< 0 …, where it shows in the stock of one
};

/// What a point of the stock is, when everything has been cut.
enum class CellKind : std::uint8_t {
    beside,       ///< the pattern, cut down to the layer's bottom
    pattern,      ///< its surface, with no more left over than the cusp
    left,         ///< more than the cusp, within cusp + slack
    missed,       ///< more than that, and a tool could take it
    unreachable,  ///< more than that, and none can
    gouge,        ///< deeper than the tolerance in the part
    flask
};

/// A motion that does what it must not, for whoever mends the program.
struct FaultyMotion {
    enum class Fault : std::uint8_t {
        crush,       ///< the core comes down on stock
        rapid,       ///< a rapid takes stock
        too_deep,    ///< takes more at once than its flutes are long, or more than is planned
        in_standing  ///< shank or holder run into standing stock
    } fault{};
    std::uint32_t line = 0;
    double size = 0;  ///< mm: what stood there, or the whole depth of the cut
    friend auto operator<=>(const FaultyMotion&, const FaultyMotion&) = default;
};

/// A point of the finished stock over which a tool could have taken more.
struct MissedPlace {
    Point3 surface{};   ///< of the stock, mm
    double left = 0;    ///< mm along the normal
    double height = 0;  ///< mm straight down to the part's surface or the layer's bottom
};

/// Where in the k-th of many equal shares its sample lies, from 0 to 1: steps of the golden section, which
/// beat with no row of cells.
[[nodiscard]] double jitter(std::size_t k);

/// A place of the stock's surface under which more is left than the limit, because no tool gets there.
struct UnreachedCell {
    Point3 place{};
    double left = 0;  ///< mm along the normal
    float cells = 1;  ///< as many cells as it stands for
};

/// One layer when everything has been cut. Points are the stock's cells; shares are of all the slab's.
struct LayerFindings {
    std::uint64_t cells = 0;
    Extreme gouge;                  ///< of the stock, along the normal
    std::uint64_t gouge_cells = 0;  ///< deeper than the tolerance
    Extreme left;                   ///< left over, along the normal, whether or not a tool could reach it
    double left_rms = 0;
    std::uint64_t over = 0;  ///< cells with more than cusp + slack left
    std::uint64_t unreachable =
        0;  ///< of those: no flat or ball end mill of the library gets cusp + slack deeper
    Extreme unreachable_left;
    std::uint64_t missed = 0;  ///< of those: a tool could
    Extreme missed_left;       ///< how much of it a tool could have taken
    double within_share = 1;   ///< reachable cells with at most cusp + slack
    /// Air under part that stays filled, in columns whose four neighbours have some too: undercuts of the
    /// layer.
    double unmade_mm3 = 0;
    Extreme unmade;           ///< its greatest height in one column, and there the layer's bottom
    std::uint64_t waste = 0;  ///< cells beside the pattern (no part of it in the layer) that were missed
    double waste_mm3 = 0;
    /// Of what is unreachable some places, that stand for all of it.
    std::vector<UnreachedCell> unreached;
    /// With SimulationOptions::maps, row after row: left-over (positive) or gouge (negative) along the
    /// normal.
    std::vector<float> map;
    std::vector<CellKind> kinds;  ///< the same points
    /// With SimulationOptions::faults: what `missed` counts, by tile.
    std::vector<MissedPlace> missed_places;
    double lowest_tip = 0;  ///< mm: no tool goes deeper in this layer; −∞ where the part alone limits it
};

/// One program.
struct ProgramFindings {
    GougeReport gouge;
    double removed_mm3 = 0;
    double seconds = 0;  ///< under the machine's acceleration, dwells and tool change included
    double cutting_mm = 0, rapid_mm = 0;
    Extreme rapid;  ///< stock taken by a rapid
    std::uint32_t rapid_line = 0;
    Extreme over_flute;  ///< stock taken above the flutes' upper end
    std::uint32_t over_flute_line = 0;
    Extreme deepest;  ///< most height that one motion took, where over a tenth of the cutter's disc, three
                      ///< cells abreast, it took more than planned
    std::uint32_t deepest_line = 0;
    Extreme shank, holder;  ///< standing stock that they run into
    Extreme crushed;        ///< stock that the core of a tool came down on, where it may not (core_contact.h)
    double crushed_mm2 = 0;  ///< of such stock, seen from above
    std::uint32_t crushed_line = 0;
    GougePlace flask;  ///< how deep it goes into the flask's walls, by the exact check
    std::uint32_t shank_line = 0, holder_line = 0;
    double lowest = 0;     ///< z of the lowest point cut; the layer's top if none
    double stock_top = 0;  ///< z of the highest stock when the program starts
    std::uint32_t spindle_off_line = 0;
    /// With SimulationOptions::faults: by fault and line, each line once with the most of all tiles.
    std::vector<FaultyMotion> faults;
};

struct SimulationMemory;

struct SimulationReport {
    double cell = 0;
    int nx = 0, ny = 0;
    std::vector<LayerFindings> layers;
    std::vector<ProgramFindings> programs;
    double gouge_max = 0;  ///< mm, of the exact check over all programs
    double seconds = 0;
    double cutting_mm = 0, rapid_mm = 0, removed_mm3 = 0;
    double board_cut = 0;               ///< mm
    double pattern_mm2 = 0;             ///< of the pattern, seen from above
    std::vector<Violation> violations;  ///< by kind, then in the order of the programs
    [[nodiscard]] bool passed() const { return violations.empty(); }
    /// Where more than cusp + slack is left because no tool of the library gets there: mm² seen from above,
    /// layer by layer, and the most that is left, mm along the normal.
    [[nodiscard]] double unreachable_mm2() const;
    [[nodiscard]] Extreme unreachable() const;
    /// What stays filled because it lies under part of its layer.
    [[nodiscard]] double unmade_mm3() const;
    [[nodiscard]] Extreme unmade() const;
};

/// The cell size that the tolerance asks for: a quarter of the distance of passes that leave the cusp,
/// 2√(2Rc), under the smallest ball of the library (or its smallest cutter), within 0.05 and 1 mm.
[[nodiscard]] double simulation_cell(const std::vector<Tool>& tools, double cusp);

/// Runs everything. Stock at the cells' centres is exact, not sampled, so a gouge or left-over is what stands
/// there; between the centres the exact check of every motion decides about gouges.
/// @param part of the input's mesh
/// @param memory of an earlier simulation, or an empty one (engine/simulate/simulation_memory.h): what has
/// not changed since is not simulated again, and the report is the same. It then holds what the next one
/// needs, but for the programs, which the caller gives it.
/// @throws Error(usage) on layers or stock that make no sense, Error(no_plan, "memory.limit"),
/// Error(cancelled)
[[nodiscard]] SimulationReport simulate(Context& context, const SimulationInput& input,
                                        const StandingPart& part, const SimulationOptions& options = {},
                                        SimulationMemory* memory = nullptr);

/// Time of a program in seconds, by the rules of Travel (engine/moves/motion_time.h), its dwell included.
/// @param before the program that the machine ran before: from its end the spindle comes, and its tool need
/// not
///        be changed where it is the same; null: the tool is fetched, and the way to the first place not
///        counted
[[nodiscard]] double program_seconds(const Program& program, const Machine& machine,
                                     const Program* before = nullptr);

}  // namespace slabwright
