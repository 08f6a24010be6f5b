// Programs: any text is a bounded list of motions, or one clear error; a program that reads is judged.
#include <cmath>

#include "engine/job.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/program_check.h"
#include "tests/fuzz/fuzz.h"

using namespace slabwright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::expect_clear_error([&] {
        const Program program = read_gcode(fuzz::text(data, size), "a.ngc");
        for (const ProgramStep& step : program.steps)
            fuzz::require(!step.known() || std::hypot(step.x, step.y, step.z) < 1e6, "a motion to nowhere");
        const Job job;
        const Tool* loaded = nullptr;
        for (const Tool& tool : job.tools)
            if (tool.number == program.tool) loaded = &tool;
        (void)check_program(program, {.spindle_rpm = 12000, .blend = 0.02, .feeds = {}}, loaded, job.machine);
    });
    return 0;
}
