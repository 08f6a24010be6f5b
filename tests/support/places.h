// Where the checkout, the command and the shim that makes system calls fail lie. These are told to one source
// (places.cpp): so no other differs from folder to folder, and a compiler's cache serves every checkout.
#pragma once

#include <string>

namespace slabwright::support {

/// @param path of a file of the checkout, from its root, as "tests/data/pump-cover.stl"
std::string checkout(const std::string& path);

/// The built command's path.
std::string built_command();

/// The path of the library that makes system calls fail (tests/faults/fault_shim.cpp); empty where it isn't
/// built.
std::string fault_shim();

}  // namespace slabwright::support
