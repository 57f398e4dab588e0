#include "core/estimator/studies.h"
