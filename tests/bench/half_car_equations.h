#pragma once

// Gives the model of half_car.h by its equations, as a user would write them.

#include "polyest/equation_model.h"

namespace polyest::internal::bench {

inline EquationSpecification HalfCarEquations() {
  return {.states = {{"x1", "v1"},
                     {"x2", "v2"},
                     {"xt1", "vt1"},
                     {"xt2", "vt2"},
                     {"v1", "(m12*f2 - m22*f1)/(m11*m22 - m12^2)"},
                     {"v2", "(m12*f1 - m11*f2)/(m11*m22 - m12^2)"},
                     {"vt1", "(f1 + 96319.76*(y1 - xt1))/36.26"},
                     {"vt2", "(f2 + 96319.76*(y2 - xt2))/36.26"}},
          .outputs = {{"d1", "x1 - xt1"},
                      {"d2", "x2 - xt2"},
                      {"d1_rate", "v1 - vt1"},
                      {"d2_rate", "v2 - vt2"}},
          .intermediates = {{"d1", "x1 - xt1"},
                            {"d2", "x2 - xt2"},
                            {"f1", "19357.2*d1 + 100000*d1^3 + 142.14*tanh(10*(v1 - vt1))"},
                            {"f2", "19357.2*d2 + 100000*d2^3 + 142.14*tanh(10*(v2 - vt2))"},
                            {"share", "d/1.524"},
                            {"m11", "580/4 + 63.3316/1.524^2 + m_a*(1 - share)^2"},
                            {"m12", "580/4 - 63.3316/1.524^2 + m_a*share*(1 - share)"},
                            {"m22", "580/4 + 63.3316/1.524^2 + m_a*share^2"}},
          .parameters = {{"m_a", 0}, {"d", 0.762}},
          .inputs = {"y1", "y2"}};
}

}  // namespace polyest::internal::bench
