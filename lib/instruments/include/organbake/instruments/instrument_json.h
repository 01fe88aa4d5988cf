// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/bundle/json_fields.h"
#include "organbake/instruments/instrument.h"

namespace organbake {

// An instrument of a script as its document has it (interaction.schema.json). Reading throws
// BadDataError naming the document, the key and what it must be; what was written is read back to
// the last bit.
InstrumentPath instrument_from_json(const JsonField& field);
Json to_json(const InstrumentPath& instrument);

}  // namespace organbake
