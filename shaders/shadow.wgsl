// Extent and fading of the shadow map, which covers a square on the floor around the floor's centre.

/// Half the side of the map, as a fraction of the floor's radius.
const SHADOW_REACH = 0.32;
/// Height above the floor at which a surface casts 1/e of the shadow that it casts at height 0, as a fraction of the
/// floor's radius.
const SHADOW_HEIGHT = 0.035;
