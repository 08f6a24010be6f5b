#include "io/read/repair.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "kernels/errors.h"
#include "kernels/repair/rebuild.h"
#include "kernels/repair/repair.h"

namespace slabwright {

namespace {

/// How a kind of defect is told: "{did} {count} {one or many}{size}".
struct Words {
    Defect defect;
    std::string_view code, doing, did, one, many, size;  ///< size: a format of the largest one's, or ""
    std::string_view unit;
};

constexpr std::array<Words, kDefects> kWords{{
    {Defect::degenerate, "degenerate", "drop", "dropped", "facet without area", "facets without area", "",
     ""},
    {Defect::duplicate, "duplicate", "drop", "dropped", "facet given twice", "facets given twice",
     " of at most {} mm^2", "mm^2"},
    {Defect::crack, "crack", "close", "closed", "crack", "cracks", " of at most {} mm", "mm"},
    {Defect::t_junction, "t_junction", "split", "split", "edge at vertices beside it",
     "edges at vertices beside them", ", at most {} mm off", "mm"},
    {Defect::turned, "turned", "turn over", "turned over", "patch", "patches", " of at most {} mm^2", "mm^2"},
    {Defect::hole, "hole", "fill", "filled", "hole", "holes", " of at most {} mm^2", "mm^2"},
    {Defect::stray, "stray", "drop", "dropped", "fragment that encloses nothing",
     "fragments that enclose nothing", " of at most {} mm^2", "mm^2"},
    {Defect::inside_out, "inside_out", "turn over", "turned over", "body that is inside out",
     "bodies that are inside out", " of at most {} mm^3", "mm^3"},
}};

/// Rounded up to two digits, and to whole ones from 100 on: what is told is never less than what was.
std::string sized(double value) {
    constexpr double least = 0.001;
    if (value <= least) return "0.001";
    const double digit = value >= 100 ? 1 : std::pow(10.0, std::floor(std::log10(value)) - 1);
    return fmt::format("{:.6g}", std::ceil(value / digit - 1e-6) * digit);
}

std::string told(const Words& words, const MendedDefect& found, std::string_view verb) {
    std::string text = fmt::format("{} {} {}", verb, found.count, found.count == 1 ? words.one : words.many);
    if (!words.size.empty()) text += fmt::format(fmt::runtime(words.size), sized(found.size));
    return text;
}

std::string left_open(const LeftDefects& left) {
    if (left.sheets > 0)
        return fmt::format("{} {} of surface that {} nothing, {} mm^2 in all", left.sheets,
                           left.sheets == 1 ? "piece" : "pieces", left.sheets == 1 ? "encloses" : "enclose",
                           sized(left.sheet_mm2));
    if (left.holes > 0)
        return fmt::format("{} {} of up to {} mm across", left.holes, left.holes == 1 ? "hole" : "holes",
                           sized(left.hole_mm));
    return "facets that do not agree on the outside";
}

void tell(const Mended& mended, Repaired& result) {
    for (const Words& words : kWords) {
        const MendedDefect& found = mended[words.defect];
        if (found.count == 0) continue;
        result.told.defects.push_back(
            {std::string(words.code), found.count, found.size, std::string(words.unit), found.where});
        result.diagnostics.push_back({Severity::warning, "repair." + std::string(words.code),
                                      "the repair " + told(words, found, words.did), found.where});
    }
    result.told.moved_mm = mended.moved_mm;
}

/// What mending leaves open is made anew around what its facets enclose.
void rebuild_into(Context& context, MeshView given, const Mended& mended, const std::string& path,
                  Repaired& result) {
    Rebuilt rebuilt = rebuild(context, mended.mesh.view(), given);
    if (!rebuilt.solid)
        throw Error(ErrorKind::input, "repair.nothing",
                    rebuilt.mesh.facets.empty()
                        ? "the facets enclose nothing that a surface could be made around"
                        : "the surface that was made anew is no solid",
                    path, "close the mesh in the program that made it");
    result.told.how = "rebuild";
    result.told.cell_mm = rebuilt.cell_mm;
    result.told.deviation_mm = rebuilt.deviation_mm;
    result.told.missed_mm = rebuilt.missed_mm;
    result.diagnostics.push_back(
        {Severity::warning, "repair.rebuilt",
         fmt::format(
             "mending left {}: the surface was made anew in cells of {} mm; it lies up to {} mm off the "
             "mesh, and the mesh up to {} mm off it",
             left_open(mended.left), sized(rebuilt.cell_mm), sized(rebuilt.deviation_mm),
             sized(rebuilt.missed_mm)),
         mended.left.where});
    result.mesh = std::move(rebuilt.mesh);
    result.report = std::move(rebuilt.report);
}

}  // namespace

Repaired repair_mesh(Context& context, MeshView mesh, const MeshReport& report, Repair how,
                     const std::string& path) {
    Repaired result;
    result.told.how = "none";
    result.told.triangles = mesh.size();
    if (how == Repair::none || is_solid(report)) return result;
    Mended mended = mend(context, mesh, report);
    // Pieces that enclose nothing leave no side for a surface to be made on.
    const bool nothing = mended.left.sheets > 0;
    if (!mended.solid && (how == Repair::mend || nothing)) {
        const std::array<double, 3>& at = mended.left.where;
        throw Error(ErrorKind::input, nothing ? "repair.nothing" : "repair.open",
                    "mending leaves " + left_open(mended.left),
                    fmt::format("{} at ({:.3f}, {:.3f}, {:.3f}) mm", path, at[0], at[1], at[2]),
                    nothing
                        ? "close the mesh in the program that made it"
                        : "--repair=rebuild makes the surface anew; or close the mesh in the program that "
                          "made it");
    }
    result.told.how = "mend";
    tell(mended, result);
    if (mended.solid) {
        result.mesh = std::move(mended.mesh);
        result.report = std::move(mended.report);
    } else {
        rebuild_into(context, mesh, mended, path, result);
    }
    result.told.triangles = result.mesh.facets.size();
    return result;
}

std::string repair_offer(Context& context, MeshView mesh, const MeshReport& report) {
    constexpr std::size_t most = 5'000'000;  // facets for which trying takes no longer than reading
    if (mesh.size() > most) return "--repair may mend it";
    const Mended mended = mend(context, mesh, report);
    if (!mended.solid && mended.left.sheets > 0) return "no repair helps: it has " + left_open(mended.left);
    if (!mended.solid)
        return "--repair would leave " + left_open(mended.left) + ", only --repair=rebuild would close it";
    std::vector<std::string> parts;
    for (const Words& words : kWords)
        if (const MendedDefect& found = mended[words.defect]; found.count > 0)
            parts.push_back(told(words, found, words.doing));
    std::string text = "--repair would ";
    for (std::size_t i = 0; i < parts.size(); ++i)
        text += (i == 0 ? "" : i + 1 == parts.size() ? " and " : ", ") + parts[i];
    return text;
}

}  // namespace slabwright
