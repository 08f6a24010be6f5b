// What the user decides: material, slabs, machine, tools, tolerances, strategy. Every default plans a 0.75 in
// MDF pattern on the 1160 mm machine of the RPM paper. Millimetres, newtons, seconds and millimetres a
// minute, unless a name says otherwise. The TOML spelling of every key is io/read/job_toml.
#pragma once

#include <cstdint>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "engine/controls.h"
#include "engine/cutting_data.h"
#include "engine/keep_out.h"
#include "engine/probing.h"
#include "kernels/features/features.h"
#include "kernels/forces/deflection.h"
#include "kernels/forces/forces.h"
#include "kernels/geometry/cutter_shape.h"

namespace slabwright {

enum class LengthUnit : std::uint8_t { mm, inch };
/// What is done to a mesh that is no solid: nothing (it is refused), its defects are mended one by one, or
/// its surface is made anew where mending does not close it.
enum class Repair : std::uint8_t { none, mend, rebuild };
/// Boundaries as printed (LUO 4.2.5), by the dynamic program, or, slabs bonded to any thickness, those with
/// which the whole build takes least; `uniform`: as far apart as they may be, for comparing.
enum class LayerStrategy : std::uint8_t { printed, optimal, combined, uniform };
/// Where z = 0 lies in the programs: at the pattern's bottom, which is the base board's top; at each layer's
/// top as it is faced; at the machine table's top, the base board's thickness lower; or as suits the
/// machine's table (frame_of).
enum class Frame : std::uint8_t { pattern_base, layer_top, automatic, table_top };
/// Whether the build table sinks by every layer, so that all of them are cut at one height (RPM), or stays.
enum class BuildTable : std::uint8_t { moving, fixed };
/// Who puts the glue on, and where: by hand; the machine's head on the underside of the slab that the handler
/// carries over it (RPM); a head beside the spindle on the stack's top; or, automatic, as RPM where the
/// machine has a handler and by hand elsewhere (glue_head_of).
enum class GlueHead : std::uint8_t { automatic, none, slab, stack };
/// What one program holds: an operation, all that one tool does without a change in a layer, or a layer.
enum class ProgramSpan : std::uint8_t { operation, tool, layer };
/// Which slopes level contours finish and which projected paths do (SHAPING 5): each its own side of the
/// steep limit, one of them everything, or both everything, each in the steps that it needs at the limit.
enum class FinishStrategy : std::uint8_t { split, levels, projection, both };
/// Projected paths run on parallel lines, or on curves offset again and again from the border of what they
/// finish.
enum class Projection : std::uint8_t { raster, offset };
/// What a cut is taken to meet: what the operations before have left standing, or the most that its steps can
/// leave it.
enum class Engagement : std::uint8_t { simulated, nominal };
/// How roughing clears a level: in rings offset again and again from what stays, or on parallel lines to and
/// fro.
enum class RoughPattern : std::uint8_t { contour, zigzag };
/// How what a cutter leaves is cleared before and after finishing: where it stands, on the lines of a raster;
/// or on contours, the feet of steep walls too, and what level contours take by the way is left to them. By
/// default contours where the library has more than one flat or one ball end mill.
enum class RestPattern : std::uint8_t { by_library, raster, contour };
/// Whether tools are chosen layer by layer (LUO 5.5), or every layer is cut with the fixed set.
enum class SelectionMode : std::uint8_t { select, fixed };
/// How much of a layer a tool reaches: by area in 3D, shank and holder included; by the length of sections
/// that a disc of the tool's radius touches; or by length on sections as printed (LUO 5.5.1).
enum class AccessRule : std::uint8_t { sections, exact, printed };
/// The L from which the roughing stepdown follows (LUO 5.5.3.3): the finish tool's radius,
/// tolerances.rough_cusp, or the smaller.
enum class RoughLimit : std::uint8_t { smaller, finish_radius, cusp };
/// Where x 0, y 0 of the programs lies: where the model has it, at the base board's corner of least x and y,
/// in the base board's middle, or at a pin (Machine::pin).
enum class WorkZero : std::uint8_t { model, corner, centre, pin };
/// How large slabs are sawn: all of them as the pattern needs, or each as its own layer does.
enum class Blanks : std::uint8_t { pattern, layer };
/// How slabs are cut from boards: by a panel saw, every cut from edge to edge; or milled out one by one.
enum class BoardLayout : std::uint8_t { guillotine, nested };
/// The axis whose coordinate changes its sign; the mirror lies in the origin.
enum class MirrorAxis : std::uint8_t { none, x, y, z };

inline constexpr double kInch = 25.4;

/// A cutter as the machine's magazine holds it.
struct Tool {
    int number = 0;  ///< T number, 1…
    ToolKind kind = ToolKind::flat;
    std::string name;
    double diameter = 0;
    double flute_length = 0;
    double shank_diameter = 0;
    double stickout = 0;         ///< from the holder's nose to the tip
    double holder_diameter = 0;  ///< of the holder's nose
    int flutes = 2;
    double helix_rad = std::numbers::pi / 6;
    double max_rpm = 18000;
    double max_feed = 9000;                     ///< mm/min, along the path
    double plunge_feed = 1500;                  ///< mm/min, straight down
    double stepdown_min = 0, stepdown_max = 0;  ///< mm, as in LUO table 5.4
    double stepover = 0.5;                      ///< share of the diameter, for clearing
    bool plunges = false;                       ///< cuts straight down into stock (plunges_by_default)
    double strength_mpa = 0;  ///< the cutter's own in bending, as its maker states it; 0: not checked
    double modulus_gpa = 1e-3 * kSteelMpa;  ///< E, by which it bends
    double core_diameter =
        -1;  ///< within which it has no edge: flat, face, bull-nose; negative: core_diameter_of()
    double ramp_deg = -1;  ///< steepest way down into stock; negative: ramp_limit_deg()
    double corner_radius =
        0;                   ///< of a bull-nose, between its floor and its side; of a tapered ball, its tip's
    double taper_deg = 0;    ///< of a tapered ball, between its axis and its flank
    double point_deg = 118;  ///< of a drill or a cone, across its point
    /// From the nose up, for each piece its height and the diameters of its lower and its upper end, mm;
    /// none: a cylinder of holder_diameter without end.
    std::vector<double> holder_profile{};
};

/// What of a tool is above its flutes: a part of it whose under side is a disc, or a frustum of a cone under
/// which there is nothing of the tool that is as wide.
struct ToolSection {
    const char* name;   ///< "shank" or "holder"
    double above = 0;   ///< mm, of its lower end over the tip
    double lower = 0;   ///< mm, its radius there
    double radius = 0;  ///< mm, the largest
    double height = 0;  ///< mm over which it widens from the one to the other; 0: at once
};

struct Material {
    std::string name = "MDF";
    double strength_mpa = 27;  ///< LUO 6.5.2
    double min_thickness =
        0.2 * kInch;  ///< MTmin, thinnest material above a boundary; 0: from the cutters' forces
    double shallow_limit_deg = 15;  ///< Type III
    double density_kg_m3 = 750;
    double ktc = 8.8575, kte = 1.1268, kfc = 0.6188,
           kfe = 2.4948;  ///< LUO 6.5.1: N/mm², N/mm, from orthogonal cutting
    std::string source = "Luo 6.5.1: orthogonal cutting of MDF (Dippon)";  ///< of these four, in words
    CoefficientTransform transform =
        CoefficientTransform::oblique;        ///< how they become those of a helical edge
    CuttingChart chart = CuttingChart::none;  ///< published feeds and speeds, where `cutting` has none
    std::vector<CuttingData> cutting;         ///< feeds and speeds; the first that covers a tool is its own
};

struct Slabs {
    std::vector<double> thicknesses{19.0};  ///< in stock, ascending
    double length = 1160, width = 1160;     ///< the largest slab, x and y
    double margin = 25.4;           ///< the stock reaches this far past the pattern, where the slab allows
    double facing_allowance = 0.5;  ///< the face mill takes at least this off, to find the whole slab
    Blanks blanks = Blanks::pattern;
    /// Of the boards that slabs are sawn from; 0: as large as the largest slab.
    double board_length = 0, board_width = 0;
    double kerf = 4;  ///< of the saw, or of the cutter that mills slabs out
    BoardLayout layout = BoardLayout::guillotine;
};

/// A post of the user's own, as far as the engine knows of it: it names program files by it and hands it on
/// to those who write and read programs (OwnDialect of io/posts/dialect.h).
struct OwnPost {
    std::string name;    ///< in messages
    std::string text;    ///< the bytes of its file, which a plan's folder keeps
    std::string ending;  ///< of its program files, ".nc"; "": as its base has it

