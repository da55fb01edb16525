// All blocks that a deployed model may have.
#pragma once

#include "runtime/compensator/curve.hpp"
#include "runtime/compensator/dead_zone.hpp"
#include "runtime/compensator/hysteresis.hpp"
#include "runtime/compensator/lag.hpp"
#include "runtime/compensator/lti.hpp"
#include "runtime/compensator/play.hpp"
#include "runtime/compensator/pole_pair.hpp"
#include "runtime/compensator/saturation.hpp"
#include "runtime/compensator/sum.hpp"
