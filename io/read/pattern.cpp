#include "io/read/pattern.h"

#include <filesystem>

#include "engine/schedule/supports.h"
#include "kernels/errors.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

/// Where the pattern lies: as named, or where plan.json's file name leads.
fs::path find_pattern(const fs::path& directory, const std::string& file, const std::string& asker) {
    const auto refuse = [&](const std::string& message) -> fs::path {
        throw Error(ErrorKind::input, asker + ".no_pattern", message, directory.string(),
                    "name the STL with --stl");
    };
    const fs::path base = fs::path(file).filename();
    if (base.empty()) return refuse("plan.json names no pattern");
    fs::path folder = fs::absolute(directory).lexically_normal();
    if (!folder.has_filename()) folder = folder.parent_path();
    for (const fs::path& place : {folder / base, folder.parent_path() / base, base})
        if (std::error_code ignored; fs::exists(place, ignored)) return place;
    return refuse("the pattern " + base.string() + " is neither in nor beside the folder");
}

}  // namespace

bool Pattern::is(const PlannedPattern& planned) const {
    return read.input.sha256 == planned.sha256 && reading == planned.reading &&
           ((supports.empty() && drills.diameters.empty()) ||
            (supports == planned.supports && drills == planned.drills));
}

std::shared_ptr<Pattern> as_planned(Context& context, std::shared_ptr<Pattern> pattern,
                                    const PlannedPattern& planned) {
    const bool has_drills = !planned.drills.diameters.empty();
    if (pattern->supports == planned.supports && (!has_drills || pattern->drills == planned.drills))
        return pattern;
    auto more = std::make_shared<Pattern>(
        Pattern{pattern->place, pattern->reading, pattern->read, {}, planned.supports, planned.drills});
    if (std::optional<Mesh> rounded = rounded_for_drills(context, more->read.mesh.view(), planned.drills))
        more->read.mesh = std::move(*rounded);
    if (!planned.supports.empty())
        more->read.mesh = with_supports(context, more->read.mesh.view(), planned.supports);
    return more;
}

std::shared_ptr<Pattern> read_planned_pattern(Context& context, const std::string& directory,
                                              const PlannedPattern& planned, const PatternSource& given,
                                              const std::string& asker) {
    const PatternSource source =
        given.empty() ? PatternSource(find_pattern(directory, planned.file, asker).string()) : given;
    auto pattern = std::make_shared<Pattern>(Pattern{
        source.name(), planned.reading, read_pattern_mesh(context, source, planned.reading), {}, {}, {}});
    if (!pattern->is(planned))
        throw Error(ErrorKind::input, asker + ".other_pattern",
                    "is not the pattern that was planned: its SHA-256 is " + pattern->read.input.sha256,
                    source.name(), "name the planned STL with --stl, or plan again");
    return as_planned(context, std::move(pattern), planned);
}

}  // namespace slabwright
