// The order in which step IV.2 takes its central bodies.
#pragma once

namespace duet {

/// Order of the central bodies of interpenetration resolution.
enum class PushOutOrder {
  together,  ///< All central bodies are solved at once.
  levels,    ///< The central bodies of each level of the contact graph are solved at once, level after level.
  frozen_levels  ///< As `levels`; in addition, supported bodies are held once their level is done.
};

}  // namespace duet
