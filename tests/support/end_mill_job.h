// A job whose layers are roughed by the end mill alone.
#pragma once

#include "engine/job.h"

namespace slabwright::test {

inline Job end_mill_job() {
    Job job;
    job.cutting.open_waste = false;
    return job;
}

}  // namespace slabwright::test
