// A locale with decimal commas, for proving that nothing listens to locales. Debian installs none, so it is
// compiled on the spot.
#pragma once

#include <unistd.h>

#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <locale>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_folder.h"

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

namespace slabwright::support {

/// Compiles de_DE.UTF-8 into a folder that lives as long as this object. LOCPATH must name `folder`, LC_ALL
/// `name`.
struct CommaLocale {
    TemporaryFolder temporary;
    std::string folder = temporary.path.string(), name = "de_DE.UTF-8";
    bool made = false;
    CommaLocale() {
        (void)std::system(
            ("localedef -i de_DE -f UTF-8 '" + folder + "/" + name + "' >/dev/null 2>&1 </dev/null").c_str());
        made = std::filesystem::exists(folder + "/" + name);
    }
    CommaLocale(const CommaLocale&) = delete;
    CommaLocale& operator=(const CommaLocale&) = delete;
};

/// Makes it this process's own, in C and in C++, until the end of the scope. `active` says whether that
/// worked.
struct CommaScope {
    explicit CommaScope(const CommaLocale& locale) {
        if (!locale.made) return;
        ::setenv("LOCPATH", locale.folder.c_str(), 1);
#if defined(__SANITIZE_ADDRESS__)
        const __lsan::ScopedDisabler glibc_keeps_the_parsed_locpath;
#endif
        try {
            before_ = std::locale::global(std::locale(locale.name));  // a named locale sets C's as well
            active = std::string(std::localeconv()->decimal_point) == ",";
        } catch (const std::runtime_error&) {
            active = false;
        }
    }
    ~CommaScope() {
        std::locale::global(before_);
        std::setlocale(LC_ALL, "C");
        ::unsetenv("LOCPATH");
    }
    CommaScope(const CommaScope&) = delete;
    CommaScope& operator=(const CommaScope&) = delete;
    bool active = false;

private:
    std::locale before_ = std::locale::classic();
};

}  // namespace slabwright::support
