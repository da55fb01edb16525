#include "host/posture/posture.hpp"
