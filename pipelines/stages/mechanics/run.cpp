// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/mechanics/mechanics.h"

#include <numeric>
#include <string>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/pipelines/stage.h"
#include "stages/mechanics/options.h"

namespace organbake {
namespace {

// An organ that cannot have tetrahedra is played by springs, unless some were asked for by more
// than the default.
MechanicsModel model_of(const TriangleMesh& proxy, MechanicsOptions options,
                        const RunContext& context) {
  if (!options.fem || options.fem_cell_mm > 0) return make_mechanics(proxy, options, context);
  try {
    return make_mechanics(proxy, options, context);
  } catch (const Error& why) {
    if (why.code() != ExitCode::bad_data && why.code() != ExitCode::usage) throw;
    options.fem = false;
    const MechanicsModel springs = make_mechanics(proxy, options, context);  // or fails alike
    context.warn(std::string("no tetrahedra, so it is played by springs: ") + why.what());
    return springs;
  }
}

StageReport run(const StageCall& call) {
  const auto asked = call.options_as<MechanicsStageOptions>();
  const MechanicsOptions& options = asked.mechanics;
  const TriangleMesh proxy = read_mesh(*call.input("proxy"), asked.frame, call.context);
  const MechanicsModel model = model_of(proxy, options, call.context);
  write_file_atomically(call.output_folder / "mechanics.json", mechanics_to_json(model));

  StageReport report;
  report.add("springs", model.springs.size());
  report.add("anchors", model.anchors.size());
  if (analyse_topology(proxy).boundary_edges == 0)
    report.add("mass_kg", 1e-9 * model.density_kg_per_m3 * signed_volume(proxy));
  // The springs' own: a membrane of the given thickness.
  report.add("spring_mass_kg", std::accumulate(model.mass_kg.begin(), model.mass_kg.end(), 0.0));
  if (model.body) report.add("tetrahedra", model.body->tetrahedra.size());
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
