// Errors that cross a room's border. One exception type; its kind is the command's exit code, its code names
// the reason.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "kernels/export.h"

namespace slabwright {

/// What went wrong, by whose fault; the value is the exit code of the command.
enum class ErrorKind {
    usage = 2,         ///< a wrong option or job file
    input = 3,         ///< the mesh file is unusable
    no_plan = 4,       ///< no plan can make this part with this job (or within this memory)
    verification = 5,  ///< the programs do not make the part
    cancelled = 6,     ///< the caller asked to stop
};

/// One clear line: what is wrong, where, and what to do about it. `what()` joins the three.
class SLABWRIGHT_API Error : public std::runtime_error {
public:
    /// @param code   stable family.name, e.g. "stl.truncated"
    /// @param message what is wrong, without a full stop
    /// @param place  file, offset, facet or coordinates; may be empty
    /// @param remedy what the user can do; may be empty
    Error(ErrorKind kind, std::string code, std::string message, std::string place = {},
          std::string remedy = {})
        : std::runtime_error(join(message, place, remedy)),
          kind_(kind),
          code_(std::move(code)),
          message_(std::move(message)),
          place_(std::move(place)),
          remedy_(std::move(remedy)) {}

    [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }
    [[nodiscard]] const std::string& code() const noexcept { return code_; }
    [[nodiscard]] const std::string& message() const noexcept { return message_; }
    [[nodiscard]] const std::string& place() const noexcept { return place_; }
    [[nodiscard]] const std::string& remedy() const noexcept { return remedy_; }

private:
    static std::string join(const std::string& message, const std::string& place, const std::string& remedy) {
        std::string line = place.empty() ? message : place + ": " + message;
        if (!remedy.empty()) line += "; " + remedy;
        return line;
    }
    ErrorKind kind_;
    std::string code_, message_, place_, remedy_;
};

}  // namespace slabwright
