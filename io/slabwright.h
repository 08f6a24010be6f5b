// The front door of the library: the one header that an embedder includes.
//
//     slabwright::Context context({.threads = 2});
//     slabwright::Job job = slabwright::default_job();       // or read_job("job.toml")
//     slabwright::Plan plan = slabwright::plan(context, "pattern.stl", job);
//     slabwright::write(context, plan, "out");
//
// A pattern is named by its path, or given as bytes or as a mesh (PatternSource); a plan is written to a
// folder, or asked for as text (plan_document, program_document).
//
// Everything throws slabwright::Error and nothing else; context.cancel() from any thread stops it. The
// library writes nothing to stderr, sets no signal handler and never exits; several plans may run at once,
// each on its own Context.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"
#include "io/read/pattern_source.h"
#include "kernels/errors.h"
#include "kernels/export.h"
#include "kernels/features/cavities.h"
#include "kernels/features/draw.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// "major.minor.patch"
[[nodiscard]] SLABWRIGHT_API std::string version();

/// The formats of patterns that this build reads, "STL, 3MF, PLY, OBJ", and those that it was built without,
/// "; not built: STEP".
[[nodiscard]] SLABWRIGHT_API std::string pattern_formats();

/// The job that the command begins with: a shop's eight tools (io/JOB.md), chosen layer by layer, all else as
/// in `Job{}`, which has the three tools of the fixed set.
[[nodiscard]] SLABWRIGHT_API Job default_job();

/// Reads a job file (TOML), "" for none, and the tool library and the post file that it names beside it. What
/// it leaves out is as in default_job().
/// @param tool_library a file of tools, or the name of a library of the house, instead of [tools] library
/// (io/JOB.md)
/// @param post a control, or a post file (io/FORMATS.md), instead of machine.post
/// @throws Error(usage) with file, line and the nearest known key; "post.…" where a post file cannot be used
[[nodiscard]] SLABWRIGHT_API Job read_job(const std::string& path, const std::string& tool_library = {},
                                          const std::string& post = {});

/// A post file that writes just as the dialect of a control does, every key with a comment (io/FORMATS.md).
/// @param control a word of machine.post. @throws Error(usage, "post.base") for another, or a conversational
/// one
[[nodiscard]] SLABWRIGHT_API std::string post_file_toml(std::string_view control);

/// A job with the keys that a text in TOML states, the others as in `base`. @param name of the text, for
/// errors
/// @throws as read_job()
[[nodiscard]] SLABWRIGHT_API Job job_from_toml(std::string_view toml, const std::string& name,
                                               const Job& base = default_job());

/// All keys with their defaults and comments, as a job file. @param library whose tools it lists: "shop" (the
/// default), "fixed", "forms", "metric", or "luo" for the tools of LUO table 5.4 (io/JOB.md)
/// @throws Error(usage, "job.library") for another name
[[nodiscard]] SLABWRIGHT_API std::string default_job_toml(std::string_view library = "shop");

/// Reads the pattern and plans the build. @throws Error(input | no_plan | cancelled | usage)
[[nodiscard]] SLABWRIGHT_API Plan plan(Context& context, const PatternSource& source, const Job& job);

/// A pattern that was read, for whoever plans it and verifies the plan: it is then read once. What it holds
/// is this library's.
struct Pattern;

/// Reads the pattern as `job` says. @throws Error(input | cancelled | usage)
[[nodiscard]] SLABWRIGHT_API std::shared_ptr<Pattern> read_pattern(Context& context,
                                                                   const PatternSource& source,
                                                                   const Job& job);

/// Plans the build of a pattern that was read as this job says. @throws as plan() of a source, and
/// Error(usage) when it was read otherwise
[[nodiscard]] SLABWRIGHT_API Plan plan(Context& context, const Pattern& pattern, const Job& job);

/// What plan.json holds. @throws Error(no_plan) where a number is not finite
[[nodiscard]] SLABWRIGHT_API std::string plan_document(const Plan& plan);

/// The boards that a plan takes and, where the job states prices, what it costs: a line or two in words.
/// @throws Error(no_plan, "slabs.board") where a slab is larger than a board
[[nodiscard]] SLABWRIGHT_API std::string wood_document(const Plan& plan);

/// The program of one operation of a layer of the plan, as the job's machine reads it.
/// @throws Error(no_plan, "program.unsafe")
[[nodiscard]] SLABWRIGHT_API std::string program_document(const Plan& plan, const Layer& layer,
                                                          const Operation& operation);

/// Makes sure, before hours of planning, that write() can put a plan at `directory`.
/// @throws Error(input) that names what stands against it
SLABWRIGHT_API void require_replaceable(const std::string& directory);

/// Writes plan.json, nc/, sequence.json, cut_list.csv and .dxf and, for LinuxCNC, tool.tbl into `directory`,
/// all or nothing: a fresh folder beside it is filled and then takes its place; an existing folder is
/// replaced only if it holds a plan.json of ours or is empty.
/// @param source the pattern that was planned: with it report.html is written too, where this library can
/// (plan() notes when it cannot)
/// @throws Error(input) when the place cannot be written
SLABWRIGHT_API void write(Context& context, const Plan& plan, const std::string& directory,
                          const PatternSource& source = {});

