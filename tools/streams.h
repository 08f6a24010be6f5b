// What the command says on stdout and stderr.
#pragma once

#include <span>
#include <string_view>

#include "kernels/errors.h"

namespace slabwright {

/// One line on stderr. @param also further errors of the same kind, which JSON names in the same object
/// @return the exit code
int complain(const Error& error, bool as_json, std::span<const Error> also = {});

/// On stdout, at once. @throws Error(input, "stdout.unwritable") where it does not arrive, on a full disk for
/// one
void print(std::string_view text);

}  // namespace slabwright
