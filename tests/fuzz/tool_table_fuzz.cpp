// Tool tables: any text gives findings, or one clear error.
#include "io/posts/tool_table_check.h"
#include "tests/fuzz/fuzz.h"

using namespace slabwright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::expect_clear_error(
        [&] { (void)check_tool_table(fuzz::text(data, size), "tool.tbl", Job{}.tools); });
    return 0;
}
