// From the name of a material model to the class that has its formulas.
#pragma once

#include "sim/deformable/materials/corotated.h"
#include "sim/deformable/materials/material_model.h"
#include "sim/deformable/materials/neo_hookean.h"
#include "sim/deformable/materials/st_venant_kirchhoff.h"

namespace duet {

/// Calls work(Model{}) for the class that has the formulas of `model`.
template <class Work>
decltype(auto) with_model(MaterialModel model, Work&& work) {
  switch (model) {
    case MaterialModel::corotated:
      return work(Corotated{});
    case MaterialModel::st_venant_kirchhoff:
      return work(StVenantKirchhoff{});
    case MaterialModel::neo_hookean:
      break;
  }
  return work(NeoHookean{});
}

}  // namespace duet
