// What every entry of the library does with what is thrown inside it.
#pragma once

#include <exception>
#include <filesystem>
#include <new>

#include "kernels/errors.h"

namespace slabwright {

/// Runs the body of an entry. @throws Error and nothing else
template <class Body>
auto guarded(Body&& body) -> decltype(body()) {
    try {
        return body();
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::no_plan, "memory.exhausted", "the machine has no more memory", "",
                    "give fewer facets, or a machine with more memory");
    } catch (const std::filesystem::filesystem_error& error) {
        throw Error(ErrorKind::input, "file.system", error.code().message(), error.path1().string(),
                    "check the path and its rights");
    } catch (const std::exception& error) {
        throw Error(ErrorKind::no_plan, "internal", error.what(), "",
                    "report this with the pattern and the job");
    }
}

}  // namespace slabwright
