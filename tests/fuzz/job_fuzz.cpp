// Job files: any text is a job that is written and read again as itself, or one clear error.
#include "io/read/job_toml.h"
#include "io/write/job_toml.h"
#include "tests/fuzz/fuzz.h"

using namespace slabwright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::expect_clear_error([&] {
        const Job job = parse_job(fuzz::text(data, size), "job.toml");
        const std::string written = job_toml(job);
        fuzz::require(job_toml(parse_job(written, "written.toml")) == written,
                      "a job that is another one once written and read");
    });
    return 0;
}
