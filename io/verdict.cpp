#include "io/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "engine/keep_out.h"
#include "engine/undersides/floors.h"
#include "io/front_door.h"
#include "io/read/input_file.h"
#include "io/report_html.h"

namespace slabwright {

VerifyResult verdict(const Verification& found) {
    VerifyResult result;
    result.passed = found.report.passed();
    result.gouge_mm = found.report.gouge_max;
    result.cell_mm = found.report.cell;
    result.minutes = found.report.seconds / 60;
    result.pattern_mm2 = found.report.pattern_mm2;
    result.unreachable_mm2 = found.report.unreachable_mm2();
    result.unreachable_mm = found.report.unreachable().size;
    result.unmade_mm3 = found.report.unmade_mm3();
    result.unmade_mm = found.report.unmade().size;
    for (const MissingTool& m : found.missing)
        result.advice.push_back(
            {Severity::note, "tool.missing",
             fmt::format(
                 "a {} (flutes {:g} mm, stick-out {:g} mm) would reach {:.0f} mm² of {:.0f} mm² that no "
                 "tool reaches, up to {:.2f} mm deep, in about {:.0f} min",
                 m.tool.name, m.tool.flute_length, m.tool.stickout, m.gain_mm2, result.unreachable_mm2,
                 m.depth_mm, std::max(1.0, m.minutes)),
             m.where});
    for (const UndersideFindings& under : found.undersides)
        if (under.floor && found.strength_mpa > 0 && under.floor->stress_mpa() > found.strength_mpa)
            result.advice.push_back(
                weak_floor(under.layer, *under.floor, {0, under.floor_pressure_mpa}, found.strength_mpa));
    for (const Violation& v : found.report.violations) {
        Diagnostic d{Severity::error, v.code, v.message, v.where};
        if (!v.file.empty())
            d.message = v.line > 0 ? fmt::format("{}:{}: {}", v.file, v.line, v.message)
                                   : fmt::format("{}: {}", v.file, v.message);
        result.violations.push_back(std::move(d));
    }
    return result;
}

void check_cell(double cell_mm) {
    if (cell_mm != 0 && !(cell_mm >= 0.01 && cell_mm <= 10))
        throw Error(ErrorKind::usage, "verify.cell",
                    fmt::format("a stock cannot be simulated with points every {} mm", cell_mm), "--cell",
                    "give 0.01 to 10, or none");
}

void report(Context& context, const std::string& directory, const PatternSource& source, bool three_d,
            double size_limit_mb) {
    guarded([&] { write_report(context, directory, {source, three_d, size_limit_mb}); });
}

namespace {

// A report that lies in the folder is made again, as light or as full as it was.
void refresh(Context& context, const std::string& directory, const PatternSource& source,
             std::optional<Verification> verified) {
    // The page's own parts lie in its first half megabyte, what it shows behind them.
    std::string head;
    try {
        const InputFile file(std::filesystem::path(directory) / "report.html",
                             {ErrorKind::input, "report.page", kMostProgramBytes});
        head.resize(std::min<std::uint64_t>(file.size(), kMebibyte));
        file.read(0, head.data(), head.size());
    } catch (const Error&) {
        return;
    }
    const bool three_d = head.find("<section id=\"view\"") != std::string::npos;
    write_report(context, directory, {source, three_d}, std::move(verified));
}

Verification verified(Context& context, const std::string& directory, const PatternSource& source,
                      const std::string& maps_directory, double cell_mm,
                      const std::vector<KeepOut>* keep_outs) {
    check_cell(cell_mm);
    if (keep_outs != nullptr) validate_keep_outs(*keep_outs);
    VerifyOptions options;
    options.keep_outs = keep_outs;
    options.source = source;
    options.cell = cell_mm;
    options.maps_directory = maps_directory;
    return verify_folder(context, directory, options);
}

}  // namespace

void refresh_report(Context& context, const std::string& directory, const PatternSource& source) {
    guarded([&] { refresh(context, directory, source, {}); });
}

VerifyResult verify(Context& context, const std::string& directory, const PatternSource& source,
                    const std::string& maps_directory, double cell_mm,
                    const std::vector<KeepOut>* keep_outs) {
    return guarded(
        [&] { return verdict(verified(context, directory, source, maps_directory, cell_mm, keep_outs)); });
}

RenewedVerdict reverify(Context& context, const std::string& directory, const PatternSource& source,
                        const std::string& maps_directory, double cell_mm,
                        const std::vector<KeepOut>* keep_outs) {
    return guarded([&] {
        Verification found = verified(context, directory, source, maps_directory, cell_mm, keep_outs);
        RenewedVerdict both{verdict(found), {}};
        try {
            guarded([&] { refresh(context, directory, source, std::move(found)); });
        } catch (const Error& error) {
            if (error.kind() == ErrorKind::cancelled) throw;
            both.stale =
                fmt::format("{}/report.html could not be brought up to date: {}\n", directory, error.what());
        }
        return both;
    });
}

}  // namespace slabwright
