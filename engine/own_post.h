// A post of the user's own, as far as the engine knows of it: it names program files by it and hands it on to
// those who write and read programs (io/posts/dialect.h).
#pragma once

#include <string>

namespace slabwright {

struct OwnPost {
    std::string name;    ///< in messages
    std::string text;    ///< the bytes of its file, which a plan's folder keeps
    std::string ending;  ///< of its program files, ".nc"; "": as its base has it

    virtual ~OwnPost() = default;

protected:
    OwnPost() = default;
    OwnPost(const OwnPost&) = default;
    OwnPost& operator=(const OwnPost&) = default;
};

}  // namespace slabwright
