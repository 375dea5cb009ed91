// The map of the shadow: a square on the floor around its centre.

/// Half the side of the map, as a fraction of the floor's radius.
const SHADOW_REACH = 0.32;
/// Height above the floor at which the shadow is weaker by the factor e, as a fraction of the floor's radius.
const SHADOW_HEIGHT = 0.035;