    virtual ~OwnPost() = default;

protected:
    OwnPost() = default;
    OwnPost(const OwnPost&) = default;
    OwnPost& operator=(const OwnPost&) = default;
};

struct Machine {
    std::string name = "RPM 1160";
    double travel_x = 1220, travel_y = 1220, travel_z = 150;  ///< of the spindle
    BuildTable table = BuildTable::moving;
    double table_speed = 600;    ///< mm/min, of a build table that moves
    double build_height = 1200;  ///< of the build chamber: how far a table that moves goes down
    double build_mass_kg = 1440;
    double feed_height = 1200;  ///< of the feed chamber, from which slabs are taken; 0: laid by hand
    double feed_mass_kg = 1440;
    double handler_speed = 6000;  ///< mm/min, of what carries slabs from chamber to chamber; 0: done by hand
    double handler_travel = 0;    ///< mm, from one to the other; 0: 1.4 times travel_x (handler_way)
    double grip_s = 10;           ///< its clamps close, or open
    double press_lift = 100;  ///< mm that a moving table rises to press a slab against it, and sinks again
    GlueHead glue_head = GlueHead::automatic;
    double glue_pitch = 5;                          ///< mm, between beads
    double glue_speed = 3000;                       ///< mm/min along the beads, at most
    double pump_g_min = 300;                        ///< that the glue's pump gives at most; 0: no limit
    double max_feed = 9000, rapid_feed = 12000;     ///< mm/min, along the path; rapid_feed of x as well
    double rapid_y = 0, rapid_z = 0;                ///< mm/min, that these axes can do; 0: as x
    double acceleration = 1000;                     ///< mm/s², of x
    double acceleration_y = 0, acceleration_z = 0;  ///< mm/s²; 0: as x
    double max_rpm = 18000;
    double min_rpm = 0;            ///< that the spindle turns at least; 0: not stated
    double spindle_power_w = 0;    ///< that it has for cutting, at any speed; 0: no limit
    double spindle_torque_nm = 0;  ///< likewise
    double spindle_dwell_s = 3;
    double tool_change_s = 15;
    int magazine = 0;  ///< places for tools in its magazine; 0: tools are changed by hand, no limit
    double magazine_swap_s = 60;  ///< by hand: one tool out of a place, another in
    double clearance = 10;        ///< mm of air between a rapid and the highest stock
    Frame frame = Frame::automatic;
    Post post = Post::linuxcnc;
    std::shared_ptr<const OwnPost> own_post;  ///< what it writes otherwise than `post`; null: nothing
    LengthUnit units = LengthUnit::mm;        ///< of the programs
    ProgramSpan programs = ProgramSpan::operation;
    WorkZero zero = WorkZero::model;
    /// x and y of a pin or a bored hole, from the base board's corner of least x and y; empty: there is none.
    std::vector<double> pin;
    ProbeMode probe = ProbeMode::none;
    double base_board_thickness = 19;  ///< the sacrificial board under the first layer
    double base_board_cut = -1;        ///< how deep it may be cut; negative: the finish tool's overrun
    std::vector<KeepOut> keep_outs;    ///< what no tool may run into
};

struct Bonding {
    std::string glue = "cyanoacrylate";
    double press_force = 17000;  ///< N, at most
    double press_time_s = 30;
    double max_pressure_mpa = 0.5;  ///< on the glued area, so that a rib is not crushed
    /// The least that closes a joint. RPM's machine closes sheets of 1.2 m² with 17 kN (.014 MPa) over
    /// cyanoacrylate, which wants contact, not pressure: its largest slab, 1160 mm, has .0126 MPa.
    double min_pressure_mpa = 0.01;
    bool accept_weak = false;   ///< a joint that cannot hold is a warning, not a refusal
    double edge_setback = 3.0;  ///< glue keeps this far from finished edges
    double handling_s = 60;     ///< fetch, clamp, place
    double open_time_s = 0;     ///< from the glue to the press at most; 0: not stated
    double glue_s_per_m2 = 60;
    double glue_g_per_m2 = 100;  ///< .1 mm of cyanoacrylate; 0: not stated
};

/// What things cost, in the shop's own currency. A price of 0 is not stated, and nothing is reckoned with it.
struct Prices {
    std::string currency;          ///< for the reader only
    std::vector<double> board_m2;  ///< of boards: one for all slabs.thicknesses, or one for each
    double base_board_m2 = 0;      ///< of the board under the first layer
    double glue_kg = 0;
    double machine_hour = 0;  ///< of the whole build, bonding included
    double dowel = 0;         ///< of one dowel
};

struct Tolerances {
    double gouge = 0.01;                ///< along the normal
    double cusp = 0.04;                 ///< left by finish passes (scallop height)
    double rough_cusp = 0.01 * kInch;   ///< L of the roughing stepdown (LUO 5.5.3.3)
    double chordal_deviation = 0.0254;  ///< of the STL
    double undercut = 0.25;             ///< an undercut that leaves less than this is a remark, not a refusal
    double gap = 0;                     ///< open chains this near are closed, and reported
    double weld = 0;                    ///< vertices this near are merged, and reported; 0: bit-exact only
    double simplify = 0.1;  ///< share of `gouge` that 200 000 facets and more may be made fewer for, under
                            ///< the paths; 0: the facets as they are
};

/// Which sides of the slabs are milled: the top, on the stack; where that leaves air under overhangs, the
/// underside as well, before the slab is turned and laid; or, automatic, both where that makes more.
enum class SlabSides : std::uint8_t { one, two, automatic };

/// Whether columns of stock stay under what nothing of the pattern carries (engine/schedule/supports).
enum class SupportRule : std::uint8_t { none, automatic };

struct LayerPlanning {
    LayerStrategy strategy = LayerStrategy::optimal;
    SlabSides sides = SlabSides::one;
    SupportRule supports = SupportRule::automatic;
    Finder finder = Finder::exact;
    double min_layer = 3.0;          ///< thinnest layer that is not reported
    double alpha = 0.7, beta = 0.3;  ///< Q = α·DT + β·A in inch units, as printed
    bool saddles_constrain = false;
    double flat_merge = 1.0;
    double halving_coarse = 2.54, halving_resolution = 0.254;
};

/// By how much a machine may round a corner of a path where nothing else is allowed, mm.
inline constexpr double kJunction = 0.02;

struct Cutting {
    double wall_allowance = 0.3, floor_allowance = 0.3;  ///< left by roughing
    double rough_blend = 0.1;     ///< by which corners of its paths may be rounded: see rough_blend()
    double steep_limit_deg = 45;  ///< level contours from here up, projected raster below
    double overlap_deg = 2;       ///< both cut this far past the limit
    double vertical_deg = 89.5;   ///< walls from here up go to the flat end mill
    double min_stepdown = 0.2, min_stepover = 0.2;  ///< floors of the finish steps; reported where they bite
    double min_flat_area =
        4.0;  ///< mm²; smaller up-facing flats get no level of their own, the ball covers them
    double face_depth = 4.0;  ///< deepest face-milling step
    double ramp_deg = 5;      ///< entry into stock
    RoughPattern rough_pattern = RoughPattern::contour;
    RestPattern rest_pattern = RestPattern::contour;
    bool open_waste =
        true;           ///< contour roughing leaves what lies open from beside the stock to the face mill
    bool climb = true;  ///< contour roughing keeps the stock on its right, but the face mill in open waste;
                        ///< false: open rings are cut either way
    double max_engagement = 0.7;  ///< share of the diameter that roughing meets at its full feed; 1: a slot
    double holder_clearance = 2.0;
    double finish_feed = 5000;
    FinishStrategy finish_strategy = FinishStrategy::split;
    Projection projection = Projection::raster;
    bool uniform_steps = false;  ///< one stepdown and one step-over a layer, for its worst slope, and nothing
                                 ///< cut again (SHAPING 3, to compare)
    Engagement engagement = Engagement::simulated;  ///< from which the forces are computed
    bool adapt_feed =
        true;  ///< feeds by chip load and deflection (engine/forces/feeds.h), where engagement is simulated
    bool adapt_stepdown =
        true;  ///< deep cuts in several passes where no feed will do (engine/forces/feeds.h), likewise
    bool arcs = true;            ///< arcs (G2, G3) where the path turns evenly, within the gouge tolerance
    bool edges = false;          ///< sharp edges are followed where something stands beside them (FINISH 3.2)
    bool bore_holes = false;     ///< upright round holes for which no drill is there are bored on a helix
    double edge_angle_deg = 30;  ///< by which faces turn at least at an edge that counts as sharp
};

/// Choosing tools for a layer (engine/tools/select). With one flat and one ball end mill in the library there
/// is nothing to choose.
struct ToolSelection {
    SelectionMode mode = SelectionMode::select;
    AccessRule accessibility = AccessRule::exact;
    double threshold = 0.975;   ///< AR that a finish tool must have (LUO 5.6)
    double overlap_weight = 2;  ///< W of the printed AR
    RoughLimit rough_limit = RoughLimit::smaller;
    bool semi_rough = true;
    bool compare = true;  ///< lay the paths of several sets of tools, and keep what is fastest
    /// Of sets to be compared those are planned whole that are foreseen to be the fastest; else all are, the
    /// fixed set first.
    bool foresee = true;
    double voxel = 0.25;  ///< mm, for AS
};

/// A frame of the slab that stays around the pattern in every layer (engine/flask).
struct FlaskShape {
    bool enabled = false;
    double gap = 20;       ///< between the pattern's silhouette and the opening, at the pattern's bottom
    double wall = 25;      ///< thinnest wall between the opening and the slab's edge
    double draft_deg = 1;  ///< of the opening, wider at the top
};

/// Dowels in the joints between layers (engine/schedule/dowels).
struct JointDowels {
    int per_joint = 0;  ///< 0: none
    double diameter = 8;
    double depth = 20;      ///< of a hole in each of the two slabs, at most
    double clearance = 10;  ///< of wood between a hole and the pattern's surface
    bool required = false;  ///< a joint without a place for any is a refusal, not a warning
    double set_s = 5;       ///< to set one by hand
};

/// How the STL becomes the pattern.
struct InputJob {
    Repair repair = Repair::none;
};

/// What is done to the model before it is planned, in this order: turned, scaled, scaled by the contraction,
/// mirrored, given its skin, shifted (METHOD.md section 15). About the origin of the file.
struct PrepareJob {
    std::vector<double> turn{0, 0, 0};   ///< degrees about x, then y, then z; the axes stay where they are
    std::vector<double> scale{1, 1, 1};  ///< along the machine's x, y and z
    std::string shrink = "0 %";          ///< the pattern maker's contraction: a percentage, or a metal
    MirrorAxis mirror = MirrorAxis::none;
    std::vector<double> shift{0, 0, 0};  ///< mm; a plan takes x and y of it, for it sets the pattern down
    double skin = 0;                     ///< mm of machining stock, along the normal
    std::vector<double> skin_normal;     ///< only on facets whose normal lies this way; empty: any way
    double skin_angle_deg = 10;          ///< within this angle of skin_normal
    std::vector<double> skin_box;  ///< only on facets that lie in this box, prepared but neither shifted nor
                                   ///< set down: x y z of its least corner and of its greatest, mm; empty:
                                   ///< anywhere
};

struct Job {
    LengthUnit units = LengthUnit::mm;  ///< of the STL
    bool allow_undercut = false;
    InputJob input;
    PrepareJob prepare;
    Material material;
    Slabs slabs;
    Machine machine;
    Probing probing;
    Bonding bonding;
    Tolerances tolerances;
    LayerPlanning layers;
    Cutting cutting;
    ToolSelection selection;
    FlaskShape flask;
    JointDowels dowels;
    Prices prices;
    /// The fixed set: face mill, 1/2 in flat end mill, 1/4 in ball end mill (LUO's comparison set).
    std::vector<Tool> tools{
        {1, ToolKind::face, "face mill 50 mm", 50, 20, 20, 60, 60, 4, 0.0, 12000, 9000, 1000, 0.1, 4.0, 0.6},
        {2, ToolKind::flat, "flat end mill 1/2 in", 0.5 * kInch, 32, 0.5 * kInch, 50, 40, 2,
         std::numbers::pi / 6, 18000, 9000, 1500, 0.1 * kInch, 0.15 * kInch, 0.5},
        {3, ToolKind::ball, "ball end mill 1/4 in", 0.25 * kInch, 30, 0.25 * kInch, 45, 32, 2,
         std::numbers::pi / 6, 18000, 9000, 1500, 0.0625 * kInch, 0.125 * kInch, 0.5, true},
    };
};

/// The frame of the programs, never `automatic`: the machine's, or else layer_top where its table moves and
/// pattern_base where it is fixed.
[[nodiscard]] Frame frame_of(const Machine& machine);

/// The programs' z = 0 in a layer, mm, pattern-base. @param layer_top of that layer, likewise
[[nodiscard]] double zero_height(const Machine& machine, double layer_top);

/// mm/s² that the machine has in every direction of x and y: that of the slower axis.
[[nodiscard]] double level_acceleration(const Machine& machine);

/// Whether slabs are carried from the feed chamber to the table by the machine.
[[nodiscard]] bool has_handler(const Machine& machine);
/// How far it carries them, mm. The glue head, if there is one under its way, is half-way.
[[nodiscard]] double handler_way(const Machine& machine);
/// Who puts the glue on, automatic resolved.
[[nodiscard]] GlueHead glue_head_of(const Machine& machine);

/// The tallest layer this job can cut (LTmax, METHOD.md section 4): the thickest slab less the facing
/// allowance, and for every tool its flutes less overrun and holder clearance.
[[nodiscard]] double max_layer_thickness(const Job& job);

/// The same where slabs may be bonded into one: the slabs' thickness is no limit then, but the flutes are.
[[nodiscard]] double max_bonded_layer_thickness(const Job& job);

/// The tallest layer that one flat or ball end mill makes: its flutes less overrun and holder clearance.
[[nodiscard]] double max_layer_of(const Job& job, const Tool& tool);

/// The tallest layer for which the job has a flat and a ball end mill that make it, whatever its others do.
[[nodiscard]] double max_layer_of_longest(const Job& job);

/// The job without the end mills that are too short for a layer of this height or too wide for flask.gap.
[[nodiscard]] Job with_tools_for(const Job& job, double height);

/// By how much the machine may round corners of roughing paths, mm: Cutting::rough_blend, but no more than a
/// third of what roughing leaves, and no less than everywhere else (kJunction).
[[nodiscard]] double rough_blend(const Cutting& cutting);
/// The same; kJunction for a control whose programs cannot say it (says_rounding).
[[nodiscard]] double rough_blend(const Job& job);

/// Whether programs for a control say themselves how far it may round a corner; for the others that is a
/// setting of the control, and counted as kJunction.
[[nodiscard]] bool says_rounding(Post post);

/// Whether a control measures tools or keeps their lengths; where it does not, the operator touches off each
/// tool that is changed.
[[nodiscard]] bool knows_tool_lengths(Post post);

/// Whether a control changes tools within a program (M6, TOOL CALL); GRBL does not.
[[nodiscard]] bool changes_tools(Post post);

/// The file of a program as its control wants it named: "L003_02_rough_T2" is "L003_02_rough_T2.ngc" for
/// LinuxCNC and "_L003_02_rough_T2.mpf" for Siemens, whose names begin with two letters.
[[nodiscard]] std::string program_file(Post post, const std::string& stem);
/// The same for a machine, whose own post may have another ending.
[[nodiscard]] std::string program_file(const Machine& machine, const std::string& stem);

/// By how much arcs and longer chords of roughing paths may leave what they are fitted to, mm: a fifteenth of
/// what roughing leaves.
[[nodiscard]] double rough_fit(const Cutting& cutting);

/// The narrowest flask.gap in which a flat and a ball end mill of the job pass between pattern and flask: the
/// wider one of the narrowest of each, what roughing leaves on the pattern's walls, and room for leads.
[[nodiscard]] double least_flask_gap(const Job& job);

/// What the job asks of the feature finders.
[[nodiscard]] FeatureOptions feature_options(const Job& job);

/// Whether tools of a kind mill straight down unless the job says otherwise: ball end mills and drills do;
/// the edges of a face mill do not reach its middle, nor do those of many flat end mills.
[[nodiscard]] bool plunges_by_default(ToolKind kind);
/// The lower end of a tool.
[[nodiscard]] CutterShape cutter_shape(const Tool& tool);
/// Whether taper, point and holder's profile are such as a tool of its kind can have.
[[nodiscard]] bool has_flank_and_holder(const Tool& tool);
/// Shank and holder where they stand out over the cutter, from the lowest up. Above its last piece a holder
/// goes on as wide as that ends.
[[nodiscard]] std::vector<ToolSection> sections_of(const Tool& tool);
/// The same as cylinders that hold them: a frustum as steps of at most 0.5 mm, each as wide as its upper end.
[[nodiscard]] std::vector<ToolSection> cylinders_of(const Tool& tool);
/// What the tip of a tool is wide in which it makes a hollow: the diameter, or that of a tapered ball's tip;
/// nothing of a cone, mm.
[[nodiscard]] double tip_diameter(const Tool& tool);
/// The diameter of the cutter fluted to the holder that bends as this one of the same stick-out, mm: 1/D⁴ =
/// 3∫(z − a)²/d⁴/L³ over z from a to L, where d is the shank's / .8 over the flutes, loaded at its tip (a =
/// 0), or with a taper at a, its tip's radius or half its largest step over the tip.
[[nodiscard]] double bending_diameter(const Tool& tool);
/// How far a force across it bends its tip, mm (cutter_deflection, of a cutter as wide as bending_diameter).
/// @throws Error(usage, "forces.tool") for a negative force
[[nodiscard]] double tip_bent_by(const Tool& tool, double force_n);
/// The diameter of one fluted to the holder that is bent as hard there as this is where that is worst, mm.
[[nodiscard]] double strength_diameter(const Tool& tool);
/// Whether it roughs or finishes layers from top to bottom: flat, bull-nose, ball and tapered ball end mills.
[[nodiscard]] bool is_end_mill(ToolKind kind);
/// Whether it can rough a layer, level by level: flat and bull-nose end mills. A bull-nose goes where the
/// flat around it may; what its corners leave at the foot of walls is for a flat.
[[nodiscard]] bool roughs_layers(ToolKind kind);
/// Whether Tool::corner_radius, Tool::taper_deg or Tool::point_deg is one of its measures.
[[nodiscard]] bool has_corner(ToolKind kind);
[[nodiscard]] bool has_taper(ToolKind kind);
[[nodiscard]] bool has_point(ToolKind kind);
/// Whether its tip is a ball, with which it finishes: ball and tapered ball end mills.
[[nodiscard]] bool has_ball_tip(ToolKind kind);
/// Of what a tool clears level or meets with from the side, mm: of a bull-nose its floor, else the cutter.
[[nodiscard]] double clearing_radius(const Tool& tool);
/// Whether it cuts sideways: all but drills.
[[nodiscard]] bool mills(ToolKind kind);

/// The diameter within which a flat or bull-nose end mill or a face mill has no edge, mm. Tool::core_diameter
/// where that is given; else 0.3 of an end mill's diameter and 0.8 of a face mill's. 0 of all others and of
/// what plunges.
[[nodiscard]] double core_diameter_of(const Tool& tool);

/// The steepest ramp into stock, degrees. Tool::ramp_deg where that is given; else 2 for a face mill, 10 for
/// an end mill with a core, and 90 for what has none.
[[nodiscard]] double ramp_limit_deg(const Tool& tool);

/// How high stock may stand under a tool's core, mm: as high as its steepest straight ramp leaves it there,
/// the core's diameter times the ramp's slope. The core must be recessed by that for the ramp to be possible.
[[nodiscard]] double core_recess(const Tool& tool);

/// How far apart level passes that clear a floor may lie, mm: Tool::stepover, and no farther than the floor
/// of a bull-nose is wide, which else leaves ridges between them.
[[nodiscard]] double clearing_step(const Tool& tool);

/// The first tool of a kind. @throws Error(usage, "job.tool") when the library has none
[[nodiscard]] const Tool& tool_of_kind(const Job& job, ToolKind kind);

/// The feeds and speeds that apply to a tool: the first of Material::cutting that covers it, else the first
/// of the chart; null: none does.
[[nodiscard]] const CuttingData* cutting_data_of(const Material& material, const Tool& tool);

/// The job with its tools' feeds and speeds no higher than what the material's cutting data gives them:
/// max_rpm by surface speed or spindle speed, no lower than the spindle turns; max_feed as chip load times
/// flutes times the speed that the machine turns it at; plunge_feed no faster than that. What a tool does not
/// state (an infinite max_rpm or max_feed) is that of a Tool by default where there is no data. Done twice it
/// changes nothing more.
[[nodiscard]] Job with_cutting_data(const Job& job);

/// Gives tools what they do not state (an infinite max_rpm or max_feed), as with_cutting_data() has it. What
/// they state stays as it is.
void state_feeds(Job& job);

/// Checks ranges and combinations. @throws Error(usage) that names the key
void validate(const Job& job);

}  // namespace slabwright
