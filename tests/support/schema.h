// Whether a text keeps a schema, asked of python3-jsonschema.
#pragma once

#include <cstdlib>
#include <string>

#include "tests/support/files.h"
#include "tests/support/temporary_folder.h"

namespace slabwright::support {

/// What jsonschema (python3-jsonschema) says; "" when the text keeps the schema.
/// @param schema the path of its file
inline std::string schema_complaint(const std::string& text, const std::string& schema) {
    const TemporaryFolder folder;
    spit(folder.path / "it.json", text);
    const std::string command = "/usr/bin/python3 -m jsonschema -i '" + (folder.path / "it.json").string() +
                                "' '" + schema + "' >'" + (folder.path / "log").string() +
                                "' 2>&1 </dev/null";
    const int status = std::system(command.c_str());
    if (status == 0) return "";
    const std::string log = slurp(folder.path / "log");
    return log.empty() ? "status " + std::to_string(status) : log;
}

}  // namespace slabwright::support
