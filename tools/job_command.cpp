#include "tools/job_command.h"

#include "io/slabwright.h"

namespace slabwright {

CLI::App* add_job_command(CLI::App& app, JobOptions& options) {
    CLI::App* command = app.add_subcommand("job", "job files, and posts of your own to begin with");
    CLI::Option_group* what = command->add_option_group("what");
    what->add_flag("--defaults", options.defaults, "print every key with its default and a comment");
    what->add_option("--post-file", options.post_file,
                     "print a post file that writes as this control's own dialect does");
    what->require_option(1);
    command->add_option(
        "--library", options.library,
        "with these tools instead of the shop's: fixed, forms, metric, or luo (Luo table 5.4)");
    command->add_flag("--json", options.json, "errors as JSON on stderr");
    return command;
}

std::string run_job(const JobOptions& options) {
    if (!options.post_file.empty()) return post_file_toml(options.post_file);
    return default_job_toml(options.library.empty() ? "shop" : options.library);
}

}  // namespace slabwright