/// Writes what tools reach into `directory`, for viewers of meshes: layer_01_tool_02.ply and so on, the
/// facets of layer 1 that are to be machined with the share of each that tool 2 reaches
/// (io/write/access_ply.h), pattern-base. Of the flat and ball end mills that were looked at for a layer or
/// cut it.
/// @param source the pattern that was planned
/// @throws Error(input) when the place cannot be written or the STL is another one, Error(cancelled)
SLABWRIGHT_API void write_access_maps(Context& context, const Plan& plan, const PatternSource& source,
                                      const std::string& directory);

/// Makes report.html of a folder again, from what lies in it (verify.json among it) and the pattern.
/// @param source as verify's. @param three_d false: a light page without model and paths
/// @param size_limit_mb the page is made no larger, by showing less detail; it says how much
/// @throws Error(usage) when the library was built without the page or the limit cannot be kept, Error(input)
/// when the folder cannot be
///         understood, the STL is missing or another one, or the place cannot be written
SLABWRIGHT_API void report(Context& context, const std::string& directory, const PatternSource& source = {},
                           bool three_d = true, double size_limit_mb = 10);

/// Of the time that plan() and write_verified() take together, that of plan() and of the writing: 0.55 to
/// 0.75. A caller that shows progress begins with `context.share_progress(0, kPlanningShare)`;
/// write_verified() goes on from there.
inline constexpr double kPlanningShare = 0.67;

/// What the simulation of a folder's programs found.
struct VerifyResult {
    bool passed = false;         ///< no violation
    double pattern_mm2 = 0;      ///< of the pattern, seen from above
    double unreachable_mm2 = 0;  ///< of it: more than the tolerance is left, for no tool gets there
    double unreachable_mm = 0;   ///< the most that is left there, along the normal
    double unmade_mm3 = 0;       ///< what stays filled under part of the same layer: undercuts
    double unmade_mm = 0;        ///< its greatest height
    /// Tools that would reach what no tool of the library does, code "tool.missing", the most useful first.
    std::vector<Diagnostic> advice{};
    /// Whether the pattern comes out whole: passed, less than a cubic millimetre unmade, at most a hundredth
    /// of it out of reach.
    [[nodiscard]] bool is_whole() const {
        return passed && unmade_mm3 < 1 && unreachable_mm2 <= 0.01 * pattern_mm2;
    }
    double gouge_mm = 0;  ///< deepest place of a cutter in the part, along the normal
    double cell_mm = 0;   ///< between the points of the simulated stock
    double minutes = 0;   ///< of all programs on the plan's machine
    std::vector<Diagnostic>
        violations;       ///< what must not be, with program, line and place; empty when passed
    bool written = true;  ///< false: write_proven() has written nothing
    /// Why not: for each violation an error of kind no_plan with its place and what may help.
    std::vector<Error> refusals;
};

/// Writes as write() does, and verifies what it wrote before it takes its place: `directory` then holds
/// verify.json too, also when the programs do not make the part. Cancelled or refused, it is as it was
/// before.
/// @param source the pattern that was planned. @param cell_mm as verify's
/// @throws Error as write() and verify()
[[nodiscard]] SLABWRIGHT_API VerifyResult write_verified(Context& context, const Plan& plan,
                                                         const std::string& directory,
                                                         const PatternSource& source, double cell_mm = 0);
/// The same of a pattern that plan() was given. What the programs say is read from their text all the same.
/// Not from two threads at once with one pattern, which keeps what verification makes of it.
[[nodiscard]] SLABWRIGHT_API VerifyResult write_verified(Context& context, const Plan& plan,
                                                         const std::string& directory,
                                                         const std::shared_ptr<Pattern>& pattern,
                                                         double cell_mm = 0);

/// Writes as write_verified() does, but what the simulation finds wrong goes back into the plan first: the
/// layers that it was found in get other programs and are simulated again, four times at most. `plan` is then
/// what was written; each layer's Layer::rounds says how often that was, and diagnostics "proof.round" why.
/// Where that does not help, nothing is written and the result holds refusals.
/// @param plan of plan(), of this pattern
/// @param keep_failed also writes programs that do not make the part; the result then has not passed
/// @throws as write_verified(), and as plan() of what the other programs make of joints, travel and mass
[[nodiscard]] SLABWRIGHT_API VerifyResult write_proven(Context& context, Plan& plan,
                                                       const std::string& directory,
                                                       const std::shared_ptr<Pattern>& pattern,
                                                       bool keep_failed = false, double cell_mm = 0);

