// Posts of the user's own: any text is a post whose programs read back as they were meant, or one clear
// error.
#include "io/read/own_post.h"
#include "tests/fuzz/fuzz.h"

using namespace slabwright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::expect_clear_error([&] { (void)parse_own_post(fuzz::text(data, size), "post.toml"); });
    return 0;
}
