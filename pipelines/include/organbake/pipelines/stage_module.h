// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/core/version.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

// Loads the module that holds a stage's run and calls it. Modules carry the heavy libraries, so
// that a program pays for VTK or CGAL only when a stage that needs them runs. Throws what the stage
// throws; a missing module or one of another build is an internal error.
StageReport run_in_module(const Stage& stage, const StageCall& call);

// Where modules lie: ../lib/organbake beside the folder of the running program.
std::filesystem::path module_folder();
std::filesystem::path module_file(const std::string& stage);

}  // namespace organbake

// Put once at the end of a stage's source: the door through which the front program comes in.
#define ORGANBAKE_STAGE_MODULE(run)                                                         \
  extern "C" __attribute__((visibility("default"))) const char* organbake_stage_version() { \
    return organbake::kVersion;                                                             \
  }                                                                                         \
  extern "C" __attribute__((visibility("default"))) void organbake_stage_run(               \
      const organbake::StageCall& call, organbake::StageReport& report) {                   \
    report = run(call);                                                                     \
  }