/// Simulates the programs in `directory` against the pattern, from the folder's text alone, and writes
/// verify.json into it.
/// @param source the pattern; none looks for the file that plan.json names: in the folder, beside it, where
/// the caller stands
/// @param maps_directory where a picture of each layer is written, layer_01.ppm and so on: what is left over,
/// missed, unreachable or
///        gouged; "": none
/// @param cell_mm between the points of the simulated stock, 0.01 to 10; 0: as fine as the plan's cusp asks
/// for. The check of every move
///        for gouges needs no cells and is as exact with any; with coarser ones than that an operation that
///        takes nothing is not told
/// @param keep_outs what stands on the table, in place of what the plan's job says; null: that
/// @throws Error(verification) when the folder cannot be understood, Error(input) when the STL is missing or
/// another one, Error(usage)
///         on another cell or as validate_keep_outs()
[[nodiscard]] SLABWRIGHT_API VerifyResult verify(Context& context, const std::string& directory,
                                                 const PatternSource& source = {},
                                                 const std::string& maps_directory = {}, double cell_mm = 0,
                                                 const std::vector<KeepOut>* keep_outs = nullptr);

/// Makes the report.html that lies in a folder again, as light or as full as it was; a folder without one is
/// left as it is. @throws as report()
SLABWRIGHT_API void refresh_report(Context& context, const std::string& directory,
                                   const PatternSource& source = {});

struct RenewedVerdict {
    VerifyResult result;
    std::string stale;  ///< what kept the report from being made again, a line; "": nothing
};

/// verify() and refresh_report() of what it has read. What keeps the report from being made changes no
/// verdict. @throws as verify()
[[nodiscard]] SLABWRIGHT_API RenewedVerdict reverify(Context& context, const std::string& directory,
                                                     const PatternSource& source = {},
                                                     const std::string& maps_directory = {},
                                                     double cell_mm = 0,
                                                     const std::vector<KeepOut>* keep_outs = nullptr);

enum class InspectionForm : std::uint8_t {
    json,  ///< schema slabwright.inspect/1
    text,  ///< a few lines for people
};

struct InspectionOptions {
    DrawLimits draw;         ///< of what keeps it from being drawn
    CavityOptions cavities;  ///< of what is narrow and deep
    double edge_deg = 30;    ///< edges are sharp at which faces turn by that; 1 to 179
    std::string map;         ///< file for the pattern coloured by that, PLY; "": none
};

/// Mesh report, features, undercuts, sharp edges, narrow cavities, what layers leave on each side, and what
/// keeps the pattern from being drawn. @throws Error(input) when the file cannot be read or the map not
/// written, Error(usage)
[[nodiscard]] SLABWRIGHT_API std::string inspect(Context& context, const PatternSource& source,
                                                 const Job& job, InspectionForm form = InspectionForm::json,
                                                 const InspectionOptions& options = {});

/// What a repair did.
struct RepairResult {
    InputRepair repair;                   ///< how == "none": the mesh needed none
    std::vector<Diagnostic> diagnostics;  ///< each kind of defect with count, size and place
    double volume_mm3 = 0;                ///< of the solid that was written
};

/// Mends the mesh of a file, or makes its surface anew where `job.input.repair` says so and mending does not
/// close it, and writes it as binary STL in the file's unit and place. A mesh that needs no repair is written
/// with the bytes of its file, unless the job welds within a tolerance.
/// @throws Error(input) when the file cannot be read or repaired or the place cannot be written,
/// Error(usage), Error(no_plan) when memory does not suffice, Error(cancelled)
SLABWRIGHT_API RepairResult repair(Context& context, const PatternSource& source, const std::string& out,
                                   const Job& job);

/// Results and errors as JSON, for programs that call the command or serve its answers: an error on one line;
/// what a plan in `directory` holds and, where it was verified, what was found; what a repair did that wrote
/// `out`; what the report is called.
[[nodiscard]] SLABWRIGHT_API std::string error_json(const Error& error, std::span<const Error> also = {});
[[nodiscard]] SLABWRIGHT_API std::string plan_summary_json(const Plan& plan, const std::string& directory,
                                                           const VerifyResult* found);
[[nodiscard]] SLABWRIGHT_API std::string repair_summary_json(const RepairResult& result,
                                                             const std::string& out);
[[nodiscard]] SLABWRIGHT_API std::string report_summary_json(const std::string& directory);

/// Text that a terminal may be given, whatever names it holds: control characters become spaces, bytes that
/// are no UTF-8 question marks. @param one_line line breaks too
[[nodiscard]] SLABWRIGHT_API std::string terminal_text(std::string_view text, bool one_line);

/// `value` rounded to `decimals` (0 … 9) places, trailing zeros cut; never "-0", whatever the locale.
/// @throws Error(no_plan, "number.not_finite")
[[nodiscard]] SLABWRIGHT_API std::string number_text(double value, int decimals);

/// Sections every `every_mm` (at its multiples above the bottom) written by the ending of `out`: .svg, .dxf
/// or .json.
SLABWRIGHT_API void slice_to_file(Context& context, const PatternSource& source, const Job& job,
                                  double every_mm, const std::string& out);

}  // namespace slabwright
