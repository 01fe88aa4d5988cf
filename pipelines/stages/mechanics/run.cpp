// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/mechanics/mechanics.h"

#include <numeric>

#include "organbake/core/files.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/pipelines/stage_binding.h"
#include "organbake/pipelines/stage_module.h"
#include "stages/mechanics/options.h"

namespace organbake {
namespace {

StageReport run(const StageCall& call) {
  const auto asked = call.options_as<MechanicsStageOptions>();
  const MechanicsOptions& options = asked.mechanics;
  options.check();
  const TriangleMesh proxy = read_mesh(*call.input("proxy"), asked.frame, call.context);
  const MechanicsModel model = make_mechanics(proxy, options, call.context);
  write_file_atomically(call.output_folder / "mechanics.json", mechanics_to_json(model));

  StageReport report;
  report.add("springs", model.springs.size());
  report.add("anchors", model.anchors.size());
  report.add("mass_kg", std::accumulate(model.mass_kg.begin(), model.mass_kg.end(), 0.0));
  if (model.body) report.add("tetrahedra", model.body->tetrahedra.size());
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
