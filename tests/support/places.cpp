#include "tests/support/places.h"

namespace slabwright::support {

std::string checkout(const std::string& path) { return std::string(SLABWRIGHT_SOURCE_DIR "/").append(path); }

std::string built_command() { return SLABWRIGHT_COMMAND; }

std::string fault_shim() { return SLABWRIGHT_FAULT_SHIM; }

}  // namespace slabwright::support
