#include "io/posts/probe_program.h"

#include <fmt/format.h>

#include "io/posts/dialect.h"
#include "io/posts/gcode_writer.h"
#include "io/text/json_text.h"

namespace slabwright {

namespace {

std::string comment(const Dialect& dialect, const std::string& text) {
    std::string inside = comment_text(text);
    if (inside.size() > dialect.longest_comment) inside.resize(dialect.longest_comment);
    return "(" + inside + ")\n";
}

}  // namespace

std::string probe_text(const Plan& plan, const ProbeProgram& probe) {
    const Probing& probing = plan.job.probing;
    const Dialect dialect = dialect_of(plan.job.machine);
    const auto length = [&](double mm) { return rounded_text(mm / dialect.unit_mm(), dialect.decimals); };
    const auto feed = [&](double mm_min) {
        return rounded_text(mm_min / dialect.feed_unit, dialect.feed_decimals);
    };
    const auto& [x, y, z] = probe.touches;
    std::string text = comment(dialect, fmt::format("Slabwright {}: {}", SLABWRIGHT_VERSION, probe.file));
    text += comment(dialect, fmt::format("layer {}: finds z 0 with tool {}", probe.layer, probe.tool));
    text += comment(dialect, fmt::format("touches the reference at x {} y {} mm", rounded_text(x, 2),
                                         rounded_text(y, 2)));
    text += comment(dialect, fmt::format("begin with the tip over it, {} mm above at most",
                                         rounded_text(probing.search / 2, 2)));
    text += fmt::format("{} G17 G90 G94 G40 G49 G80\n", dialect.inch() ? "G20" : "G21");
    text += dialect.changes_tools ? fmt::format("G54\nT{0} M6\nG43 H{0}\n", probe.tool)
                                  : fmt::format("G54\nT{}\n", probe.tool);
    text += fmt::format("M5\nG91\nG38.2 Z-{} F{}\nG0 Z{}\nG38.2 Z-{} F{}\n", length(probing.search),
                        feed(probing.fast_feed), length(kProbeBack), length(2 * kProbeBack),
                        feed(probing.slow_feed));
    text += fmt::format("G10 L20 P1 Z{}\nG0 Z{}\nG90\nM2\n", length(z), length(probing.retract));
    return text;
}

}  // namespace slabwright
