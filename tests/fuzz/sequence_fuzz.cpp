// sequence.json: any text is a sequence that the machine of states replays, or one clear error.
#include "io/read/sequence_reader.h"
#include "tests/fuzz/fuzz.h"

using namespace slabwright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::expect_clear_error([&] {
        const BuildSequence sequence = read_sequence(fuzz::text(data, size));
        BuildPlan plan;
        plan.layers.push_back({.index = 1, .z_bottom = 0, .z_top = 18, .slab_thickness = 19, .joints = {}});
        (void)replay_build(plan, sequence);
    });
    return 0;
}
