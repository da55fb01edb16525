#include "host/posture/complete.hpp"
