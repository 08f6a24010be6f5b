// Programs: any text is, in any dialect, a bounded list of motions, or one clear error; a program that reads
// is judged.
#include <cmath>

#include "engine/job.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/program_check.h"
#include "tests/fuzz/fuzz.h"

using namespace slabwright;

namespace {

void read(std::string_view text, const Dialect& dialect) {
    const Program program = read_program_text(text, "a.ngc", dialect);
    for (const ProgramStep& step : program.steps)
        fuzz::require(!step.known() || std::hypot(step.x, step.y, step.z) < 1e6, "a motion to nowhere");
    const Job job;
    const Tool* loaded = nullptr;
    for (const Tool& tool : job.tools)
        if (tool.number == program.tool) loaded = &tool;
    (void)check_program(program, {.spindle_rpm = 12000, .blend = 0.02, .feeds = {}}, loaded, job.machine);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    for (const LengthUnit units : {LengthUnit::mm, LengthUnit::inch})
        for (const Post post : {Post::linuxcnc, Post::fanuc, Post::haas, Post::grbl, Post::mach, Post::iso,
                                Post::siemens, Post::heidenhain})
            fuzz::expect_clear_error([&] { read(fuzz::text(data, size), dialect_of(post, units)); });
    return 0;
}
