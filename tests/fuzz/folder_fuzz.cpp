// A planned folder of which one file is another: verification gives a verdict, and an interrupted build its
// state, or one clear error.
// The first byte says which file; the rest is its text, or, where that begins with '~', edits of the good
// one.
#include <array>
#include <string>

#include "io/resume.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "tests/fuzz/fuzz.h"
#include "tests/mesh_shapes.h"
#include "tests/support/files.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;

namespace {

struct Planned {
    support::TemporaryFolder folder;
    Context context{{.threads = 1, .memory_bytes = std::uint64_t{1} << 30}};
    std::shared_ptr<Pattern> pattern;
    std::array<std::string, 5> names{"plan.json", "sequence.json", "tool.tbl", "", "progress.json"}, good{};

    Planned() {
        const std::string stl = folder / "part.stl";
        write_stl(stl, weld(context, shapes::box({0, 0, 0}, {30, 20, 12})));
        const Job job;
        pattern = read_pattern(context, stl, job);
        const Plan plan = slabwright::plan(context, *pattern, job);
        slabwright::write(context, plan, folder / "out");
        names[3] = "nc/" + plan.layers.front().operations.back().file;
        (void)resume_build(context, folder / "out", {.after = 3, .remake = {}, .now_s = 1'000'000});
        for (std::size_t i = 0; i < names.size(); ++i) good[i] = support::slurp(folder / ("out/" + names[i]));
    }
};

/// Each edit takes six bytes: where (of 16 777 216 parts of the text), how much goes, and what comes instead.
std::string edited(std::string text, const std::uint8_t* data, std::size_t size) {
    for (std::size_t i = 0; i + 6 <= size; i += 6) {
        const std::uint64_t share =
            (std::uint64_t{data[i]} << 16) | (std::uint64_t{data[i + 1]} << 8) | data[i + 2];
        const auto at = static_cast<std::size_t>(share * text.size() >> 24);
        std::string comes;
        for (const std::uint8_t byte : {data[i + 4], data[i + 5]})
            if (byte != 0) comes += static_cast<char>(byte);
        text.replace(at, std::min<std::size_t>(data[i + 3] % 32, text.size() - at), comes);
    }
    return text;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static Planned planned;
    if (size == 0) return 0;
    const std::size_t which = data[0] % planned.names.size();
    const bool edits = size > 1 && data[1] == '~';
    const std::string file = planned.folder / ("out/" + planned.names[which]);
    support::spit(file, edits ? edited(planned.good[which], data + 2, size - 2)
                              : std::string(fuzz::text(data + 1, size - 1)));
    fuzz::expect_clear_error([&] {
        const ResumeStatus status = resume_build(planned.context, planned.folder / "out",
                                                 {.after = {}, .remake = {}, .now_s = 1'000'600});
        fuzz::require(!resume_json(status).empty(), "a status without words");
    });
    if (planned.names[which] != "progress.json")
        fuzz::expect_clear_error([&] {
            const Verification verdict = verify_folder(planned.context, planned.folder / "out",
                                                       {.source = planned.folder / "part.stl",
                                                        .pattern = planned.pattern,
                                                        .cell = 2,
                                                        .write = false});
            for (const Violation& v : verdict.report.violations)
                fuzz::require(!v.code.empty(), "a violation without a code");
        });
    support::spit(file, planned.good[which]);
    return 0;
}
