#pragma once

#include "mapper/registration/registration.hpp"

namespace seastitch {

// Makes what the cells of a level know of their errors that of the noise where they are: the outer
// beams of a swath scatter several times as much as those below the vehicle. Without this the rims
// of submaps, which are their noisiest parts, drew neighbouring lines together by centimetres that
// add up over a survey. Sets Cell::noise from the scatter around, and multiplies the variance and
// covariances, which must be of unit noise, accordingly.
void WeighByLocalNoise(RegistrationSubmap::Level* level);

}  // namespace seastitch
