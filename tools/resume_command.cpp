#include "tools/resume_command.h"

#include <chrono>
#include <new>

namespace slabwright {

CLI::App* add_resume_command(CLI::App& app, std::string& directory, ResumeOptions& options) {
    CLI::App* command =
        app.add_subcommand("resume", "where an interrupted build stands: what to check, and what is left");
    command->add_option("OUT", directory, "folder of the plan")->required();
    command
        ->add_option("--after", options.after,
                     "the last step that was finished, as sequence.json numbers them; 0: none. It is "
                     "written to OUT/progress.json")
        ->check(CLI::Range(0, 1'000'000'000));
    command
        ->add_option("--remake", options.remake,
                     "a spoilt layer: writes OUT/resume_NNN with the programs that face it off and the "
                     "sequence that makes it again")
        ->check(CLI::Range(0, 1'000'000'000));
    return command;
}

std::string run_resume(Context& context, const std::string& directory, const ResumeOptions& options,
                       bool json) {
    ResumeOptions now = options;
    now.now_s =
        std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
            .count();
    const ResumeStatus status = resume_build(context, directory, now);
    try {
        return json ? resume_json(status) : resume_text(status, directory);
    } catch (const std::bad_alloc&) {
        if (!options.after && !options.remake) throw;
        return {};  // it is written, whether or not that can be said
    }
}

}  // namespace slabwright
