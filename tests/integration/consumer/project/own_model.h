#pragma once

#include <memory>

#include "polyest/model.h"

// A mass that a constant friction brakes: dv/dt = −a, v(0) = v0, with the distance x measured.
std::shared_ptr<const polyest::Model> BrakedMass();
